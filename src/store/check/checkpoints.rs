//! Files of unfinished trajectories and of failures: each must be whole, and belong to a job that can use it.

use crate::store::check::Examination;
use crate::store::checkpoint_file::{self, CheckpointError};
use crate::store::error::StoreError;
use crate::store::folders::{Folders, database, files_in};
use rusqlite::{Connection, OptionalExtension};
use std::path::Path;

/// Puts files aside that are of no use.
pub(super) fn examine(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    let folders = Folders::of(work.dir);
    for path in files_in(&folders.checkpoints())? {
        if let Some((problem, follows)) = useless(work.dir, conn, &path)? {
            work.put_aside(&path, problem, follows)?;
        }
    }
    for path in files_in(&folders.dumps())? {
        if let Err(CheckpointError::Damaged { problem, .. }) = checkpoint_file::read(&path) {
            work.put_aside(&path, problem, "`run --retry` of the job's class makes another")?;
        }
    }
    Ok(())
}

/// Why a checkpoint is of no use, and what follows from that; `None` for one that is.
fn useless(dir: &Path, conn: &Connection, path: &Path) -> Result<Option<(String, &'static str)>, StoreError> {
    if path.extension().is_some_and(|extension| extension == "tmp") {
        return Ok(Some(("it was never finished: a crash left it".to_owned(), "the one before it stays")));
    }
    let Some(named) = checkpoint_file::job_of(path) else { return Ok(None) };
    let anew = "`run` begins the trajectory anew";
    match checkpoint_file::read(path) {
        Ok(payload) if payload.job != named => return Ok(Some((format!("it is that of job {}", payload.job), anew))),
        Ok(_) => {}
        Err(CheckpointError::Io { path, source }) => return Err(StoreError::io(&path)(source)),
        Err(CheckpointError::Damaged { problem, .. }) => return Ok(Some((problem, anew))),
        Err(error) => return Ok(Some((error.to_string(), anew))),
    }
    let sql = "SELECT state FROM jobs WHERE job_id = ?1";
    let state = conn.query_row(sql, [named.to_string()], |row| row.get::<_, String>(0)).optional();
    Ok(match state.map_err(StoreError::sql(&database(dir)))?.as_deref() {
        Some("pending" | "running") => None,
        Some(_) => Some(("its job has ended: a crash left it".to_owned(), "nothing is lost")),
        None => Some(("its job is not in the store".to_owned(), "nothing is lost")),
    })
}

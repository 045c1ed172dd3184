//! Files of unfinished trajectories and of failures: each is whole, and belongs to a job that can use it.

use crate::parameters::JobId;
use crate::store::check::{Examination, within};
use crate::store::checkpoint_file::{self, CheckpointError};
use crate::store::{Store, StoreError, database, quarantine};
use rusqlite::{Connection, OptionalExtension};
use std::path::{Path, PathBuf};

/// A file that is of no use, why, and what follows.
struct Bad {
    path: PathBuf,
    problem: String,
    follows: &'static str,
}

/// Reports files that are of no use.
pub(super) fn check(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    for Bad { path, problem, follows } in bad(work.dir, conn)? {
        work.find(path, problem, format!("a repair moves it to quarantine/; {follows}"));
    }
    Ok(())
}

/// Moves files that are of no use to quarantine.
pub(super) fn repair(work: &mut Examination<'_>, store: &Store) -> Result<(), StoreError> {
    for Bad { path, problem, follows } in bad(work.dir, store.connection())? {
        let place = quarantine::take(work.dir, &path)?;
        work.find(path, problem, format!("moved to {}; {follows}", within(work.dir, &place)));
    }
    Ok(())
}

fn bad(dir: &Path, conn: &Connection) -> Result<Vec<Bad>, StoreError> {
    let mut found = Vec::new();
    for path in crate::store::check::files::listed(&dir.join("checkpoints"))? {
        if let Some((problem, follows)) = useless_checkpoint(dir, conn, &path)? {
            found.push(Bad { path, problem, follows });
        }
    }
    for path in crate::store::check::files::listed(&dir.join("dumps"))? {
        if let Err(problem @ CheckpointError::Damaged { .. }) = checkpoint_file::read(&path) {
            let follows = "`run --retry` of the job's class makes another";
            found.push(Bad { path, problem: said(&problem), follows });
        }
    }
    Ok(found)
}

fn said(error: &CheckpointError) -> String {
    match error {
        CheckpointError::Damaged { problem, .. } => problem.clone(),
        other => other.to_string(),
    }
}

fn useless_checkpoint(
    dir: &Path,
    conn: &Connection,
    path: &Path,
) -> Result<Option<(String, &'static str)>, StoreError> {
    if path.extension().is_some_and(|extension| extension == "tmp") {
        return Ok(Some(("it was never finished: a crash left it".to_owned(), "the one before it stays")));
    }
    let Some(named) = checkpoint_file::job_of(path) else { return Ok(None) };
    let anew = "`run` begins the trajectory anew";
    match checkpoint_file::read(path) {
        Ok(payload) if payload.job != named => return Ok(Some((format!("it is that of job {}", payload.job), anew))),
        Ok(_) => {}
        Err(CheckpointError::Io { path, source }) => return Err(StoreError::io(&path)(source)),
        Err(error) => return Ok(Some((said(&error), anew))),
    }
    let state = state(conn, named).map_err(StoreError::sql(&database(dir)))?;
    Ok(match state.as_deref() {
        Some("pending" | "running") => None,
        Some(_) => Some(("its job has ended: a crash left it".to_owned(), "nothing is lost")),
        None => Some(("its job is not in the store".to_owned(), "nothing is lost")),
    })
}

fn state(conn: &Connection, job: JobId) -> rusqlite::Result<Option<String>> {
    let sql = "SELECT state FROM jobs WHERE job_id = ?1";
    conn.query_row(sql, [job.to_string()], |row| row.get(0)).optional()
}

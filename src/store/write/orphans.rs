//! Files that no row of the database needs: what a crash left, sample files that were merged into others, and what
//! forgotten campaigns left.

use crate::parameters::JobId;
use crate::store::error::StoreError;
use crate::store::folders::{Folders, aside_dir, database, files_in, forgetting_dir, samples_dir};
use crate::store::write::{Store, catalogue};
use crate::store::{checkpoint_file, disk, lock, quarantine};
use rusqlite::{Connection, OptionalExtension};
use std::collections::HashSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Sample files that no row names, and what was cut short beside the database: half a backup, seal or repair.
pub(in crate::store) fn files(dir: &Path, conn: &Connection) -> Result<Vec<PathBuf>, StoreError> {
    let mut found = samples(dir, conn)?;
    found.extend(files_in(dir)?.into_iter().filter(|path| extension(path) == Some("tmp")));
    Ok(found)
}

/// Sample files that no row names, whole or half-written, in `samples/` and in `aside/`.
fn samples(dir: &Path, conn: &Connection) -> Result<Vec<PathBuf>, StoreError> {
    let known = catalogued(conn).map_err(StoreError::sql(&database(dir)))?;
    let files = [files_in(&samples_dir(dir))?, files_in(&aside_dir(dir))?].concat();
    Ok(files.into_iter().filter(|path| is_sample_file(path) && !is_named(path, &known)).collect())
}

/// Whether this program wrote the file; others in these folders are somebody else's.
fn is_sample_file(path: &Path) -> bool {
    matches!(extension(path), Some("tmp" | "parquet"))
}

fn is_named(path: &Path, known: &HashSet<OsString>) -> bool {
    path.file_name().is_some_and(|name| known.contains(name))
}

fn extension(path: &Path) -> Option<&str> {
    path.extension()?.to_str()
}

/// The names of the catalogued sample files, without their folder.
fn catalogued(conn: &Connection) -> rusqlite::Result<HashSet<OsString>> {
    let (files, _) = catalogue::sorted_out(conn)?;
    Ok(files.iter().map(|listed| listed.file.name.file_name().into()).collect())
}

/// Puts every sample file where it belongs: those that no row names go from `samples/` to `aside/`, and then those that
/// a row names come back. After a merge this is the swap; after a crash it is what that left undone.
pub(in crate::store) fn settle_samples(store: &Store) -> Result<(), StoreError> {
    let known = catalogued(&store.conn).map_err(StoreError::sql(&database(&store.dir)))?;
    let [home, aside] = [samples_dir(&store.dir), aside_dir(&store.dir)];
    let (inside, outside) = (files_in(&home)?, files_in(&aside)?);
    let out = inside.iter().filter(|path| is_sample_file(path) && !is_named(path, &known)).map(|path| (path, &aside));
    let back = outside.iter().filter(|path| is_named(path, &known)).map(|path| (path, &home));
    // Out first: for an instant a listing lacks rows, but it never shows a row twice.
    for (path, folder) in out.chain(back) {
        disk::rename(path, &folder.join(path.file_name().unwrap_or_default()))?;
    }
    Ok(())
}

/// Removes sample files that no row names. While readers may still look at some of them, it leaves all for the next
/// time.
pub(in crate::store) fn remove_samples(store: &Store) -> Result<(), StoreError> {
    let Some(_alone) = lock::without_readers(&store.dir)? else { return Ok(()) };
    for path in samples(&store.dir, &store.conn)? {
        tracing::debug!(file = %path.display(), "removing a sample file that no row names");
        disk::remove(&path)?;
    }
    Ok(())
}

/// Removes the copy of a campaign that was to be forgotten, where a crash came before the copy was whole: then nothing
/// has gone from the store.
pub(super) fn remove_half_a_copy(store: &Store) -> Result<(), StoreError> {
    disk::remove_folder(&forgetting_dir(&store.dir))
}

/// Removes half-written checkpoints, checkpoints of jobs that have ended, dumps of jobs that have not failed, and both
/// of jobs that were forgotten.
pub(in crate::store) fn remove_checkpoints(store: &Store) -> Result<(), StoreError> {
    let (folders, sql) = (store.folders(), StoreError::sql);
    let path = database(&store.dir);
    let mut find = store.conn.prepare("SELECT state FROM jobs WHERE job_id = ?1").map_err(sql(&path))?;
    for (folder, kept) in [(folders.checkpoints(), ["pending", "running"]), (folders.dumps(), ["failed"; 2])] {
        for file in files_in(&folder)? {
            let is_orphan = match checkpoint_file::job_of(&file) {
                Some(job) => {
                    let state = find.query_row([job.to_string()], |row| row.get::<_, String>(0)).optional();
                    match state.map_err(sql(&path))? {
                        Some(state) => !kept.contains(&state.as_str()),
                        // A file of a job that is not known may be somebody else's.
                        None => quarantine::is_forgotten(&store.dir, &file),
                    }
                }
                None => file.to_string_lossy().ends_with(".ckpt.tmp"),
            };
            if is_orphan {
                tracing::debug!(file = %file.display(), "removing what a crash left");
                disk::remove(&file)?;
            }
        }
    }
    Ok(())
}

/// Removes the checkpoints of jobs whose outcomes are committed.
pub(super) fn clear_checkpoints(folders: &Folders, jobs: impl Iterator<Item = JobId>) {
    let folder = folders.checkpoints();
    for job in jobs {
        let path = checkpoint_file::path_of(&folder, job);
        // Most jobs have none, and one that cannot be removed now goes at the next opening.
        if path.exists() {
            let _ = disk::remove(&path);
        }
    }
}

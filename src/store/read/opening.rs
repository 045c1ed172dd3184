//! Connecting to a database that is only read, also where nothing can be written.
//!
//! In WAL mode SQLite writes even to read: it makes `store.db-shm` beside the database. Where it has no right to, or no
//! room, a store that nobody writes (it was closed, so nothing waits in a log) is opened as a file that does not
//! change. If a run begins to write it meanwhile, [`still_unchanged`] says so.

use crate::store::error::StoreError;
use crate::store::folders::{database, is_unfinished};
use crate::store::read::{BUSY_TIMEOUT, plan_once};
use crate::store::schema::birth;
use crate::store::{connection, entries};
use rusqlite::{Connection, ErrorCode, OpenFlags, ffi};
use std::fmt::Write;
use std::path::Path;

/// Connects to the database for reading, whatever its schema is. Undoes what a dead process left half-written.
pub(in crate::store) fn connect(dir: &Path) -> Result<Connection, StoreError> {
    let path = database(dir);
    entries::refuse_foreign(dir)?;
    birth::roll_back(dir)?;
    match open(&path) {
        Err(error) if is_refusal(&error) => {
            // A file that cannot be read at all is another matter, which the system puts best.
            drop(entries::open(&path).map_err(StoreError::io(&path))?);
            if is_unfinished(dir) {
                return Err(StoreError::Unfinished(dir.to_owned()));
            }
            open_unchanging(&path).map_err(StoreError::sql(&path))
        }
        opened => opened.map_err(StoreError::sql(&path)),
    }
}

fn open(path: &Path) -> rusqlite::Result<Connection> {
    set_up(connection::open(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?)
}

fn set_up(conn: Connection) -> rusqlite::Result<Connection> {
    conn.busy_timeout(BUSY_TIMEOUT)?;
    plan_once(&conn)?;
    conn.pragma_update(None, "query_only", true)?;
    // Looking jobs up by their hash goes all over the database. This is also the first look at the file.
    conn.pragma_update(None, "cache_size", -64 * 1024)?;
    Ok(conn)
}

/// Opens a file that does not change: without a lock, and without a look at any log.
fn open_unchanging(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
    let conn = set_up(connection::open_uri(&unchanging(path), flags)?)?;
    // It is so already, in effect; saying it lets `still_unchanged` tell such a connection from others.
    conn.pragma_update(None, "locking_mode", "exclusive")?;
    Ok(conn)
}

/// Whether SQLite could not write what it needs beside the database, for want of the right or of room.
fn is_refusal(error: &rusqlite::Error) -> bool {
    let no_shared_memory = [ffi::SQLITE_IOERR_SHMOPEN, ffi::SQLITE_IOERR_SHMSIZE, ffi::SQLITE_IOERR_SHMMAP];
    error.sqlite_error().is_some_and(|error| {
        matches!(error.code, ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::DiskFull)
            || no_shared_memory.contains(&error.extended_code)
    })
}

/// The name by which SQLite opens a file that does not change: no lock, no log.
fn unchanging(path: &Path) -> String {
    let mut uri = "file:".to_owned();
    for &byte in path.as_os_str().as_encoded_bytes() {
        match byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte) {
            true => uri.push(char::from(byte)),
            // Writing to a String cannot fail.
            false => drop(write!(uri, "%{byte:02X}")),
        }
    }
    uri + "?immutable=1"
}

/// Makes sure that nobody began to write a store that `conn` has read as a file that does not change.
///
/// # Errors
/// [`StoreError::Changed`].
pub(super) fn still_unchanged(conn: &Connection, dir: &Path) -> Result<(), StoreError> {
    let mode = conn.pragma_query_value(None, "locking_mode", |row| row.get::<_, String>(0));
    let unchanging = mode.map_err(StoreError::sql(&database(dir)))? == "exclusive";
    if unchanging && is_unfinished(dir) { Err(StoreError::Changed(dir.to_owned())) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::Store;

    #[test]
    fn a_closed_store_is_read_as_a_file_that_does_not_change_whatever_its_name() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["plain", "with space", "100%?", "a#b", "q'\"", "größe"] {
            let dir = folder.path().join(name);
            drop(Store::open(&dir).unwrap());
            let before = std::fs::read_dir(&dir).unwrap().count();
            let conn = open_unchanging(&database(&dir)).unwrap();
            let jobs: i64 = conn.query_row("SELECT count(*) FROM jobs", [], |row| row.get(0)).unwrap();
            assert_eq!(jobs, 0);
            assert_eq!(std::fs::read_dir(&dir).unwrap().count(), before, "{name}: nothing is written beside it");
        }
    }

    #[test]
    fn a_run_that_begins_meanwhile_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path();
        drop(Store::open(dir).unwrap());
        let conn = open_unchanging(&database(dir)).unwrap();
        still_unchanged(&conn, dir).unwrap();
        let store = Store::open(dir).unwrap();
        assert!(matches!(still_unchanged(&conn, dir), Err(StoreError::Changed(_))));
        let other = connect(dir).unwrap();
        still_unchanged(&other, dir).unwrap();
        drop(store);
    }
}

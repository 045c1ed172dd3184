//! How a database comes into being, and how one that a dead process left half-written becomes whole again.
//!
//! A new database is made in memory, written under another name, flushed, and renamed. It is in the mode of write-ahead
//! logs from its first byte on, so there is no instant at which a crash leaves half of it, or a rollback journal.
//!
//! A journal may be there all the same: earlier programs made databases in place, and other programs can change the
//! mode. Pages of the database are then half old and half new until the journal is rolled back. SQLite does that at the
//! next opening, but not through a connection that only reads. So whoever opens a store first asks [`roll_back`].

use crate::store::error::StoreError;
use crate::store::folders::{database, journal, log};
use crate::store::{connection, disk, entries, lock, quarantine, schema, seal};
use rusqlite::{Connection, MAIN_DB};
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

/// Where a database says how it is written, and what it says in the mode of write-ahead logs.
const MODE: Range<usize> = 18..20;
const LOGGED: [u8; 2] = [2, 2];

/// Opens the database of the store in `dir` for writing, and makes it if nothing was ever written to it. For the holder
/// of the store's lock.
///
/// # Errors
/// [`StoreError::Newer`] and [`StoreError::Foreign`] before anything is touched; else what SQLite or the system report.
pub(in crate::store) fn open_or_create(dir: &Path) -> Result<Connection, StoreError> {
    let path = database(dir);
    let open = || connection::writing(dir).map_err(StoreError::sql(&path));
    if !is_empty(dir) {
        let conn = open()?;
        if schema::version(&conn, &path)?.is_some() {
            return Ok(conn);
        }
    }
    create(dir)?;
    open()
}

/// Whether there is no database, or one without a byte.
pub(in crate::store) fn is_empty(dir: &Path) -> bool {
    database(dir).metadata().map_or(0, |file| file.len()) == 0
}

/// Makes the database of a new store, all at once.
fn create(dir: &Path) -> Result<(), StoreError> {
    // What belongs to a database that is gone must not meet the new one.
    for leftover in [log(dir), journal(dir)].iter().filter(|path| path.exists()) {
        quarantine::take(dir, leftover)?;
    }
    seal::remove(dir)?;
    let (path, half) = (database(dir), dir.join("store.db.new.tmp"));
    disk::write_file(&half, &first_bytes(&path)?)?;
    disk::rename(&half, &path)?;
    disk::sync_folder(dir)
}

/// The bytes of a database of the latest schema that holds nothing.
fn first_bytes(path: &Path) -> Result<Vec<u8>, StoreError> {
    let make = || -> Result<Vec<u8>, StoreError> {
        let mut conn = Connection::open_in_memory().map_err(StoreError::sql(path))?;
        schema::migrate(&mut conn, Path::new(":memory:"))?;
        Ok(conn.serialize(MAIN_DB).map_err(StoreError::sql(path))?.to_vec())
    };
    let mut bytes = make()?;
    bytes[MODE].copy_from_slice(&LOGGED);
    Ok(bytes)
}

/// Whether there is a journal that may have to be rolled back.
fn has_journal(dir: &Path) -> bool {
    journal(dir).metadata().is_ok_and(|file| file.len() > 0)
}

/// The last bytes of a journal that names another file, a "super-journal": <https://www.sqlite.org/fileformat2.html>.
const POINTING: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];

/// Refuses a journal that names another file, which SQLite would read and then remove, wherever it is. Such journals
/// come from transactions over several databases, and no meniscus ever made one.
fn refuse_pointing_journal(dir: &Path) -> Result<(), StoreError> {
    let path = journal(dir);
    let mut tail = Vec::new();
    let mut read = || {
        let mut file = entries::open(&path)?;
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(POINTING.len() as u64)))?;
        file.read_to_end(&mut tail)
    };
    read().map_err(StoreError::io(&path))?;
    match tail == POINTING {
        true => Err(StoreError::ForeignEntry { path, found: "a journal that names another file", wanted: "its own" }),
        false => Ok(()),
    }
}

/// Undoes the change in whose midst the last writer died, if there is one, before somebody reads.
///
/// # Errors
/// [`StoreError::HalfWritten`] for those who may not write in the store; what SQLite reports.
pub(in crate::store) fn roll_back(dir: &Path) -> Result<(), StoreError> {
    if !has_journal(dir) {
        return Ok(());
    }
    match lock::take(dir) {
        Ok(_alone) => roll_back_alone(dir),
        // The writer lives, and the journal is its own.
        Err(StoreError::Locked { .. }) => Ok(()),
        Err(StoreError::Io { .. }) => Err(StoreError::HalfWritten(dir.to_owned())),
        Err(error) => Err(error),
    }
}

/// The same for the holder of the store's lock.
pub(in crate::store) fn roll_back_alone(dir: &Path) -> Result<(), StoreError> {
    if !has_journal(dir) || !database(dir).exists() {
        return Ok(());
    }
    refuse_pointing_journal(dir)?;
    // A connection that may write rolls back before it reads. What else is wrong is found by those who read.
    let read = |conn: Connection| conn.query_row("SELECT count(*) FROM sqlite_master", [], |_| Ok(()));
    match connection::writing(dir).and_then(read) {
        Err(error) if error.sqlite_error_code() == Some(rusqlite::ErrorCode::ReadOnly) => {
            Err(StoreError::HalfWritten(dir.to_owned()))
        }
        _ => {
            tracing::debug!(dir = %dir.display(), "undid what a dead process had left half-written");
            Ok(())
        }
    }
}

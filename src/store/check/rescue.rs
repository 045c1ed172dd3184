//! Copying what can be read of a damaged database into a new one.
//!
//! Tables are walked by key. Where a page cannot be read, the walk goes on behind it; indices are not read at all, for a
//! new database makes its own. What is copied is judged afterwards, row by row, as every store's rows are: ids are hashes
//! of what they name, so a wrong row does not pass for a right one.

use crate::store::check::{count, header};
use crate::store::seal::{self, Seal};
use crate::store::{StoreError, database, disk, migrate};
use rusqlite::types::Value;
use rusqlite::{Connection, ErrorCode, OptionalExtension, params_from_iter};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// What came of a rescue.
#[derive(Debug, Default)]
pub(super) struct Rescued {
    /// Jobs that were copied.
    pub jobs: u64,
    /// Those that have an outcome.
    pub ended: u64,
    /// Rows of all tables.
    pub rows: u64,
    /// Keys at which nothing could be read.
    pub unreadable: u64,
}

/// Keys that are tried one by one behind an unreadable place: more than an inner page of the tree leads to.
const PATIENCE: i64 = 100_000;

/// The tables of a store, each after those that it refers to.
const TABLES: [&str; 11] = [
    "campaigns",
    "points",
    "jobs",
    "provenance",
    "outcomes",
    "clogs",
    "shape_rows",
    "sample_files",
    "sample_index",
    "lambda_rows",
    "speed_rows",
];

/// Whether an error of SQLite says that the file is damaged, rather than busy or full.
pub(super) fn is_damage(error: &rusqlite::Error) -> bool {
    match error {
        rusqlite::Error::SqliteFailure(error, _) => {
            matches!(
                error.code,
                ErrorCode::DatabaseCorrupt
                    | ErrorCode::NotADatabase
                    | ErrorCode::SystemIoFailure
                    | ErrorCode::CannotOpen
            ) || error.extended_code == rusqlite::ffi::SQLITE_ERROR
        }
        rusqlite::Error::SqlInputError { .. } => true,
        rusqlite::Error::Utf8Error(..)
        | rusqlite::Error::InvalidColumnType(..)
        | rusqlite::Error::FromSqlConversionFailure(..)
        | rusqlite::Error::QueryReturnedNoRows => true,
        _ => false,
    }
}

/// Makes a database at `new` of what can be read of that of the store in `dir`; with a seal, the pages that differ from
/// it are not read.
pub(super) fn rescue(dir: &Path, new: &Path, sealed: Option<(&Seal, &[usize])>) -> Result<Rescued, StoreError> {
    let folder = clear(dir)?;
    std::fs::create_dir(&folder).map_err(StoreError::io(&folder))?;
    let copy = database(&folder);
    patched_copy(dir, &copy, sealed)?;
    for leftover in ["", "-wal", "-shm", "-journal"] {
        disk::remove(&dir.join(format!("store.db.repair.tmp{leftover}")))?;
    }
    disk::create(new)?;
    let mut target = Connection::open(new).map_err(StoreError::sql(new))?;
    migrate::migrate(&mut target, new)?;
    let rescued = match Connection::open(&copy) {
        Ok(source) => copy_tables(&source, &mut target).map_err(StoreError::sql(new))?,
        Err(_) => Rescued::default(),
    };
    drop(target);
    let file = std::fs::File::open(new).map_err(StoreError::io(new))?;
    disk::sync(&file, new)?;
    clear(dir)?;
    Ok(rescued)
}

/// Removes the folder of a rescue's working copy, where an earlier one left it.
pub(super) fn clear(dir: &Path) -> Result<PathBuf, StoreError> {
    let folder = dir.join("rescue.tmp");
    match std::fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(StoreError::io(&folder)(error)),
        _ => Ok(folder),
    }
}

/// Copies database and log, makes the header readable, and spoils the pages that must not be believed.
fn patched_copy(dir: &Path, copy: &Path, sealed: Option<(&Seal, &[usize])>) -> Result<(), StoreError> {
    let path = database(dir);
    let mut bytes = std::fs::read(&path).map_err(StoreError::io(&path))?;
    let log = seal::log(dir);
    let has_log = log.metadata().is_ok_and(|log| log.len() > 0);
    if let Some((seal, pages)) = sealed {
        bytes.resize(seal.n_pages() * seal.page_size(), 0);
        for page in pages.iter().filter(|&&page| page < seal.n_pages()) {
            // No kind of page begins so, no text holds it, and as a number it is none.
            bytes[page * seal.page_size()..][..seal.page_size()].fill(0xFF);
        }
        bytes[..seal.page_size()].copy_from_slice(&seal.first_page);
    } else if !header::problems(&bytes, bytes.len() as u64, has_log).is_empty() && bytes.len() > header::LENGTH {
        let mut header = header::rebuilt(&bytes, bytes.len() as u64, migrate::latest());
        if has_log {
            header[18..20].fill(2);
        }
        bytes[..header::LENGTH].copy_from_slice(&header);
    }
    std::fs::write(copy, bytes).map_err(StoreError::io(copy))?;
    if has_log {
        let to = copy.with_extension("db-wal");
        std::fs::copy(&log, &to).map_err(StoreError::io(&to))?;
    }
    Ok(())
}

fn copy_tables(source: &Connection, target: &mut Connection) -> rusqlite::Result<Rescued> {
    let mut rescued = Rescued::default();
    target.pragma_update(None, "foreign_keys", false)?;
    let transaction = target.transaction()?;
    for table in TABLES {
        let wanted = columns(&transaction, table)?;
        let Ok(there) = columns(source, table) else { continue };
        let there: HashSet<_> = there.into_iter().collect();
        let shared: Vec<_> = wanted.into_iter().filter(|column| there.contains(column)).collect();
        if !shared.is_empty() {
            copy_table(source, &transaction, table, &shared, &mut rescued)?;
        }
    }
    // Results outlive the name of the campaign that brought them.
    transaction.execute_batch(
        "INSERT OR IGNORE INTO campaigns (key, name, text, text_hash, first_used, last_used)
             SELECT DISTINCT campaign, 'rescued', '', 'of campaign ' || campaign, 0, 0 FROM jobs
             WHERE campaign NOT IN (SELECT key FROM campaigns);
         UPDATE outcomes SET provenance = NULL WHERE provenance NOT IN (SELECT key FROM provenance);",
    )?;
    rescued.jobs = count(&transaction, "SELECT count(*) FROM jobs")?;
    rescued.ended = count(&transaction, "SELECT count(*) FROM outcomes")?;
    transaction.commit()?;
    Ok(rescued)
}

fn columns(conn: &Connection, table: &str) -> rusqlite::Result<Vec<String>> {
    let mut statement = conn.prepare("SELECT name FROM pragma_table_info(?1)")?;
    statement.query_map([table], |row| row.get(0))?.collect()
}

fn copy_table(
    source: &Connection,
    target: &Connection,
    table: &str,
    columns: &[String],
    rescued: &mut Rescued,
) -> rusqlite::Result<()> {
    let names = columns.join(", ");
    let places = vec!["?"; columns.len()].join(", ");
    let mut insert = target.prepare(&format!("INSERT OR IGNORE INTO {table} ({names}) VALUES ({places})"))?;
    // NOT INDEXED: an index may be what is damaged.
    let walk = format!("SELECT rowid, {names} FROM {table} NOT INDEXED WHERE rowid >= ?1 ORDER BY rowid");
    let last = format!("SELECT rowid FROM {table} NOT INDEXED ORDER BY rowid DESC LIMIT 1");
    let last: Option<i64> = source.query_row(&last, [], |row| row.get(0)).optional().unwrap_or(Some(i64::MAX));
    let Some(last) = last else { return Ok(()) };
    // A tree of which neither end can be read has lost its root.
    let mut patience = if last == i64::MAX { 100 } else { PATIENCE };
    let (mut next, mut misses) = (1, 0);
    // Of a job's shapes some may be lost and some not: those on either side of a gap are not believed.
    let job = (table == "shape_rows").then(|| columns.iter().position(|column| column == "job")).flatten();
    let mut forget = target.prepare("DELETE FROM outcomes WHERE job = ?1")?;
    let (mut before, mut after_gap) = (None, false);
    'walk: while next <= last && misses < patience {
        let Ok(mut statement) = source.prepare_cached(&walk) else { return Ok(()) };
        let Ok(mut rows) = statement.query([next]) else { return Ok(()) };
        loop {
            let row = match rows.next() {
                Ok(Some(row)) => row,
                Ok(None) => break 'walk,
                Err(_) => break,
            };
            let Ok(key) = row.get::<_, i64>(0) else { break };
            if key < next {
                break;
            }
            let values: rusqlite::Result<Vec<Value>> = (1..=columns.len()).map(|column| row.get(column)).collect();
            // A row that a law of the new database forbids is not what was written.
            let owner = values.as_ref().ok().and_then(|values| job.map(|job| values[job].clone()));
            match values.and_then(|values| insert.execute(params_from_iter(values))) {
                Ok(inserted) => rescued.rows += inserted as u64,
                Err(_) => {
                    rescued.unreadable += 1;
                    after_gap = true;
                }
            }
            if std::mem::take(&mut after_gap) {
                [&before, &owner].into_iter().flatten().try_for_each(|job| forget.execute([job]).map(drop))?;
            }
            before = owner;
            (next, misses, patience) = (key.saturating_add(1), 0, PATIENCE);
        }
        rescued.unreadable += u64::from(misses == 0);
        after_gap = true;
        (next, misses) = (next.saturating_add(1), misses + 1);
    }
    if after_gap {
        before.iter().try_for_each(|job| forget.execute([job]).map(drop))?;
    }
    Ok(())
}

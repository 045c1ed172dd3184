//! A new database from what can be read of a damaged one.
//!
//! Tables are walked by key. Where a row cannot be read, the walk goes on behind it. Indices are not read at all,
//! because a new database makes its own. What is copied is judged afterwards as the rows of every store are, and ids
//! are hashes of what they name, so a wrong row does not pass for a right one.

use crate::store::check::{count, header};
use crate::store::error::StoreError;
use crate::store::folders::{database, log};
use crate::store::seal::Seal;
use crate::store::{connection, disk, entries, schema};
use rusqlite::types::Value;
use rusqlite::{Connection, ErrorCode, OpenFlags, Row, Statement, params_from_iter};
use std::path::{Path, PathBuf};

/// Two keys between which rows are missing.
type Gap = [i64; 2];

/// Whether an error of SQLite says that the file is damaged, and not that it is in use or out of reach.
pub(super) fn is_damage(error: &rusqlite::Error) -> bool {
    use ErrorCode::{CannotOpen, DatabaseBusy, DatabaseLocked, DiskFull, OutOfMemory, PermissionDenied, ReadOnly};
    let other = [CannotOpen, DatabaseBusy, DatabaseLocked, DiskFull, OutOfMemory, PermissionDenied, ReadOnly];
    error.sqlite_error_code().is_none_or(|code| !other.contains(&code))
}

/// The folder in which a rescue works, within the store.
fn folder(dir: &Path) -> PathBuf {
    dir.join("rescue.tmp")
}

/// Removes what a rescue worked with.
pub(super) fn clear(dir: &Path) -> Result<(), StoreError> {
    disk::remove_folder(&folder(dir))
}

/// Copies the database and its log, and returns where the copy is. Its header is made readable; pages that differ from
/// the seal are overwritten, so that nothing in them is believed.
pub(super) fn patch(dir: &Path, sealed: Option<(&Seal, &[usize])>) -> Result<PathBuf, StoreError> {
    let (path, log, copy) = (database(dir), log(dir), folder(dir).join("patched.db"));
    let has_log = log.metadata().is_ok_and(|log| log.len() > 0);
    let mut bytes = entries::read(&path).map_err(StoreError::io(&path))?;
    if let Some((seal, pages)) = sealed {
        let size = seal.page_size();
        bytes.resize(seal.n_pages() * size, 0);
        for page in pages.iter().filter(|&&page| page < seal.n_pages()) {
            // No page of SQLite starts with this byte, and it occurs in no UTF-8 text, so SQLite refuses what it needs
            // of such a page.
            bytes[page * size..][..size].fill(0xFF);
        }
        bytes[..size].copy_from_slice(&seal.first_page);
    } else if bytes.len() > header::LENGTH && header::problem(&bytes, bytes.len() as u64, has_log).is_some() {
        let file_bytes = bytes.len() as u64;
        header::rebuild(&mut bytes, file_bytes, has_log);
    }
    disk::create_folder(&folder(dir))?;
    disk::write_file(&copy, &bytes)?;
    if has_log {
        disk::copy(&log, &copy.with_extension("db-wal"))?;
    }
    Ok(copy)
}

/// Makes a new database of what can be read of a patched copy; returns where it is, and what came of it in words.
pub(super) fn rebuild(dir: &Path, patched: &Path) -> Result<(PathBuf, String), StoreError> {
    let new = folder(dir).join("new.db");
    disk::create(&new)?;
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE;
    let mut target = connection::open(&new, flags).map_err(StoreError::sql(&new))?;
    schema::migrate(&mut target, &new)?;
    let told = match connection::open(patched, flags) {
        Ok(source) => copy_tables(&source, &mut target).map_err(StoreError::sql(&new))?,
        Err(_) => "nothing of it could be read".to_owned(),
    };
    drop(target);
    let file = entries::open(&new).map_err(StoreError::io(&new))?;
    disk::sync(&file, &new)?;
    Ok((new, told))
}

fn copy_tables(source: &Connection, target: &mut Connection) -> rusqlite::Result<String> {
    target.pragma_update(None, "foreign_keys", false)?;
    let transaction = target.transaction()?;
    let (mut places, mut torn_shapes) = (0, Vec::new());
    for table in names(&transaction, "SELECT name FROM sqlite_master WHERE type = 'table'")? {
        let columns = format!("SELECT name FROM pragma_table_info('{table}')");
        // A view or a virtual table of that name is not read: it may have no end.
        let is_table = format!(
            "SELECT name FROM sqlite_master WHERE type = 'table' AND name = '{table}' AND sql NOT LIKE 'create virtual%'"
        );
        let is_table = names(source, &is_table).is_ok_and(|found| !found.is_empty());
        let there = if is_table { names(source, &columns).unwrap_or_default() } else { Vec::new() };
        let mut shared = names(&transaction, &columns)?;
        shared.retain(|column| there.contains(column));
        if !shared.is_empty() {
            let gaps = copy_table(source, &transaction, &table, &shared.join(", "))?;
            places += gaps.len();
            if table == "shape_rows" {
                torn_shapes = gaps;
            }
        }
    }
    // A job has several shapes, and of one beside a gap some may be lost: it is computed again.
    let mut forget = transaction
        .prepare("DELETE FROM outcomes WHERE job IN (SELECT job FROM shape_rows WHERE rowid IN (?1, ?2))")?;
    torn_shapes.iter().try_for_each(|gap| forget.execute(*gap).map(drop))?;
    drop(forget);
    // What is copied may be of an earlier schema.
    schema::derived::fill(&transaction)?;
    let jobs = count(&transaction, "SELECT count(*) FROM jobs")?;
    let ended = count(&transaction, "SELECT count(*) FROM outcomes")?;
    transaction.commit()?;
    Ok(format!("{jobs} jobs were copied, {ended} of them with their end; {places} places could not be read"))
}

fn names(conn: &Connection, sql: &str) -> rusqlite::Result<Vec<String>> {
    conn.prepare(sql)?.query_map([], |row| row.get(0))?.collect()
}

/// Copies the rows of a table that can be read; returns the gaps between them.
///
/// Behind a row that cannot be read, the walk tries the key after it, then one two further on, then four, eight, and
/// so on. So it gets across any gap in few steps, and loses at most as many rows again as are damaged.
fn copy_table(source: &Connection, target: &Connection, table: &str, columns: &str) -> rusqlite::Result<Vec<Gap>> {
    let places = ", ?".repeat(columns.split(',').count());
    let mut insert = target.prepare(&format!("INSERT OR IGNORE INTO {table} (rowid, {columns}) VALUES (?{places})"))?;
    // NOT INDEXED: the index may be what is damaged.
    let walk = format!("SELECT rowid, {columns} FROM {table} NOT INDEXED WHERE rowid >= ?1 ORDER BY rowid");
    let (mut next, mut stride) = (1_i64, 1_i64);
    let (mut gaps, mut before, mut in_gap) = (Vec::new(), 0, false);
    while let Ok(mut statement) = source.prepare_cached(&walk) {
        let mut rows = statement.query([next])?;
        let at_end = loop {
            let Ok(row) = rows.next() else { break false };
            let Some(row) = row else { break true };
            let key = row.get(0)?;
            if key < next {
                // A damaged tree leads back to where the walk has been.
                break false;
            }
            match copy_row(row, &mut insert) {
                Ok(()) => {
                    if std::mem::take(&mut in_gap) {
                        gaps.push([before, key]);
                    }
                    before = key;
                }
                // A value that cannot be read, or one that a law of the new database forbids.
                Err(_) => in_gap = true,
            }
            (next, stride) = (key.saturating_add(1), 1);
        };
        if at_end {
            break;
        }
        in_gap = true;
        next = next.saturating_add(stride);
        let Some(double) = stride.checked_mul(2) else { break };
        stride = double;
    }
    if in_gap {
        gaps.push([before, before]);
    }
    Ok(gaps)
}

fn copy_row(row: &Row<'_>, insert: &mut Statement<'_>) -> rusqlite::Result<()> {
    let values: Vec<Value> =
        (0..insert.parameter_count()).map(|column| row.get(column)).collect::<rusqlite::Result<_>>()?;
    insert.execute(params_from_iter(values)).map(drop)
}

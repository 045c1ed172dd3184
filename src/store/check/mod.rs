//! `meniscus check`: whether a store is what it should be, and putting it right.
//!
//! The database is judged first (its seal, its header, SQLite's own check, its schema), for all else is judged by it: then
//! its rows against each other, against the hashes that name them and against the plans of its campaigns, the sample files
//! against the catalogue, the checkpoints against their checksums, and at last what lies about.
//!
//! A repair removes nothing: broken files go to `quarantine/`, the database is copied there before a row changes, and what
//! cannot be trusted is computed again by the next `run`.

mod checkpoints;
mod database;
pub(super) mod files;
mod header;
mod identity;
mod plan;
mod rescue;
mod rows;

use crate::store::{Store, StoreError, database as database_of, lock, quarantine};
use rusqlite::Connection;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Something in a store that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The file it is about, within the store's folder.
    pub file: PathBuf,
    /// What is wrong.
    pub problem: String,
    /// What a repair will do about it, or has done.
    pub cure: String,
}

/// What a check found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CheckReport {
    /// What is wrong; empty for a sound store.
    pub findings: Vec<Finding>,
    /// What could not be judged, and why.
    pub notes: Vec<String>,
    /// Jobs that were looked at.
    pub jobs: u64,
    /// Sample files that were looked at.
    pub files: u64,
    /// Whether the findings were put right.
    pub repaired: bool,
}

/// What a check works on.
struct Examination<'a> {
    dir: &'a Path,
    report: CheckReport,
}

impl Examination<'_> {
    /// Notes a finding about a file of the store.
    fn find(&mut self, file: impl AsRef<Path>, problem: impl Into<String>, cure: impl Into<String>) {
        let file = file.as_ref().strip_prefix(self.dir).unwrap_or(file.as_ref()).to_owned();
        self.report.findings.push(Finding { file, problem: problem.into(), cure: cure.into() });
    }
}

/// Checks the store in `dir` and changes nothing.
///
/// While another process writes the store, what that one may just be doing is left out, with a note.
///
/// # Errors
/// [`StoreError::Missing`] without a store, [`StoreError::Newer`], [`StoreError::Foreign`]; what the system reports.
pub fn check(dir: &Path) -> Result<CheckReport, StoreError> {
    is_store(dir)?;
    let mut work = Examination { dir, report: CheckReport::default() };
    let held = hold(dir, &mut work)?;
    if !database::check(&mut work, held.is_some())? {
        work.report.notes.push("rows and sample files can be judged once the database is repaired".to_owned());
        return Ok(work.report);
    }
    let conn = database::connect(dir)?;
    if crate::store::migrate::version(&conn, &database_of(dir))?.is_none() {
        work.report.notes.push("nothing was ever written to it".to_owned());
        return Ok(work.report);
    }
    let snapshot = conn.unchecked_transaction().map_err(StoreError::sql(&database_of(dir)))?;
    rows::check(&mut work, &snapshot)?;
    plan::check(&mut work, &snapshot)?;
    files::check(&mut work, &snapshot)?;
    if held.is_some() {
        checkpoints::check(&mut work, &snapshot)?;
        for path in files::strangers(dir, &snapshot)? {
            let cure = "a repair moves it to quarantine/, the next `run` removes it";
            work.find(path, "it belongs to no outcome: a crash left it", cure);
        }
    }
    Ok(work.report)
}

/// Checks the store in `dir` and puts right what is wrong; `run` then computes what was lost.
///
/// Does it in an order that a crash may cut at any point: another repair goes on.
///
/// # Errors
/// As [`check`]; [`StoreError::Locked`] while another process writes the store.
pub fn repair(dir: &Path) -> Result<CheckReport, StoreError> {
    is_store(dir)?;
    lock::refuse_network(dir)?;
    let mut work = Examination { dir, report: CheckReport { repaired: true, ..CheckReport::default() } };
    let lock = lock::take(dir)?;
    database::repair(&mut work)?;
    let mut store = Store::connect(dir, lock)?;
    rows::repair(&mut work, &mut store)?;
    plan::repair(&mut work, &mut store)?;
    files::repair(&mut work, &mut store)?;
    checkpoints::repair(&mut work, &store)?;
    for path in files::strangers(dir, store.connection())? {
        let place = quarantine::take(dir, &path)?;
        work.find(path, "it belongs to no outcome: a crash left it", format!("moved to {}", within(dir, &place)));
    }
    Ok(work.report)
}

/// Refuses a folder that no store ever was in.
fn is_store(dir: &Path) -> Result<(), StoreError> {
    let was = database_of(dir).exists() || crate::store::seal::path(dir).exists();
    if was || !files::listed(&crate::store::samples_dir(dir))?.is_empty() {
        return Ok(());
    }
    Err(StoreError::Missing(dir.to_owned()))
}

/// Keeps writers away while a check looks; `None`, with a note, where it cannot.
fn hold(dir: &Path, work: &mut Examination<'_>) -> Result<Option<File>, StoreError> {
    match lock::take(dir) {
        Ok(lock) => Ok(Some(lock)),
        Err(StoreError::Locked { holder, .. }) => {
            let note = format!("{holder} is at work: what it has not committed yet was left out");
            work.report.notes.push(note);
            Ok(None)
        }
        Err(StoreError::Io { source, .. }) => {
            work.report.notes.push(format!("the store cannot be locked ({source}): files not committed were left out"));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// A path as people read it, within the store's folder.
fn within(dir: &Path, path: &Path) -> String {
    path.strip_prefix(dir).unwrap_or(path).display().to_string()
}

/// Copies the database into quarantine, before rows of it change; at most once a repair.
fn keep_a_copy(store: &Store, kept: &mut Option<PathBuf>) -> Result<(), StoreError> {
    if kept.is_none() {
        let place = quarantine::place_for(store.dir(), &database_of(store.dir()))?;
        crate::store::migrate::copy_to(store.connection(), &database_of(store.dir()), &place)?;
        *kept = Some(place);
    }
    Ok(())
}

/// One number from the database.
fn count(conn: &Connection, sql: &str) -> rusqlite::Result<u64> {
    conn.query_row(sql, [], |row| row.get::<_, i64>(0)).map(|count| count as u64)
}

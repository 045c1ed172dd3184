//! `meniscus check`: whether a store is what it should be, and putting it right.
//!
//! The database comes first, because all else is judged by it: `database.rs` compares it with its seal, or, where a
//! kill left none, with what every store has in its header (`header.rs`), and asks SQLite. Then `rows.rs` compares
//! rows with each other and with the hashes that name them (`identity.rs`), `files.rs` the sample files with the
//! catalogue, `checkpoints.rs` the checkpoints and dumps with their checksums. What remains are files that no row
//! names.
//!
//! **Durability.** A repair removes nothing. Broken files go to `quarantine/`, and the database is copied there before
//! a row changes. Whatever cannot be trusted is set back to pending, and the next `run` computes it. A repair can be
//! killed at any point and started again.
//!
//! **Locking.** A check keeps writers away while it looks. Where a run is at work it looks all the same, and leaves
//! out, with a note, what that run may just be doing. A repair needs the store for itself.
//!
//! **Compatibility.** A check reads a store of any schema so far and does not upgrade it; a repair does.
//!
//! **Proportion.** A campaign can be computed again. So a rule finds damage and names the jobs; it does not reconstruct
//! numbers. What `run` brings back by itself (a job that is missing altogether) has no rule here.

mod checkpoints;
mod database;
mod files;
mod header;
mod identity;
mod rescue;
mod rows;

use crate::parameters::shown;
use crate::store::error::StoreError;
use crate::store::folders::{database as database_of, files_in, refuse_no_folder, samples_dir};
use crate::store::write::{Store, orphans};
use crate::store::{entries, lock, quarantine, read, schema, seal};
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

/// A check or a repair under way.
struct Examination<'a> {
    dir: &'a Path,
    report: CheckReport,
    /// Where this repair copied the database before it changed a row.
    copy: Option<PathBuf>,
}

impl<'a> Examination<'a> {
    fn new(dir: &'a Path, repaired: bool) -> Self {
        Self { dir, report: CheckReport { repaired, ..CheckReport::default() }, copy: None }
    }

    /// Notes a finding about a file of the store.
    fn find(&mut self, file: impl AsRef<Path>, problem: impl Into<String>, cure: impl Into<String>) {
        let file = self.within(file.as_ref()).into();
        self.report.findings.push(Finding { file, problem: problem.into(), cure: cure.into() });
    }

    /// Notes a file that is of no use. A repair moves it to quarantine; a check says that it will.
    fn put_aside(&mut self, file: &Path, problem: impl Into<String>, follows: &str) -> Result<(), StoreError> {
        let cure = match self.report.repaired {
            true => format!("moved to {}; {follows}", self.within(&quarantine::take(self.dir, file)?)),
            false => format!("a repair moves it to quarantine/; {follows}"),
        };
        self.find(file, problem, cure);
        Ok(())
    }

    /// Copies the database into quarantine before rows of it change, at most once a repair; returns where the copy is.
    fn copy_database(&mut self, store: &Store) -> Result<String, StoreError> {
        let (path, made) = (database_of(self.dir), self.copy.take());
        let copy = made.map_or_else(|| quarantine::place_for(self.dir, &path), Ok)?;
        if !copy.exists() {
            schema::copy_to(&store.conn, &path, &copy)?;
        }
        let name = self.within(&copy);
        self.copy = Some(copy);
        Ok(name)
    }

    /// A path as people read it, within the store's folder.
    fn within(&self, path: &Path) -> String {
        shown(path.strip_prefix(self.dir).unwrap_or(path))
    }

    /// What is judged last: checkpoints, dumps, and files that no row names.
    fn leftovers(&mut self, conn: &Connection) -> Result<(), StoreError> {
        checkpoints::examine(self, conn)?;
        for path in orphans::files(self.dir, conn)? {
            self.put_aside(&path, "it belongs to no outcome: a crash left it", "`run` does not need it")?;
        }
        Ok(())
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
    let mut work = Examination::new(dir, false);
    let held = hold(dir, &mut work)?;
    if !database::examine(&mut work, held.is_some())? {
        work.report.notes.push("rows and sample files can be judged once the database is repaired".to_owned());
        return Ok(work.report);
    }
    let conn = read::connect(dir)?;
    if schema::version(&conn, &database_of(dir))?.is_none() {
        work.report.notes.push("nothing was ever written to it".to_owned());
        return Ok(work.report);
    }
    let snapshot = conn.unchecked_transaction().map_err(StoreError::sql(&database_of(dir)))?;
    rows::check(&mut work, &snapshot)?;
    files::check(&mut work, &snapshot)?;
    if held.is_some() {
        work.leftovers(&snapshot)?;
    }
    Ok(work.report)
}

/// Checks the store in `dir` and puts right what is wrong; `run` then computes what was lost.
///
/// # Errors
/// As [`check`]; [`StoreError::Locked`] while another process writes the store.
pub fn repair(dir: &Path) -> Result<CheckReport, StoreError> {
    is_store(dir)?;
    lock::refuse_network(dir)?;
    let mut work = Examination::new(dir, true);
    let lock = lock::take(dir)?;
    database::examine(&mut work, true)?;
    let mut store = Store::connect(dir, lock)?;
    rows::repair(&mut work, &mut store)?;
    files::repair(&mut work, &mut store)?;
    work.leftovers(&store.conn)?;
    Ok(work.report)
}

/// Refuses a folder that never was a store.
fn is_store(dir: &Path) -> Result<(), StoreError> {
    refuse_no_folder(dir)?;
    entries::refuse_foreign(dir)?;
    let was = database_of(dir).exists() || seal::path(dir).exists() || !files_in(&samples_dir(dir))?.is_empty();
    if was { Ok(()) } else { Err(StoreError::Missing(dir.to_owned())) }
}

/// Keeps writers away while a check looks; `None`, with a note, where it cannot.
fn hold(dir: &Path, work: &mut Examination<'_>) -> Result<Option<File>, StoreError> {
    let note = match lock::take(dir) {
        Ok(lock) => return Ok(Some(lock)),
        Err(StoreError::Locked { holder, .. }) => {
            format!("{holder} is at work: what it has not committed yet was left out")
        }
        Err(StoreError::Io { source, .. }) => {
            if let Some(lock) = lock::keep_writers_away(dir) {
                return Ok(Some(lock));
            }
            format!("the store cannot be locked ({source}): files that no row names were left out")
        }
        Err(error) => return Err(error),
    };
    work.report.notes.push(note);
    Ok(None)
}

/// One number from the database.
fn count(conn: &Connection, sql: &str) -> rusqlite::Result<u64> {
    conn.query_row(sql, [], |row| row.get::<_, i64>(0)).map(|count| count as u64)
}

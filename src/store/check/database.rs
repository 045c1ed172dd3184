//! Whether the database can be trusted at all, and putting one that can in its place.

use crate::store::check::{Examination, header, rescue};
use crate::store::error::StoreError;
use crate::store::folders::{database, files_in, journal, log, samples_dir};
use crate::store::schema::{self, birth};
use crate::store::seal::{self, Seal, SealState};
use crate::store::{disk, quarantine, read};
use rusqlite::Connection;
use std::path::Path;

/// A database that cannot be trusted.
struct Damage {
    problem: String,
    /// The seal and the pages that differ from it, where there is a seal to say so.
    sealed: Option<(Seal, Vec<usize>)>,
}

impl Damage {
    fn unsealed(problem: impl Into<String>) -> Self {
        Self { problem: problem.into(), sealed: None }
    }

    fn of_pages(seal: Seal, pages: Vec<usize>) -> Self {
        let numbers: Vec<_> = pages.iter().take(5).map(|page| (page + 1).to_string()).collect();
        let more = if pages.len() > 5 { ", ..." } else { "" };
        let (bad, all, numbers) = (pages.len(), seal.n_pages(), numbers.join(", "));
        let problem = format!("{bad} of its {all} pages are not as they were left: {numbers}{more}");
        Self { problem, sealed: Some((seal, pages)) }
    }

    /// Whether the seal holds all that is damaged.
    fn is_first_page_alone(&self) -> bool {
        self.sealed.as_ref().is_some_and(|(_, pages)| pages == &[0])
    }
}

/// Judges the database, and in a repair puts a sound one in its place; true if it can be read on. `alone` says that
/// nobody else writes it.
pub(super) fn examine(work: &mut Examination<'_>, alone: bool) -> Result<bool, StoreError> {
    if work.report.repaired {
        rescue::clear(work.dir)?;
    }
    if alone {
        birth::roll_back_alone(work.dir)?;
    }
    if alone && seal::find(work.dir)? == SealState::Damaged {
        work.put_aside(&seal::path(work.dir), "its checksum is wrong", "the next `run` makes another")?;
    }
    let Some(damage) = judge(work.dir, alone)? else { return Ok(true) };
    let cure = match (work.report.repaired, damage.is_first_page_alone()) {
        (true, _) => replace(work, &damage)?,
        (false, true) => "a repair writes the right page, which the seal has; nothing is lost".to_owned(),
        (false, false) => {
            "a repair copies what can be read into a new database; `run` then computes the rest".to_owned()
        }
    };
    work.find(database(work.dir), damage.problem, cure);
    Ok(work.report.repaired)
}

/// Replaces a damaged database; returns what was done, in words.
fn replace(work: &Examination<'_>, damage: &Damage) -> Result<String, StoreError> {
    let (dir, path, logs) = (work.dir, database(work.dir), [log(work.dir), journal(work.dir)]);
    if !path.exists() {
        return Ok("a new one was made; the sample files are put aside".to_owned());
    }
    let old = quarantine::copy(dir, &path)?;
    for log in logs.iter().filter(|log| log.exists()) {
        quarantine::copy(dir, log)?;
    }
    let sealed = damage.sealed.as_ref().map(|(seal, pages)| (seal, pages.as_slice()));
    let patched = rescue::patch(dir, sealed)?;
    let (new, told) = match damage.is_first_page_alone() {
        true => (patched, "its first page was written anew and nothing is lost".to_owned()),
        false => rescue::rebuild(dir, &patched)?,
    };
    // The old log must not meet the new database. Its pages are in quarantine, and in what was rescued.
    if logs.iter().any(|log| log.exists()) {
        logs.iter().try_for_each(|log| disk::remove(log))?;
        disk::remove(&dir.join("store.db-shm"))?;
        disk::sync_folder(dir)?;
    }
    seal::remove(dir)?;
    disk::rename(&new, &path)?;
    disk::sync_folder(dir)?;
    rescue::clear(dir)?;
    Ok(format!("the old one is {}; {told}", work.within(&old)))
}

/// Finds out whether, and how, the database is damaged.
///
/// # Errors
/// [`StoreError::Newer`] and [`StoreError::Foreign`] for databases that are sound, but not for this program to judge.
fn judge(dir: &Path, alone: bool) -> Result<Option<Damage>, StoreError> {
    let path = database(dir);
    if !path.exists() {
        return Ok(Some(Damage::unsealed("the database is missing")));
    }
    let file_bytes = path.metadata().map_err(StoreError::io(&path))?.len();
    let has_log = log(dir).metadata().is_ok_and(|log| log.len() > 0);
    let is_new = file_bytes == 0 && !has_log && !seal::path(dir).exists();
    if is_new && !files_in(&samples_dir(dir))?.is_empty() {
        return Ok(Some(Damage::unsealed("the database is empty, and yet there are sample files")));
    }
    // Only somebody who is alone may read the file itself: closing it drops the locks that SQLite holds in this
    // process.
    if alone {
        match seal::find(dir)? {
            SealState::Sound(seal) if !has_log => {
                let pages = seal.differences(dir)?;
                if !pages.is_empty() {
                    return Ok(Some(Damage::of_pages(seal, pages)));
                }
            }
            _ if file_bytes > 0 => {
                let header = seal::beginning(dir, header::LENGTH)?;
                if let Some(problem) = header::problem(&header, file_bytes, has_log) {
                    return Ok(Some(Damage::unsealed(problem)));
                }
            }
            _ => {}
        }
    }
    match read::connect(dir).and_then(|conn| problems(&conn, &path)) {
        Ok(problems) if problems.is_empty() => Ok(None),
        Ok(problems) => Ok(Some(Damage::unsealed(problems.join("; ")))),
        Err(StoreError::Sql { source, .. }) if rescue::is_damage(&source) => {
            Ok(Some(Damage::unsealed(format!("SQLite cannot read it: {source}"))))
        }
        Err(error) => Err(error),
    }
}

/// What SQLite finds wrong with a database, and what is not declared as its schema has it.
fn problems(conn: &Connection, path: &Path) -> Result<Vec<String>, StoreError> {
    let Some(version) = schema::version(conn, path)? else { return Ok(Vec::new()) };
    let list = || -> rusqlite::Result<Vec<String>> {
        // SQLite's own check works out what a schema holds, so a foreign one is not given to it.
        let foreign = schema::differences(conn, version)?;
        if !foreign.is_empty() {
            return Ok(foreign);
        }
        let mut statement = conn.prepare("PRAGMA integrity_check(5)")?;
        let mut problems = statement.query_map([], |row| row.get(0))?.collect::<rusqlite::Result<Vec<String>>>()?;
        problems.retain(|line| line != "ok");
        Ok(problems)
    };
    list().map_err(StoreError::sql(path))
}

//! Whether the database can be trusted at all, and making one that can.

use crate::store::check::header;
use crate::store::check::rescue::{self, Rescued};
use crate::store::check::{Examination, within};
use crate::store::seal::{self, Found, Seal};
use crate::store::{BUSY_TIMEOUT, StoreError, database, disk, migrate, quarantine, samples_dir};
use rusqlite::{Connection, OpenFlags};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// How a damaged database is damaged.
enum Damage {
    /// It is not there.
    Absent,
    /// Its first page alone; the seal has the right one.
    FirstPage(Seal),
    /// These pages.
    Pages(Seal, Vec<usize>),
    /// As these words say; no seal tells where.
    Somewhere(Vec<String>),
}

/// Opens the database for reading, whatever its schema.
pub(super) fn connect(dir: &Path) -> Result<Connection, StoreError> {
    let path = database(dir);
    let open = || -> rusqlite::Result<Connection> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let conn = Connection::open_with_flags(&path, flags)?;
        conn.busy_timeout(BUSY_TIMEOUT)?;
        conn.pragma_update(None, "query_only", true)?;
        Ok(conn)
    };
    open().map_err(StoreError::sql(&path))
}

/// Reports what is wrong with the database; true if it can be read on.
pub(super) fn check(work: &mut Examination<'_>, alone: bool) -> Result<bool, StoreError> {
    if alone && seal::find(work.dir)? == Found::Broken {
        work.find(seal::path(work.dir), "its checksum is wrong", "a repair moves it to quarantine/");
    }
    let Some(damage) = examine(work.dir, alone)? else { return Ok(true) };
    let cure = match damage {
        Damage::FirstPage(_) => "a repair writes the right page, which the seal has; nothing is lost",
        Damage::Absent => "a repair moves the sample files to quarantine/; `run` then begins anew",
        Damage::Pages(..) | Damage::Somewhere(_) => {
            "a repair copies what can be read into a new database; `run` then computes the rest"
        }
    };
    work.find(database(work.dir), words(&damage), cure);
    Ok(false)
}

/// Puts a sound database in place, whatever is there.
pub(super) fn repair(work: &mut Examination<'_>) -> Result<(), StoreError> {
    let dir = work.dir;
    rescue::clear(dir)?;
    if seal::find(dir)? == Found::Broken {
        let place = quarantine::take(dir, &seal::path(dir))?;
        work.find(seal::path(dir), "its checksum was wrong", format!("moved to {}", within(dir, &place)));
    }
    let Some(damage) = examine(dir, true)? else { return Ok(()) };
    let path = database(dir);
    if matches!(damage, Damage::Absent) {
        work.find(&path, words(&damage), "a new one was made; the sample files follow");
        return Ok(());
    }
    let place = quarantine::copy(dir, &path)?;
    let log = seal::log(dir);
    let has_log = log.exists();
    if has_log {
        quarantine::copy(dir, &log)?;
    }
    let (new, mut cure) = (dir.join("store.db.repair.tmp"), format!("the old one is {}; ", within(dir, &place)));
    match &damage {
        Damage::FirstPage(seal) => {
            let mut bytes = std::fs::read(&path).map_err(StoreError::io(&path))?;
            bytes.get_mut(..seal.page_size()).ok_or_else(|| shrunk(&path))?.copy_from_slice(&seal.first_page);
            disk::write_file(&new, &bytes)?;
            cure += "its first page was written anew and nothing is lost";
        }
        Damage::Pages(seal, pages) => cure += &told(&rescue::rescue(dir, &new, Some((seal, pages)))?),
        Damage::Somewhere(_) | Damage::Absent => cure += &told(&rescue::rescue(dir, &new, None)?),
    }
    // The old log must not meet the new database; its pages are in quarantine and in what was rescued.
    if has_log {
        disk::remove(&log)?;
        disk::remove(&dir.join("store.db-shm"))?;
        disk::sync_folder(dir)?;
    }
    seal::lift(dir)?;
    disk::rename(&new, &path)?;
    disk::sync_folder(dir)?;
    work.find(&path, words(&damage), cure);
    Ok(())
}

fn shrunk(path: &Path) -> StoreError {
    StoreError::io(path)(std::io::Error::other("the file shrank while it was read"))
}

fn told(rescued: &Rescued) -> String {
    let Rescued { jobs, ended, rows, unreadable } = rescued;
    format!(
        "{rows} rows were copied, {unreadable} places could not be read; {jobs} jobs are kept, {ended} with their end"
    )
}

fn words(damage: &Damage) -> String {
    match damage {
        Damage::Absent => "the database is missing or empty".to_owned(),
        Damage::FirstPage(_) => "its header or first page is not as it was left".to_owned(),
        Damage::Pages(seal, pages) => {
            let numbers: Vec<_> = pages.iter().take(5).map(|page| (page + 1).to_string()).collect();
            let more = if pages.len() > 5 { ", ..." } else { "" };
            format!(
                "{} of its {} pages are not as they were left: {}{more}",
                pages.len(),
                seal.n_pages(),
                numbers.join(", ")
            )
        }
        Damage::Somewhere(problems) => problems.join("; "),
    }
}

/// Finds out whether, and how, the database is damaged.
///
/// # Errors
/// [`StoreError::Newer`] and [`StoreError::Foreign`] for databases that are sound but not ours to judge.
fn examine(dir: &Path, alone: bool) -> Result<Option<Damage>, StoreError> {
    let path = database(dir);
    if !path.exists() {
        return Ok(Some(Damage::Absent));
    }
    let file_bytes = path.metadata().map_err(StoreError::io(&path))?.len();
    let has_log = seal::log(dir).metadata().is_ok_and(|log| log.len() > 0);
    let sealed = seal::path(dir).exists();
    if file_bytes == 0 && !has_log && !sealed && !crate::store::check::files::listed(&samples_dir(dir))?.is_empty() {
        return Ok(Some(Damage::Absent));
    }
    // Nothing but a look at the file until here: closing it would drop the locks that SQLite holds for this process.
    if alone {
        match seal::find(dir)? {
            Found::Whole(sealed) if !has_log => {
                let pages = sealed.differences(&path)?;
                match pages.as_slice() {
                    [] => {}
                    [0] => return Ok(Some(Damage::FirstPage(sealed))),
                    _ => return Ok(Some(Damage::Pages(sealed, pages))),
                }
            }
            _ if file_bytes > 0 => {
                let mut header = Vec::new();
                let file = File::open(&path).map_err(StoreError::io(&path))?;
                file.take(header::LENGTH as u64).read_to_end(&mut header).map_err(StoreError::io(&path))?;
                let problems = header::problems(&header, file_bytes, has_log);
                // The first transaction of all writes name and schema together.
                let foreign = problems.len() == 1 && header.get(68..72) == Some(&[0; 4]);
                if !problems.is_empty() && !foreign {
                    return Ok(Some(Damage::Somewhere(problems)));
                }
            }
            _ => {}
        }
    }
    let judged = connect(dir).and_then(|conn| judge(&conn, &path));
    match judged {
        Ok(problems) if problems.is_empty() => Ok(None),
        Ok(problems) => Ok(Some(Damage::Somewhere(problems))),
        Err(StoreError::Sql { source, .. }) if rescue::is_damage(&source) => {
            Ok(Some(Damage::Somewhere(vec![format!("SQLite cannot read it: {source}")])))
        }
        Err(error) => Err(error),
    }
}

/// What SQLite and the schema say of a database, in words.
fn judge(conn: &Connection, path: &Path) -> Result<Vec<String>, StoreError> {
    let Some(version) = migrate::version(conn, path)? else { return Ok(Vec::new()) };
    let list =
        |sql: &str| -> rusqlite::Result<Vec<String>> { conn.prepare(sql)?.query_map([], |row| row.get(0))?.collect() };
    let mut problems = list("PRAGMA integrity_check(5)").map_err(StoreError::sql(path))?;
    problems.retain(|line| line != "ok");
    let found = migrate::schema(conn).map_err(StoreError::sql(path))?;
    let expected = migrate::expected_schema(version).map_err(StoreError::sql(path))?;
    for (name, sql) in &expected {
        if found.get(name) != Some(sql) {
            problems.push(format!("`{name}` is not declared as schema {version} has it"));
        }
    }
    Ok(problems)
}

//! Sample files against the catalogue: bytes, checksum, rows, and whose rows they are.

use crate::store::check::{Examination, keep_a_copy, rows, within};
use crate::store::compact::{self, Source};
use crate::store::samples::OpenFile;
use crate::store::{Store, StoreError, database, disk, quarantine, samples_dir};
use arrow_array::StringArray;
use arrow_array::cast::AsArray;
use arrow_array::types::Int32Type;
use rusqlite::Connection;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// What is wrong with a catalogued file.
enum Wrong {
    /// It cannot be trusted: all jobs in it are computed again.
    File(String),
    /// It is sound, but holds rows of no outcome.
    Surplus(u64),
}

/// A file of the catalogue.
struct Listed {
    source: Source,
    rows: u64,
    bytes: u64,
    checksum: String,
}

/// Reports what is wrong with catalogued files.
pub(super) fn check(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    for listed in catalogue(work.dir, conn)? {
        work.report.files += 1;
        match examine(work.dir, &listed)? {
            Some(Wrong::File(problem)) => {
                let jobs = listed.source.jobs.len();
                let problem = format!("{problem} ({jobs} jobs)");
                let cure = "a repair moves it to quarantine/ and sets its jobs back to pending, `run` computes them";
                work.find(&listed.source.path, problem, cure);
            }
            Some(Wrong::Surplus(rows)) => {
                let problem = format!("{rows} of its rows belong to no outcome");
                work.find(&listed.source.path, problem, "a repair writes it anew without them");
            }
            None => {}
        }
    }
    Ok(())
}

/// Puts right what is wrong with catalogued files.
pub(super) fn repair(work: &mut Examination<'_>, store: &mut Store) -> Result<(), StoreError> {
    let mut kept = None;
    for listed in catalogue(work.dir, &store.conn)? {
        work.report.files += 1;
        let path = work.dir.join(&listed.source.path);
        match examine(work.dir, &listed)? {
            Some(Wrong::File(problem)) => {
                keep_a_copy(store, &mut kept)?;
                // The file first: what is then missing is found again, and nothing takes it for an orphan.
                let place = if path.exists() { Some(quarantine::take(work.dir, &path)?) } else { None };
                let (again, stale) = give_up(store, &listed.source)?;
                let moved = place.map_or("it is gone".to_owned(), |p| format!("moved to {}", within(work.dir, &p)));
                let old = match stale {
                    0 => String::new(),
                    _ => format!("; {stale} of another physics version keep their outcome without samples"),
                };
                work.find(&listed.source.path, problem, format!("{moved}; {again} jobs are pending again{old}"));
            }
            Some(Wrong::Surplus(rows)) => {
                let place = quarantine::copy(work.dir, &path)?;
                compact::merge(store, std::slice::from_ref(&listed.source))?;
                disk::remove(&path)?;
                let problem = format!("{rows} of its rows belonged to no outcome");
                work.find(
                    &listed.source.path,
                    problem,
                    format!("written anew without them; the old one is {}", within(work.dir, &place)),
                );
            }
            None => {}
        }
    }
    Ok(())
}

/// The files in a folder, by name; none if there is no folder.
pub(in crate::store) fn listed(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(StoreError::io(folder))?,
    };
    let paths: std::io::Result<Vec<_>> = entries.map(|entry| Ok(entry?.path())).collect();
    let mut paths = paths.map_err(StoreError::io(folder))?;
    paths.retain(|path| path.is_file());
    paths.sort();
    Ok(paths)
}

/// Files that no row names: sample files that were never committed, and what a crash cut short.
pub(in crate::store) fn strangers(dir: &Path, conn: &Connection) -> Result<Vec<PathBuf>, StoreError> {
    let known = crate::store::catalogued(conn).map_err(StoreError::sql(&database(dir)))?;
    let mut found = listed(&samples_dir(dir))?;
    found.retain(|path| crate::store::is_ours(path) && path.file_name().is_none_or(|name| !known.contains(name)));
    // Beside the database: half a backup, half a seal, half a repair.
    found.extend(listed(dir)?.into_iter().filter(|path| path.extension().is_some_and(|extension| extension == "tmp")));
    Ok(found)
}

fn catalogue(dir: &Path, conn: &Connection) -> Result<Vec<Listed>, StoreError> {
    let read = || -> rusqlite::Result<Vec<Listed>> {
        let mut statement = conn.prepare("SELECT key, path, rows, bytes, checksum FROM sample_files ORDER BY key")?;
        let files = statement.query_map([], |row| {
            Ok((row.get(0)?, row.get(1)?, row.get::<_, i64>(2)?, row.get::<_, i64>(3)?, row.get(4)?))
        })?;
        files
            .map(|file| {
                let (key, path, rows, bytes, checksum) = file?;
                let source = Source::read(conn, key, path)?;
                Ok(Listed { source, rows: rows as u64, bytes: bytes as u64, checksum })
            })
            .collect()
    };
    read().map_err(StoreError::sql(&database(dir)))
}

/// Compares a file with what the catalogue says of it.
fn examine(dir: &Path, listed: &Listed) -> Result<Option<Wrong>, StoreError> {
    let Listed { source, rows, bytes, checksum } = listed;
    let wrong = |problem: &str| Ok(Some(Wrong::File(problem.to_owned())));
    let path = dir.join(&source.path);
    let found = match path.metadata() {
        Ok(metadata) => metadata.len(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return wrong("it is missing"),
        Err(error) => return Err(StoreError::io(&path)(error)),
    };
    if found != *bytes {
        return Ok(Some(Wrong::File(format!("it has {found} bytes, the catalogue says {bytes}"))));
    }
    let mut hasher = blake3::Hasher::new();
    let file = std::fs::File::open(&path).map_err(StoreError::io(&path))?;
    if let Err(error) = hasher.update_reader(file) {
        return Ok(Some(Wrong::File(format!("it cannot be read: {error}"))));
    }
    if hasher.finalize().to_hex().as_str() != checksum {
        return wrong("its bytes do not have the checksum in the catalogue");
    }
    // What is read from here on is what was written.
    let open = match OpenFile::open(path) {
        Ok(open) => open,
        Err(error) => return Ok(Some(Wrong::File(format!("it is no sample file: {error}")))),
    };
    if open.rows() as u64 != *rows {
        return Ok(Some(Wrong::File(format!("it has {} rows, the catalogue says {rows}", open.rows()))));
    }
    let mut next = 0;
    for job in &source.jobs {
        if job.rows.start < next || job.rows.end > open.rows() {
            return wrong("the catalogue gives rows of it twice, or rows that it does not have");
        }
        next = job.rows.end;
    }
    let owners = match owners(&open) {
        Ok(owners) => owners,
        Err(error) => return Ok(Some(Wrong::File(format!("it cannot be read: {error}")))),
    };
    if !source.jobs.iter().all(|job| owned(&owners, &job.job_id, &job.rows)) {
        return wrong("its rows are not of the jobs that the catalogue says");
    }
    let indexed: usize = source.jobs.iter().map(|job| job.rows.len()).sum();
    Ok((indexed < open.rows()).then(|| Wrong::Surplus((open.rows() - indexed) as u64)))
}

/// Whose rows a file holds: runs of one job, in order.
fn owners(file: &OpenFile) -> Result<Vec<(String, Range<usize>)>, StoreError> {
    let mut owners: Vec<(String, Range<usize>)> = Vec::new();
    let mut row = 0;
    for batch in file.read(0..file.rows(), 1)? {
        let batch = batch.map_err(|error| StoreError::parquet(file.path())(error.into()))?;
        let column = batch.column(0).as_dictionary_opt::<Int32Type>();
        let Some(texts) = column.and_then(|column| column.downcast_dict::<StringArray>()) else {
            return Err(StoreError::parquet(file.path())(parquet::errors::ParquetError::General(
                "its column job_id is no text".to_owned(),
            )));
        };
        for &key in texts.keys().values() {
            let name = texts.values().value(key as usize);
            match owners.last_mut() {
                Some((last, rows)) if last == name => rows.end += 1,
                _ => owners.push((name.to_owned(), row..row + 1)),
            }
            row += 1;
        }
    }
    Ok(owners)
}

fn owned(owners: &[(String, Range<usize>)], job_id: &str, rows: &Range<usize>) -> bool {
    let index = owners.partition_point(|(_, run)| run.end <= rows.start);
    rows.is_empty() || owners.get(index).is_some_and(|(id, run)| id == job_id && run == rows)
}

/// Takes a file out of the catalogue: its jobs are computed again. Returns how many, and how many cannot be.
fn give_up(store: &mut Store, source: &Source) -> Result<(usize, usize), StoreError> {
    let path = database(&store.dir);
    let (mut again, mut stale) = (0, 0);
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let mut change = || -> rusqlite::Result<()> {
        for job in &source.jobs {
            if job.is_current {
                rows::forget(&transaction, job.key)?;
                again += 1;
            } else {
                transaction.prepare_cached("DELETE FROM sample_index WHERE job = ?1")?.execute([job.key])?;
                stale += 1;
            }
        }
        transaction.execute("DELETE FROM sample_files WHERE key = ?1", [source.key])?;
        Ok(())
    };
    change().map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)?;
    Ok((again, stale))
}

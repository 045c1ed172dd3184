//! Sample files against the catalogue: bytes, checksum, rows, and whose rows they are.

use crate::store::check::{Examination, rows};
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::sample_file::OpenFile;
use crate::store::write::catalogue::{self, CataloguedFile};
use crate::store::write::{Store, compact, orphans};
use crate::store::{aside, disk, quarantine};
use arrow_array::StringArray;
use arrow_array::cast::AsArray;
use arrow_array::types::Int32Type;
use rusqlite::Connection;
use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;

/// What a catalogued file is worth.
enum Verdict {
    /// It is what was written.
    Sound,
    /// It cannot be trusted: all jobs in it are computed again.
    Broken(String),
    /// It is sound, but holds so many rows of no outcome.
    Surplus(u64),
}

/// Reports what is wrong with catalogued files.
pub(super) fn check(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    for listed in catalogue::list(conn).map_err(StoreError::sql(&database(work.dir)))? {
        work.report.files += 1;
        let (problem, cure) = match judge(work.dir, conn, &listed)? {
            Verdict::Sound => continue,
            Verdict::Broken(problem) => (
                problem,
                "a repair moves it to quarantine/ and sets its jobs back to pending; `run` computes them again",
            ),
            Verdict::Surplus(rows) => (surplus(rows), "a repair writes it anew without them"),
        };
        work.find(&listed.file.path, problem, cure);
    }
    Ok(())
}

/// Puts right what is wrong with catalogued files.
pub(super) fn repair(work: &mut Examination<'_>, store: &mut Store) -> Result<(), StoreError> {
    for listed in catalogue::list(&store.conn).map_err(StoreError::sql(&database(work.dir)))? {
        work.report.files += 1;
        let path = aside::find(work.dir, &listed.file.path);
        let (problem, cure) = match judge(work.dir, &store.conn, &listed)? {
            Verdict::Sound => continue,
            Verdict::Broken(problem) => {
                work.copy_database(store)?;
                // The file goes first: if the repair is killed here, the next one finds it missing.
                let moved = match path.exists() {
                    true => format!("moved to {}", work.within(&quarantine::take(work.dir, &path)?)),
                    false => "it is gone".to_owned(),
                };
                (problem, format!("{moved}; {}", give_up(store, &listed)?))
            }
            Verdict::Surplus(rows) => {
                let place = quarantine::copy(work.dir, &path)?;
                compact::merge(store, std::iter::once(&listed))?;
                disk::remove(&path)?;
                orphans::settle_samples(store)?;
                (surplus(rows), format!("written anew without them; the old one is {}", work.within(&place)))
            }
        };
        work.find(&listed.file.path, problem, cure);
    }
    Ok(())
}

fn surplus(rows: u64) -> String {
    format!("{rows} of its rows belong to no outcome")
}

/// Compares a file with what the catalogue says of it.
fn judge(dir: &Path, conn: &Connection, listed: &CataloguedFile) -> Result<Verdict, StoreError> {
    let path = &listed.file.path;
    let jobs = listed.jobs(conn).map_err(StoreError::sql(&database(dir)))?;
    let broken = |problem: String| Ok(Verdict::Broken(format!("{problem} ({} jobs)", jobs.len())));
    let mut hasher = blake3::Hasher::new();
    match std::fs::File::open(aside::find(dir, path)).and_then(|file| hasher.update_reader(file).map(|_| ())) {
        Err(error) if error.kind() == ErrorKind::NotFound => return broken("it is missing".to_owned()),
        Err(error) => return broken(format!("it cannot be read: {error}")),
        Ok(()) if hasher.finalize().to_hex().as_str() != listed.file.checksum => {
            return broken("its bytes do not match the checksum in the catalogue".to_owned());
        }
        Ok(()) if hasher.count() != listed.file.bytes => {
            return broken("its size is not that in the catalogue".to_owned());
        }
        Ok(()) => {}
    }
    // What is read from here on is what was written.
    let owners = match OpenFile::open(dir, path).and_then(|file| owners(&file)) {
        Ok(owners) => owners,
        Err(error) => return broken(format!("it cannot be read: {error}")),
    };
    let rows = owners.last().map_or(0, |(_, rows)| rows.end as u64);
    if rows != listed.file.rows {
        return broken(format!("it has {rows} rows, the catalogue says {}", listed.file.rows));
    }
    let is_owned = |rows: &Range<usize>, id: &str| {
        let run = owners.partition_point(|(_, run)| run.end <= rows.start);
        rows.is_empty() || owners.get(run).is_some_and(|(owner, run)| owner == id && run == rows)
    };
    if !jobs.iter().all(|job| is_owned(&job.rows, &job.job_id)) {
        return broken("its rows are not those of the jobs that the catalogue says".to_owned());
    }
    let listed_rows: u64 = jobs.iter().map(|job| job.rows.len() as u64).sum();
    Ok(if listed_rows < rows { Verdict::Surplus(rows - listed_rows) } else { Verdict::Sound })
}

/// Whose rows a file holds: for each job, in order, its rows.
fn owners(file: &OpenFile) -> Result<Vec<(String, Range<usize>)>, StoreError> {
    let damaged = |error| StoreError::parquet(&file.path())(error);
    let mut owners: Vec<(String, Range<usize>)> = Vec::new();
    let mut row = 0;
    for batch in file.read(0..file.rows(), 1)? {
        let batch = batch.map_err(|error| damaged(error.into()))?;
        let column = batch.column(0).as_dictionary_opt::<Int32Type>();
        let Some(texts) = column.and_then(|column| column.downcast_dict::<StringArray>()) else {
            return Err(damaged(parquet::errors::ParquetError::General("its column job_id is not text".to_owned())));
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

/// Takes a file out of the catalogue, so that its jobs are computed again; returns what became of them, in words.
fn give_up(store: &mut Store, listed: &CataloguedFile) -> Result<String, StoreError> {
    let path = database(&store.dir);
    let jobs = listed.jobs(&store.conn).map_err(StoreError::sql(&path))?;
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let change = || -> rusqlite::Result<()> {
        for job in &jobs {
            match job.is_current {
                true => rows::compute_again(&transaction, job.key)?,
                false => drop(transaction.execute("DELETE FROM sample_index WHERE job = ?1", [job.key])?),
            }
        }
        transaction.execute("DELETE FROM sample_files WHERE key = ?1", [listed.key]).map(drop)
    };
    change().map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)?;
    let again = jobs.iter().filter(|job| job.is_current).count();
    Ok(match jobs.len() - again {
        0 => format!("{again} jobs are pending again"),
        stale => format!(
            "{again} jobs are pending again, {stale} of another physics version keep their outcome without samples"
        ),
    })
}

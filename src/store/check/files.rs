//! Sample files against the catalogue: bytes, checksum, rows, and whose rows they are.

use crate::store::check::{Examination, rows};
use crate::store::entries::{self, ForeignName};
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::sample_file::{OpenFile, texts};
use crate::store::write::catalogue::{self, CataloguedFile, JobSpan};
use crate::store::write::{Store, compact, orphans};
use crate::store::{aside, disk, quarantine};
use rusqlite::Connection;
use std::io::ErrorKind;
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
    let (files, foreign) = catalogue::sorted_out(conn).map_err(StoreError::sql(&database(work.dir)))?;
    for (_, name) in foreign {
        work.find(
            database(work.dir),
            ForeignName(name).to_string(),
            "a repair takes it out and touches no file of that name",
        );
    }
    for listed in files {
        work.report.files += 1;
        let (problem, cure) = match judge(work.dir, conn, &listed)? {
            Verdict::Sound => continue,
            Verdict::Broken(problem) => (
                problem,
                "a repair moves it to quarantine/ and sets its jobs back to pending; `run` computes them again",
            ),
            Verdict::Surplus(rows) => (surplus(rows), "a repair writes it anew without them"),
        };
        work.find(listed.file.name.as_str(), problem, cure);
    }
    Ok(())
}

/// Puts right what is wrong with catalogued files.
pub(super) fn repair(work: &mut Examination<'_>, store: &mut Store) -> Result<(), StoreError> {
    let (files, foreign) = catalogue::sorted_out(&store.conn).map_err(StoreError::sql(&database(work.dir)))?;
    for (key, name) in foreign {
        work.copy_database(store)?;
        let cure = format!("taken out, and no file of that name was touched; {}", give_up(store, key)?);
        work.find(database(work.dir), ForeignName(name).to_string(), cure);
    }
    for listed in files {
        work.report.files += 1;
        let path = aside::find(work.dir, &listed.file.name);
        let (problem, cure) = match judge(work.dir, &store.conn, &listed)? {
            Verdict::Sound => continue,
            Verdict::Broken(problem) => {
                work.copy_database(store)?;
                // The file goes first: if the repair is killed here, the next one finds it missing.
                let moved = match path.symlink_metadata().is_ok() {
                    true => format!("moved to {}", work.within(&quarantine::take(work.dir, &path)?)),
                    false => "it is gone".to_owned(),
                };
                (problem, format!("{moved}; {}", give_up(store, listed.key)?))
            }
            Verdict::Surplus(rows) => {
                let place = quarantine::copy(work.dir, &path)?;
                compact::merge(store, std::iter::once(&listed))?;
                disk::remove(&path)?;
                orphans::settle_samples(store)?;
                (surplus(rows), format!("written anew without them; the old one is {}", work.within(&place)))
            }
        };
        work.find(listed.file.name.as_str(), problem, cure);
    }
    Ok(())
}

fn surplus(rows: u64) -> String {
    format!("{rows} of its rows belong to no outcome")
}

/// Compares a file with what the catalogue says of it.
fn judge(dir: &Path, conn: &Connection, listed: &CataloguedFile) -> Result<Verdict, StoreError> {
    let name = &listed.file.name;
    let jobs = listed.jobs(conn).map_err(StoreError::sql(&database(dir)))?;
    let broken = |problem: String| Ok(Verdict::Broken(format!("{problem} ({} jobs)", jobs.len())));
    let mut hasher = blake3::Hasher::new();
    match entries::open(&aside::find(dir, name)).and_then(|file| hasher.update_reader(file).map(|_| ())) {
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
    let owned = match OpenFile::open(dir, name).and_then(|file| whose(&file, &jobs)) {
        Ok(owned) => owned,
        Err(error) => return broken(format!("it cannot be read: {error}")),
    };
    if owned.rows != listed.file.rows {
        return broken(format!("it has {} rows, the catalogue says {}", owned.rows, listed.file.rows));
    }
    if !owned.as_listed {
        return broken("its rows are not those of the jobs that the catalogue says".to_owned());
    }
    let listed_rows: u64 = jobs.iter().map(|job| job.rows.len() as u64).sum();
    Ok(if listed_rows < owned.rows { Verdict::Surplus(owned.rows - listed_rows) } else { Verdict::Sound })
}

/// Whose rows a file holds.
struct Owned {
    /// All rows.
    rows: u64,
    /// Whether each job has the rows that the catalogue says, and no other job has any of them.
    as_listed: bool,
}

/// Compares the ids in a file, row by row, with what the catalogue says, whose jobs are in the order of their rows. It
/// keeps one batch at a time, whatever the file holds.
fn whose(file: &OpenFile, jobs: &[JobSpan]) -> Result<Owned, StoreError> {
    let with_rows: Vec<&JobSpan> = jobs.iter().filter(|job| !job.rows.is_empty()).collect();
    let mut as_listed = with_rows.windows(2).all(|pair| pair[0].rows.end <= pair[1].rows.start);
    let (mut row, mut next) = (0, 0);
    for batch in file.read(0..file.rows(), 1)? {
        let batch = batch?;
        let Some(ids) = texts(batch.column(0)) else { continue };
        for &key in ids.keys().values() {
            let id = ids.values().value(key as usize);
            // Rows of no listed job may be there, but not such that name a job beside its rows.
            while with_rows.get(next).is_some_and(|job| job.rows.end <= row) {
                next += 1;
            }
            as_listed &= with_rows.get(next).is_none_or(|job| !job.rows.contains(&row) || job.job_id == id);
            let beside = |job: Option<&&JobSpan>| job.is_some_and(|job| job.job_id == id && !job.rows.contains(&row));
            as_listed &=
                !beside(with_rows.get(next)) && !beside(next.checked_sub(1).and_then(|last| with_rows.get(last)));
            row += 1;
        }
    }
    let fits = jobs.iter().all(|job| job.rows.end <= row || job.rows.is_empty());
    Ok(Owned { rows: row as u64, as_listed: as_listed && fits })
}

/// Takes a file out of the catalogue, so that its jobs are computed again; returns what became of them, in words.
fn give_up(store: &mut Store, file: i64) -> Result<String, StoreError> {
    let path = database(&store.dir);
    let jobs = catalogue::jobs_of(&store.conn, file).map_err(StoreError::sql(&path))?;
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let change = || -> rusqlite::Result<()> {
        for job in &jobs {
            match job.is_current {
                true => rows::compute_again(&transaction, job.key)?,
                false => drop(transaction.execute("DELETE FROM sample_index WHERE job = ?1", [job.key])?),
            }
        }
        transaction.execute("DELETE FROM sample_files WHERE key = ?1", [file]).map(drop)
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

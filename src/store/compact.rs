//! Compaction: many small sample files become one, so that a store of short jobs does not end as a folder of ten thousand.
//!
//! Files are sorted by size into tiers, each sixteen times the one below; a full tier is merged. So a row is written anew
//! once for each tier that it passes, three times from a few kilobytes to the size at which files are left alone.
//!
//! The new file is safely on disk before one transaction swaps the rows of the catalogue; only then do the old files go,
//! and not while a reader may still see them: readers hold the file `readers` locked, shared, for as long as their look at
//! the catalogue lasts. What cannot go now is no longer catalogued, and is collected later as an orphan.

use crate::store::samples::{self, OpenFile, SCHEMA_VERSION, SampleFile};
use crate::store::{Store, StoreError, database, disk};
use rusqlite::{Connection, params};
use std::ops::Range;

/// Files of a tier that are merged.
pub(super) const TIER: usize = 16;

/// Files of this size and above are left alone, in bytes.
const LARGE: u64 = 4 << 20;

/// A catalogued file and the series in it.
#[derive(Debug)]
pub(super) struct Source {
    pub key: i64,
    /// Within the store's folder.
    pub path: String,
    /// In the order of their rows.
    pub jobs: Vec<Series>,
}

/// The rows of a job in a file.
#[derive(Debug)]
pub(super) struct Series {
    pub key: i64,
    pub job_id: String,
    /// Whether this program can compute it again.
    pub is_current: bool,
    pub rows: Range<usize>,
}

impl Source {
    /// Reads what the catalogue says of the file `key`.
    pub(super) fn read(conn: &Connection, key: i64, path: String) -> rusqlite::Result<Self> {
        let mut statement = conn.prepare_cached(
            "SELECT jobs.key, jobs.job_id, first_row, row_count,
                    physics_version = (SELECT physics_version FROM current)
             FROM sample_index JOIN jobs ON jobs.key = sample_index.job WHERE file = ?1 ORDER BY first_row, row_count",
        )?;
        let jobs = statement.query_map([key], |row| {
            let (first, count) = (row.get::<_, u32>(2)? as usize, row.get::<_, u32>(3)? as usize);
            Ok(Series {
                key: row.get(0)?,
                job_id: row.get(1)?,
                is_current: row.get::<_, Option<bool>>(4)?.unwrap_or(true),
                rows: first..first + count,
            })
        });
        let jobs = jobs?.collect::<rusqlite::Result<_>>()?;
        Ok(Self { key, path, jobs })
    }

    /// The rows of all series, neighbours joined.
    fn stretches(&self) -> Vec<Range<usize>> {
        let mut stretches: Vec<Range<usize>> = Vec::new();
        for Series { rows, .. } in &self.jobs {
            match stretches.last_mut() {
                Some(last) if last.end == rows.start => last.end = rows.end,
                _ => stretches.push(rows.clone()),
            }
        }
        stretches
    }
}

/// The tier of a file of so many bytes; `None` if it is large enough.
fn tier(bytes: u64) -> Option<u32> {
    (bytes < LARGE).then(|| bytes.max(1).ilog2() / 4)
}

/// Which files to merge now, as places in the list of their sizes: the lowest tier that has `full` files.
pub(super) fn due(bytes: &[u64], full: usize) -> Option<Vec<usize>> {
    (0..=LARGE.ilog2() / 4).find_map(|wanted| {
        let members: Vec<_> = (0..bytes.len()).filter(|&file| tier(bytes[file]) == Some(wanted)).collect();
        (members.len() >= full.max(2)).then_some(members)
    })
}

/// Merges a full tier of small files, if there is one.
pub(super) fn compact(store: &mut Store, full: usize) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let list = |conn: &Connection| -> rusqlite::Result<Vec<(i64, String, u64)>> {
        let mut statement = conn.prepare_cached("SELECT key, path, bytes FROM sample_files ORDER BY key")?;
        statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get::<_, i64>(2)? as u64)))?.collect()
    };
    let files = list(&store.conn).map_err(StoreError::sql(&path))?;
    let sizes: Vec<_> = files.iter().map(|file| file.2).collect();
    let Some(members) = due(&sizes, full) else { return Ok(()) };
    let sources: rusqlite::Result<Vec<_>> =
        members.iter().map(|&file| Source::read(&store.conn, files[file].0, files[file].1.clone())).collect();
    let sources = sources.map_err(StoreError::sql(&path))?;
    merge(store, &sources)?;
    store.remove_orphans()
}

/// Writes the catalogued rows of some files as one new file and swaps the catalogue to it; the old files stay.
pub(super) fn merge(store: &mut Store, sources: &[Source]) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let total: usize = sources.iter().flat_map(|source| &source.jobs).map(|job| job.rows.len()).sum();
    let file = if total > 0 { Some(write(store, sources)?) } else { None };
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    swap(&transaction, sources, file.as_ref()).map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)
}

fn write(store: &Store, sources: &[Source]) -> Result<SampleFile, StoreError> {
    let mut failed = None;
    let written = samples::write_with(&store.dir, |writer| {
        for source in sources {
            let open = OpenFile::open(store.dir.join(&source.path)).map_err(|error| keep(&mut failed, error))?;
            for rows in source.stretches() {
                for batch in open.read(rows, u64::MAX).map_err(|error| keep(&mut failed, error))? {
                    writer.write(&batch?)?;
                }
            }
        }
        Ok(())
    });
    written.map_err(|error| failed.unwrap_or(error))
}

/// Keeps the real error while another takes its way through the Parquet library.
fn keep(place: &mut Option<StoreError>, error: StoreError) -> parquet::errors::ParquetError {
    let text = error.to_string();
    *place = Some(error);
    parquet::errors::ParquetError::General(text)
}

fn swap(conn: &Connection, sources: &[Source], file: Option<&SampleFile>) -> rusqlite::Result<()> {
    if let Some(file) = file {
        conn.execute(
            "INSERT INTO sample_files (path, rows, bytes, checksum, schema_version) VALUES (?1, ?2, ?3, ?4, ?5)",
            params![file.path, file.rows as i64, file.bytes as i64, file.checksum, SCHEMA_VERSION],
        )?;
        let key = conn.last_insert_rowid();
        let mut update = conn.prepare_cached("UPDATE sample_index SET file = ?2, first_row = ?3 WHERE job = ?1")?;
        let mut first_row = 0;
        for Series { key: job, rows, .. } in sources.iter().flat_map(|source| &source.jobs) {
            update.execute((job, key, first_row as i64))?;
            first_row += rows.len();
        }
    }
    let mut delete = conn.prepare_cached("DELETE FROM sample_files WHERE key = ?1")?;
    sources.iter().try_for_each(|source| delete.execute([source.key]).map(drop))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_tier_is_merged_the_smallest_first_and_large_files_are_left_alone() {
        assert_eq!(due(&[10_000; 15], 16), None);
        assert_eq!(due(&[10_000; 16], 16), Some((0..16).collect()));
        assert_eq!(due(&[LARGE; 100], 16), None);
        let mixed = [200_000, 10_000, 210_000, 11_000, LARGE];
        assert_eq!(due(&mixed, 2), Some(vec![1, 3]));
        assert_eq!(due(&mixed[..3], 2), Some(vec![0, 2]));
    }

    #[test]
    #[expect(clippy::same_item_push, reason = "files are merged between pushes")]
    fn a_row_passes_few_tiers_on_its_way() {
        let mut files = Vec::new();
        let (mut written, mut in_all) = (0, 0);
        for _ in 0..20_000 {
            files.push(10_000);
            in_all += 10_000;
            while let Some(members) = due(&files, TIER) {
                let merged: u64 = members.iter().map(|&file| files[file]).sum();
                let mut place = 0..;
                files.retain(|_| !members.contains(&place.next().unwrap()));
                files.push(merged);
                written += merged;
            }
        }
        assert!(files.len() < 4 * TIER, "{} files are left", files.len());
        assert!(written < 4 * in_all, "{written} bytes were written anew for {in_all}");
    }
}

//! Compaction: many small sample files become one, so that a store of short jobs is not a folder of ten thousand files.
//!
//! Files are sorted by size into tiers, each sixteen times the one below, and a full tier is merged. So a row is
//! written anew once for each tier that it passes: three times from a few kilobytes to the size at which files are
//! left alone.
//!
//! The new file is safely on disk, in `aside/`, before one transaction swaps the rows of the catalogue. Only then do
//! the old files leave `samples/`, and the new one enters it: a listing of that folder never shows a row twice. For the
//! time of these renames, mostly below a millisecond, it lacks some. Old files are removed once no reader may still
//! need them ([`lock`](crate::store::lock)).

use crate::store::disk;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::sample_file::{self, OpenFile, SampleFile};
use crate::store::write::catalogue::{self, CataloguedFile, JobSpan};
use crate::store::write::{Store, orphans};
use rusqlite::Connection;
use std::ops::Range;

/// So many files make a tier full.
pub(super) const TIER: usize = 16;

/// Files of this size and above are left alone, in bytes.
const LARGE: u64 = 4 << 20;

/// The tier of a file of so many bytes; `None` if it is large enough.
fn tier(bytes: u64) -> Option<u32> {
    (bytes < LARGE).then(|| bytes.max(1).ilog2() / 4)
}

/// Which files to merge now, as indices into the list of their sizes: those of the lowest tier that has `full` files.
fn due(bytes: &[u64], full: usize) -> Option<Vec<usize>> {
    (0..=LARGE.ilog2() / 4).find_map(|wanted| {
        let members: Vec<_> = (0..bytes.len()).filter(|&file| tier(bytes[file]) == Some(wanted)).collect();
        (members.len() >= full.max(2)).then_some(members)
    })
}

/// Merges a full tier of small files, if there is one.
pub(super) fn compact(store: &mut Store, full: usize) -> Result<(), StoreError> {
    let files = catalogue::list(&store.conn).map_err(StoreError::sql(&database(&store.dir)))?;
    let sizes: Vec<_> = files.iter().map(|listed| listed.file.bytes).collect();
    let Some(members) = due(&sizes, full) else { return Ok(()) };
    merge(store, files.iter().enumerate().filter(|(index, _)| members.contains(index)).map(|(_, file)| file))?;
    orphans::settle_samples(store)?;
    orphans::remove_samples(store)
}

/// A file that is merged into another, and whose rows it holds.
struct OldFile<'a> {
    key: i64,
    file: &'a SampleFile,
    jobs: Vec<JobSpan>,
}

/// Writes the catalogued rows of some files as one new file, aside, and swaps the catalogue to it; the old files stay.
pub(in crate::store) fn merge<'a>(
    store: &mut Store,
    files: impl Iterator<Item = &'a CataloguedFile>,
) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let merged = Rewritten::of(store, files, |_| true)?;
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    merged.swap(&transaction).map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)
}

/// Files whose rows were written anew as one file, which is safely on disk, but aside.
pub(in crate::store) struct Rewritten<'a> {
    old: Vec<OldFile<'a>>,
    /// None if there are no rows.
    new: Option<SampleFile>,
}

impl<'a> Rewritten<'a> {
    /// Writes the rows of some files anew, of those jobs that are kept.
    pub(in crate::store) fn of(
        store: &Store,
        files: impl Iterator<Item = &'a CataloguedFile>,
        is_kept: impl Fn(i64) -> bool,
    ) -> Result<Self, StoreError> {
        let read = |listed: &'a CataloguedFile| -> rusqlite::Result<_> {
            let mut jobs = listed.jobs(&store.conn)?;
            jobs.retain(|job| is_kept(job.key));
            Ok(OldFile { key: listed.key, file: &listed.file, jobs })
        };
        let old =
            files.map(read).collect::<rusqlite::Result<Vec<_>>>().map_err(StoreError::sql(&database(&store.dir)))?;
        let is_empty = old.iter().flat_map(|file| &file.jobs).all(|job| job.rows.is_empty());
        // Else the new file would vouch for damaged numbers.
        for OldFile { file, .. } in old.iter().filter(|old| !old.jobs.is_empty()) {
            sample_file::verify(&store.dir, &file.name, &file.checksum)?;
        }
        let new = if is_empty { None } else { Some(write(store, &old)?) };
        Ok(Self { old, new })
    }

    /// Puts the new file into the catalogue in place of the old ones, which no job that is not kept may name any more.
    pub(in crate::store) fn swap(&self, conn: &Connection) -> rusqlite::Result<()> {
        if let Some(new) = &self.new {
            let key = catalogue::add(conn, new)?;
            let mut update = conn.prepare_cached("UPDATE sample_index SET file = ?2, first_row = ?3 WHERE job = ?1")?;
            let mut first_row = 0;
            for JobSpan { key: job, rows, .. } in self.old.iter().flat_map(|file| &file.jobs) {
                update.execute((job, key, first_row as i64))?;
                first_row += rows.len();
            }
        }
        let mut delete = conn.prepare_cached("DELETE FROM sample_files WHERE key = ?1")?;
        self.old.iter().try_for_each(|file| delete.execute([file.key]).map(drop))
    }
}

fn write(store: &Store, old: &[OldFile<'_>]) -> Result<SampleFile, StoreError> {
    let mut failed = None;
    let written = sample_file::write_aside(&store.dir, |writer| {
        for OldFile { file, jobs, .. } in old {
            let open = OpenFile::open(&store.dir, &file.name).map_err(|error| keep(&mut failed, error))?;
            for rows in stretches(jobs) {
                for batch in open.read(rows, u64::MAX).map_err(|error| keep(&mut failed, error))? {
                    writer.write(&batch.map_err(|error| keep(&mut failed, error))?)?;
                }
            }
        }
        Ok(())
    });
    written.map_err(|error| failed.unwrap_or(error))
}

/// The rows of some jobs of a file, with neighbours joined.
fn stretches(jobs: &[JobSpan]) -> Vec<Range<usize>> {
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for JobSpan { rows, .. } in jobs {
        match stretches.last_mut() {
            Some(last) if last.end == rows.start => last.end = rows.end,
            _ => stretches.push(rows.clone()),
        }
    }
    stretches
}

/// Keeps the real error aside while its text passes through the Parquet library.
fn keep(place: &mut Option<StoreError>, error: StoreError) -> parquet::errors::ParquetError {
    let text = error.to_string();
    *place = Some(error);
    parquet::errors::ParquetError::General(text)
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

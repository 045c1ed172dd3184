//! Small files become few, and nobody who reads notices.

use super::make::*;
use meniscus::store::{Format, Store, Writer, WriterOptions, check, query};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

const ROWS: usize = 60;

/// Commits the runs `seeds` one by one, merging every four files.
fn commit_one_by_one(dir: &Path, seeds: std::ops::Range<u64>) {
    let mut store = Store::open(dir).unwrap();
    register(&mut store, &[ring(1.0)], seeds.end);
    let writer = Writer::spawn(store, WriterOptions { merge: 4, ..options(1) }).unwrap();
    seeds.for_each(|seed| writer.sender().send(finished(&ring(1.0), seed, ROWS)).unwrap());
    drop(writer.finish().unwrap());
}

fn files(dir: &Path) -> usize {
    std::fs::read_dir(dir.join("samples")).unwrap().count()
}

#[test]
fn many_small_files_become_few_and_the_rows_stay_bit_for_bit() {
    let (merged, apart) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    commit_one_by_one(merged.path(), 0..40);
    drop(filled(apart.path(), &[ring(1.0)], 40, ROWS, 1000));
    assert!(files(merged.path()) <= 12, "{} files of 40 are left", files(merged.path()));
    for sql in [
        "SELECT * FROM samples ORDER BY job_id, t",
        "SELECT seed, count(*), max(samples.r) FROM runs JOIN samples USING (job_id) GROUP BY 1",
    ] {
        assert!(csv(merged.path(), sql) == csv(apart.path(), sql), "{sql}");
    }
    assert_eq!(check(merged.path()).unwrap().findings, []);
}

/// A reader that lets something happen when the first rows reach it.
struct Interrupted<F: FnMut()> {
    seen: Vec<u8>,
    meanwhile: Option<F>,
}

impl<F: FnMut()> Write for Interrupted<F> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // Not at the line of names, which comes before the query has looked at anything.
        if self.seen.len() + bytes.len() > 1000
            && let Some(mut meanwhile) = self.meanwhile.take()
        {
            meanwhile();
        }
        self.seen.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_query_that_is_open_while_its_files_are_merged_gets_all_its_rows() {
    let dir = tempfile::tempdir().unwrap();
    // Three files, so that the next commit makes a tier full.
    commit_one_by_one(dir.path(), 0..3);
    let sql = "SELECT * FROM samples";
    let expected = answer(dir.path(), sql, Format::Csv);
    let before = csv(dir.path(), "SELECT path FROM sample_files");
    let meanwhile = || commit_one_by_one(dir.path(), 3..6);
    let mut reader = Interrupted { seen: Vec::new(), meanwhile: Some(meanwhile) };
    query(dir.path(), sql, Format::Csv, &mut reader).unwrap();
    assert!(reader.meanwhile.is_none());
    assert!(String::from_utf8(reader.seen).unwrap() == expected, "what the query saw when it began");
    let after = csv(dir.path(), "SELECT path FROM sample_files");
    assert!(before.iter().all(|path| !after.contains(path)), "the files were merged meanwhile");
    let aside = |path: &String| dir.path().join(path.replace("samples/", "aside/"));
    assert!(before.iter().all(|path| aside(path).exists()), "and waited for their reader");
    assert_eq!(files(dir.path()), after.len(), "elsewhere than in samples/");
    drop(Store::open(dir.path()).unwrap());
    assert!(!before.iter().any(|path| aside(path).exists()), "now they are gone");
    assert_eq!(check(dir.path()).unwrap().findings, []);
}

/// The rows of each job in all files of `samples/`, as another program sees them; `None` if a file went away meanwhile.
fn listed(dir: &Path) -> Option<HashMap<String, usize>> {
    let mut rows = HashMap::new();
    let names: Vec<_> = std::fs::read_dir(dir.join("samples")).unwrap().map(|entry| entry.unwrap().path()).collect();
    let open: Vec<_> = names.iter().map(std::fs::File::open).collect::<Result<_, _>>().ok()?;
    for file in open {
        let reader = SerializedFileReader::new(file).expect("every file there is whole");
        for row in reader.get_row_iter(None).unwrap() {
            *rows.entry(row.unwrap().get_string(0).unwrap().clone()).or_default() += 1;
        }
    }
    Some(rows)
}

#[test]
fn a_listing_of_samples_never_shows_a_row_twice_nor_a_file_that_is_not_whole() {
    let dir = scratch();
    let done = std::sync::atomic::AtomicBool::new(false);
    drop(Store::open(dir.path()).unwrap());
    std::thread::scope(|scope| {
        scope.spawn(|| {
            commit_one_by_one(dir.path(), 0..60);
            done.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        while !done.load(std::sync::atomic::Ordering::Relaxed) {
            let rows = listed(dir.path()).unwrap_or_default();
            assert!(rows.values().all(|count| *count == ROWS), "{rows:?}");
        }
    });
    assert_eq!(listed(dir.path()).unwrap().len(), 60);
}

/// The rows of samples, as a query has them during which something else happens.
pub fn rows_with_something_between(dir: &Path, meanwhile: impl FnMut()) -> Vec<String> {
    let mut reader = Interrupted { seen: Vec::new(), meanwhile: Some(meanwhile) };
    query(dir, "SELECT * FROM samples", Format::Csv, &mut reader).unwrap();
    assert!(reader.meanwhile.is_none(), "it happened");
    String::from_utf8(reader.seen).unwrap().lines().skip(1).map(str::to_owned).collect()
}

#[test]
fn a_stalled_reader_keeps_no_superseded_file_in_the_folder() {
    let dir = scratch();
    commit_one_by_one(dir.path(), 0..3);
    let meanwhile = || {
        commit_one_by_one(dir.path(), 3..9);
        let rows = listed(dir.path()).unwrap();
        assert_eq!((rows.len(), rows.values().sum::<usize>()), (9, 9 * ROWS));
    };
    rows_with_something_between(dir.path(), meanwhile);
}

#[test]
fn a_damaged_file_is_not_merged_into_one_that_would_vouch_for_it() {
    let dir = scratch();
    commit_one_by_one(dir.path(), 0..3);
    let path = dir.path().join(&csv(dir.path(), "SELECT path FROM sample_files")[0]);
    let mut bytes = std::fs::read(&path).unwrap();
    let last = bytes.len() / 2;
    bytes[last] ^= 4;
    std::fs::write(&path, bytes).unwrap();
    commit_one_by_one(dir.path(), 3..5);
    assert!(path.exists());
    let problems: Vec<_> = check(dir.path()).unwrap().findings.into_iter().map(|finding| finding.problem).collect();
    assert_eq!(problems, ["its bytes do not match the checksum in the catalogue (1 jobs)"]);
}

#[test]
fn a_crash_in_the_middle_of_a_swap_is_finished_by_the_next_opening_and_read_rightly_before() {
    let dir = scratch();
    drop(filled(dir.path(), &[ring(1.0)], 6, ROWS, 2));
    let expected = csv(dir.path(), "SELECT * FROM samples");
    let paths = csv(dir.path(), "SELECT path FROM sample_files ORDER BY key");
    // The catalogue names a merged file that has not entered the folder, and a superseded one is still in it.
    let (path, aside) = (dir.path().join(&paths[1]), dir.path().join(paths[1].replace("samples/", "aside/")));
    std::fs::copy(&path, dir.path().join("samples/00000000000000000000.parquet")).unwrap();
    std::fs::rename(&path, &aside).unwrap();
    assert_eq!(csv(dir.path(), "SELECT * FROM samples"), expected);
    let problems: Vec<_> = check(dir.path()).unwrap().findings.into_iter().map(|finding| finding.problem).collect();
    assert_eq!(problems, ["it belongs to no outcome: a crash left it"]);
    drop(Store::open(dir.path()).unwrap());
    assert!(path.exists() && !aside.exists());
    assert_eq!(files(dir.path()), 3);
    assert_eq!(csv(dir.path(), "SELECT * FROM samples"), expected);
    assert_eq!(check(dir.path()).unwrap().findings, []);
}

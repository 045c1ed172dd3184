//! Small files become few, and nobody who reads notices.

use super::make::*;
use meniscus::store::{Format, Store, Writer, WriterOptions, check, query};
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
    assert!(before.iter().all(|path| dir.path().join(path).exists()), "and waited for their reader");
    drop(Store::open(dir.path()).unwrap());
    assert_eq!(files(dir.path()), after.len(), "now they are gone");
    assert_eq!(check(dir.path()).unwrap().findings, []);
}

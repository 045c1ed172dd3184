//! `check` finds what is broken, says where and what next; `repair` puts it right and a further run ends as if nothing
//! had happened.

use super::make::*;
use meniscus::parameters::JobId;
use meniscus::store::{CheckReport, Format, Store, StoreError, Writer, check, checkpoint_file, query, repair};
use rusqlite::Connection;
use std::path::{Path, PathBuf};

/// A closed store of 12 runs in 3 files, as a run leaves it.
fn sound(dir: &Path) {
    drop(filled(dir, &[soft(1.0), ring(0.3)], 6, 9, 4));
}

/// Runs what is pending, and what is missing, as `run` does.
fn run_on(dir: &Path) {
    let points = [soft(1.0), ring(0.3)];
    let mut store = Store::open(dir).unwrap();
    register(&mut store, &points, 6);
    let writer = Writer::spawn(store, options(4)).unwrap();
    for point in &points {
        (0..6).for_each(|seed| writer.sender().send(finished(point, seed, 9)).unwrap());
    }
    drop(writer.finish().unwrap());
}

fn results(dir: &Path) -> [Vec<String>; 4] {
    [
        "SELECT job_id, model, gamma, e_w, seed, state, outcome, r_end, t_end, v_g_mean, shape_max FROM runs ORDER BY job_id",
        "SELECT * FROM clog_events ORDER BY job_id",
        "SELECT job_id, t, hex(vertices), loads FROM shapes ORDER BY job_id, t",
        "SELECT * FROM samples ORDER BY job_id, t",
    ]
    .map(|sql| csv(dir, sql))
}

/// Whether a store holds just these results; says which of the four kinds differ, not all of them.
fn same(dir: &Path, expected: &[Vec<String>; 4], context: &str) {
    let found = results(dir);
    let differ: Vec<_> = (0..4).filter(|&kind| found[kind] != expected[kind]).collect();
    assert!(differ.is_empty(), "{context}: results of the kinds {differ:?} differ");
}

fn flip(path: &Path, place: usize) {
    let mut bytes = std::fs::read(path).unwrap();
    bytes[place] ^= 1 << (place % 8);
    std::fs::write(path, bytes).unwrap();
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to.join(entry.file_name())),
            false => drop(std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap()),
        }
    }
}

fn sample_file(dir: &Path) -> PathBuf {
    dir.join(&csv(dir, "SELECT path FROM sample_files ORDER BY key")[0])
}

fn files(report: &CheckReport) -> Vec<String> {
    report.findings.iter().map(|finding| finding.file.display().to_string()).collect()
}

/// All files below a folder, with their bytes.
fn contents(dir: &Path) -> Vec<Vec<u8>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(contents(&path)),
            false => found.push(std::fs::read(path).unwrap()),
        }
    }
    found
}

#[test]
fn a_sound_store_is_clean_open_or_closed_and_a_check_changes_nothing() {
    let dir = scratch();
    sound(dir.path());
    let before = contents(&dir.path().join("samples"));
    let report = check(dir.path()).unwrap();
    assert_eq!((report.findings, report.notes, report.jobs, report.files), (vec![], vec![], 12, 3));
    assert_eq!(contents(&dir.path().join("samples")), before);
    assert!(dir.path().join("store.db.seal").exists());
    let store = Store::open(dir.path()).unwrap();
    let report = check(dir.path()).unwrap();
    assert_eq!((report.findings.len(), report.notes.len()), (0, 1), "{:?}", report.notes);
    assert!(matches!(repair(dir.path()), Err(StoreError::Locked { .. })));
    drop(store);
    assert_eq!(repair(dir.path()).unwrap().findings, []);
    assert!(!dir.path().join("quarantine").exists());
    assert!(matches!(check(&dir.path().join("none")), Err(StoreError::Missing(_))));
}

#[test]
fn every_flipped_byte_of_the_database_header_is_found_and_put_right_without_loss() {
    let whole = scratch();
    sound(whole.path());
    let expected = results(whole.path());
    for place in 0..100 {
        let dir = scratch();
        copy(whole.path(), dir.path());
        flip(&dir.path().join("store.db"), place);
        assert!(matches!(Store::open(dir.path()), Err(StoreError::Damaged { .. })), "byte {place}");
        let report = check(dir.path()).unwrap();
        assert_eq!(files(&report), ["store.db"], "byte {place}");
        repair(dir.path()).unwrap();
        assert!(dir.path().join("quarantine/store.db").exists());
        assert_eq!(check(dir.path()).unwrap().findings, [], "byte {place}");
        same(dir.path(), &expected, &format!("byte {place}: nothing had to be computed again"));
    }
}

#[test]
fn a_header_byte_flipped_after_a_kill_is_found_where_it_matters_and_the_results_come_back() {
    let whole = scratch();
    sound(whole.path());
    let expected = results(whole.path());
    // A killed process leaves no seal. The schema cookie and the writer's version are of no consequence.
    std::fs::remove_file(whole.path().join("store.db.seal")).unwrap();
    for place in (0..100).filter(|place| !(40..44).contains(place) && !(96..100).contains(place)) {
        let dir = scratch();
        copy(whole.path(), dir.path());
        flip(&dir.path().join("store.db"), place);
        match check(dir.path()) {
            // A schema number above the program's own: the words are those for a newer store.
            Err(StoreError::Newer { .. }) => assert!((60..64).contains(&place), "byte {place}"),
            found => {
                assert_eq!(files(&found.unwrap()), ["store.db"], "byte {place}");
                repair(dir.path()).unwrap();
                run_on(dir.path());
                same(dir.path(), &expected, &format!("byte {place}"));
                assert_eq!(check(dir.path()).unwrap().findings, [], "byte {place}");
            }
        }
    }
}

#[test]
fn a_flipped_byte_anywhere_in_the_database_is_found_and_the_results_come_back() {
    let whole = scratch();
    sound(whole.path());
    let expected = results(whole.path());
    let bytes = std::fs::metadata(whole.path().join("store.db")).unwrap().len() as usize;
    // A byte in every page, at another place of each.
    for (page, start) in (0..bytes).step_by(4096).enumerate() {
        let dir = scratch();
        copy(whole.path(), dir.path());
        flip(&dir.path().join("store.db"), start + page * 997 % 4096);
        let found = check(dir.path()).unwrap();
        assert_eq!(files(&found), ["store.db"], "page {page}");
        repair(dir.path()).unwrap();
        assert_eq!(check(dir.path()).unwrap().findings, [], "page {page}");
        run_on(dir.path());
        same(dir.path(), &expected, &format!("page {page}"));
    }
}

#[test]
fn two_damaged_pages_cost_the_jobs_in_them_and_not_those_between() {
    let whole = scratch();
    drop(filled(whole.path(), &[ring(0.3)], 200, 9, 50));
    let pages = std::fs::metadata(whole.path().join("store.db")).unwrap().len() as usize / 4096;
    let kept = (1..pages / 2).map(|page| {
        let dir = scratch();
        copy(whole.path(), dir.path());
        for page in [page, page + pages / 2] {
            flip(&dir.path().join("store.db"), 4096 * page + 2000);
        }
        repair(dir.path()).unwrap();
        assert_eq!(check(dir.path()).unwrap().findings, [], "page {page}");
        value::<i64>(dir.path(), "SELECT count(*) FROM jobs WHERE state = 'done'")
    });
    let mut kept: Vec<i64> = kept.collect();
    kept.sort_unstable();
    println!("jobs of 200 that are kept: {kept:?}");
    // Small tables have all their rows in one page.
    assert!(kept[kept.len() / 2] > 150, "{kept:?}");
}

#[test]
fn a_flipped_byte_in_a_sample_file_costs_its_jobs_alone() {
    let whole = scratch();
    sound(whole.path());
    let expected = results(whole.path());
    let length = std::fs::metadata(sample_file(whole.path())).unwrap().len() as usize;
    for place in (0..length).step_by(length / 16) {
        let dir = scratch();
        copy(whole.path(), dir.path());
        let path = sample_file(dir.path());
        flip(&path, place);
        let refusal = query(dir.path(), "SELECT * FROM samples", Format::Csv, &mut Vec::new()).unwrap_err().to_string();
        assert!(
            refusal.contains("checksum") && refusal.contains(&format!("meniscus check {}", dir.path().display())),
            "{refusal}"
        );
        let report = check(dir.path()).unwrap();
        assert_eq!(files(&report), [path.strip_prefix(dir.path()).unwrap().display().to_string()]);
        assert!(report.findings[0].problem.contains("checksum") && report.findings[0].cure.contains("run"));
        repair(dir.path()).unwrap();
        assert!(dir.path().join("quarantine").join(path.file_name().unwrap()).exists());
        assert_eq!(csv(dir.path(), "SELECT state, count(*) FROM runs GROUP BY 1"), ["done,8", "pending,4"]);
        assert_eq!(check(dir.path()).unwrap().findings, []);
        run_on(dir.path());
        same(dir.path(), &expected, "");
    }
}

#[test]
fn a_flipped_byte_in_a_checkpoint_is_found_and_the_file_put_aside() {
    let dir = scratch();
    sound(dir.path());
    let (soft, ring) = (soft(1.0), ring(0.3));
    register(&mut Store::open(dir.path()).unwrap(), &[soft.clone(), ring.clone()], 8);
    let folder = dir.path().join("checkpoints");
    let id = |seed| JobId::new(soft.id(), seed);
    let good = checkpoint_file::write(&folder, id(7), b"a state").unwrap();
    assert_eq!(check(dir.path()).unwrap().findings, []);
    let bad = checkpoint_file::write(&folder, id(6), b"another").unwrap();
    flip(&bad, 50);
    let ended = checkpoint_file::write(&folder, id(5), b"of a job that is done").unwrap();
    std::fs::rename(
        checkpoint_file::write(&folder, id(7), b"x").unwrap(),
        folder.join(format!("{}.ckpt", JobId::new(ring.id(), 6))),
    )
    .unwrap();
    checkpoint_file::write(&folder, id(7), b"a state").unwrap();
    assert_eq!(check(dir.path()).unwrap().findings.len(), 3);
    assert_eq!(repair(dir.path()).unwrap().findings.len(), 3);
    assert!(good.exists() && !bad.exists() && !ended.exists());
    assert_eq!(std::fs::read_dir(dir.path().join("quarantine")).unwrap().count(), 3);
    assert_eq!(check(dir.path()).unwrap().findings, []);
}

/// Spoils the rows of a closed store behind its back.
fn spoil(dir: &Path, sql: &str) {
    let conn = Connection::open(dir.join("store.db")).unwrap();
    conn.execute_batch(&format!("PRAGMA foreign_keys = OFF; {sql}")).unwrap();
    drop(conn);
    let _ = std::fs::remove_file(dir.join("store.db.seal"));
}

#[test]
fn rows_that_contradict_each_other_are_found_kept_and_computed_again() {
    let whole = scratch();
    sound(whole.path());
    let expected = results(whole.path());
    for sql in [
        "DELETE FROM outcomes WHERE job = 3",
        "DELETE FROM sample_index WHERE job = 2",
        "DELETE FROM clogs WHERE job = 1",
        "INSERT INTO clogs SELECT 2, t, r, x, y, ek_ratio, shape, contacts, mechanism FROM clogs LIMIT 1",
        "UPDATE jobs SET state = 'pending' WHERE key = 4",
        "UPDATE jobs SET seed = 77 WHERE key = 5",
        "UPDATE jobs SET state = 'failed' WHERE key = 6",
        "UPDATE points SET gamma = 0.25 WHERE model = 'DP'",
        "UPDATE points SET saturated = 1 - saturated, box_size = 70.0",
        "UPDATE points SET spec = replace(spec, '0.3', '0.4') WHERE model = 'SP'",
        "DELETE FROM jobs WHERE key = 7",
        "DELETE FROM points WHERE key = 1",
        "DELETE FROM sample_files WHERE key = 2",
        "UPDATE sample_files SET rows = 35 WHERE key = 2",
        "UPDATE sample_files SET bytes = 35 WHERE key = 2",
        "UPDATE sample_index SET first_row = first_row + 1 WHERE job = 2",
        "UPDATE sample_index SET row_count = 8 WHERE job = 2",
        "UPDATE sample_index SET row_count = 80 WHERE job = 4",
        "UPDATE sample_index SET first_row = 9 - first_row WHERE job IN (1, 2)",
        "INSERT INTO lambda_rows (point, runs, clogs) VALUES (77, 1, 1)",
        "UPDATE jobs SET job_id = 'ffffffffffffffffffff' WHERE key = 9",
        "DROP INDEX jobs_by_state",
        "DROP VIEW runs",
        "DELETE FROM campaigns",
    ] {
        let dir = scratch();
        copy(whole.path(), dir.path());
        spoil(dir.path(), sql);
        let report = check(dir.path()).unwrap();
        assert!(!report.findings.is_empty(), "{sql}");
        repair(dir.path()).unwrap();
        assert!(dir.path().join("quarantine").exists(), "{sql}");
        assert_eq!(check(dir.path()).unwrap().findings, [], "{sql}");
        run_on(dir.path());
        same(dir.path(), &expected, sql);
        assert_eq!(check(dir.path()).unwrap().findings, [], "{sql}");
    }
}

#[test]
fn a_job_that_a_repair_gives_back_leaves_no_samples_behind_in_a_file_of_others() {
    let dir = scratch();
    sound(dir.path());
    spoil(dir.path(), "DELETE FROM outcomes WHERE job = 2");
    repair(dir.path()).unwrap();
    assert_eq!(csv(dir.path(), "SELECT count(*), count(DISTINCT job_id) FROM samples"), ["99,11"]);
    assert_eq!(csv(dir.path(), "SELECT state, count(*) FROM runs GROUP BY 1"), ["done,11", "pending,1"]);
}

#[test]
fn what_a_crash_left_is_found_and_a_lost_database_costs_no_file() {
    let dir = scratch();
    sound(dir.path());
    let expected = results(dir.path());
    std::fs::copy(sample_file(dir.path()), dir.path().join("samples/0123456789abcdef0123.parquet")).unwrap();
    std::fs::write(dir.path().join("aside/batch.tmp"), b"PAR1").unwrap();
    assert_eq!(check(dir.path()).unwrap().findings.len(), 2);
    repair(dir.path()).unwrap();
    assert_eq!(std::fs::read_dir(dir.path().join("quarantine")).unwrap().count(), 2);

    std::fs::remove_file(dir.path().join("store.db")).unwrap();
    assert_eq!(files(&check(dir.path()).unwrap()), ["store.db"]);
    run_on(dir.path());
    assert_eq!(std::fs::read_dir(dir.path().join("quarantine")).unwrap().count(), 5, "the sample files are kept there");
    same(dir.path(), &expected, "");
    assert_eq!(check(dir.path()).unwrap().findings, []);
}

#[test]
fn a_database_that_is_rubbish_is_put_aside_and_the_campaign_begins_anew() {
    for rubbish in [Vec::new(), b"no database".to_vec(), vec![0; 8192], vec![0xA5; 20_000]] {
        let dir = scratch();
        sound(dir.path());
        let expected = results(dir.path());
        std::fs::write(dir.path().join("store.db"), &rubbish).unwrap();
        assert_eq!(files(&check(dir.path()).unwrap()), ["store.db"]);
        repair(dir.path()).unwrap();
        assert_eq!(std::fs::read(dir.path().join("quarantine/store.db")).unwrap(), rubbish);
        run_on(dir.path());
        same(dir.path(), &expected, "");
        assert_eq!(check(dir.path()).unwrap().findings, []);
    }
}

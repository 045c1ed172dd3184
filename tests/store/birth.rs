//! What a process killed in the midst of a commit leaves beside the database is put right by whoever opens next.

use super::make::*;
use meniscus::store::{Store, StoreError, check, open_reading, point_runs, repair, status};
use rusqlite::Connection;
use std::path::Path;

type Opener = fn(&Path) -> Result<(), StoreError>;

/// All that may be the first to open a store, by name.
const FIRSTS: [(&str, Opener); 6] = [
    ("run", |dir| Store::open(dir).map(drop)),
    ("status", |dir| status(dir).map(drop)),
    ("query", |dir| open_reading(dir).map(drop)),
    ("fit", |dir| open_reading(dir)?.map_or(Ok(()), |conn| point_runs(&conn).map(drop))),
    ("check", |dir| check(dir).map(drop)),
    ("repair", |dir| repair(dir).map(drop)),
];

const RUNS: &str = "SELECT * FROM runs ORDER BY job_id";

/// Copies a store as a kill would leave it: SQLite's shared memory dies with the process.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to.join("samples")).unwrap();
    for folder in ["", "samples"] {
        for entry in std::fs::read_dir(from.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() && path.extension().is_none_or(|extension| extension != "db-shm") {
                std::fs::copy(&path, to.join(folder).join(path.file_name().unwrap())).unwrap();
            }
        }
    }
}

/// Begins a change of the database in `dir` that is too large to be kept in memory, so half of it is on the disk and
/// the journal beside it; the connection is in its midst.
fn half_way(dir: &Path, change: &str) -> Connection {
    let conn = Connection::open(dir.join("store.db")).unwrap();
    conn.pragma_update(None, "journal_mode", "delete").unwrap();
    conn.pragma_update(None, "cache_size", 2).unwrap();
    let large = "CREATE TABLE large AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 300)
                 SELECT i, randomblob(3000) FROM n";
    conn.execute_batch(&format!("BEGIN; {change}; {large}")).unwrap();
    conn
}

#[test]
fn a_journal_that_a_kill_left_is_rolled_back_by_whoever_opens_first() {
    let folder = scratch();
    let whole = folder.path().join("whole");
    drop(filled(&whole, &[soft(1.0), ring(1.0)], 20, 3, 10));
    let expected = csv(&whole, RUNS);
    let midst = half_way(&whole, "UPDATE jobs SET state = 'failed'; DELETE FROM outcomes");
    for (name, first) in FIRSTS {
        let killed = folder.path().join(name);
        copy(&whole, &killed);
        assert!(killed.join("store.db-journal").metadata().unwrap().len() > 0, "there is something to undo");
        first(&killed).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(csv(&killed, RUNS), expected, "{name}");
        drop(Store::open(&killed).unwrap());
        assert_eq!(check(&killed).unwrap().findings, [], "{name}");
    }
    drop(midst);
}

#[test]
fn a_store_killed_while_it_was_made_in_place_is_made_again() {
    let folder = scratch();
    let whole = folder.path().join("whole");
    std::fs::create_dir_all(whole.join("samples")).unwrap();
    let midst = half_way(&whole, "CREATE TABLE campaigns (key INTEGER)");
    for (name, first) in FIRSTS {
        let killed = folder.path().join(name);
        copy(&whole, &killed);
        first(&killed).unwrap_or_else(|error| panic!("{name}: {error}"));
        drop(filled(&killed, &[soft(1.0)], 4, 2, 10));
        assert_eq!(csv(&killed, "SELECT count(*) FROM runs WHERE state = 'done'"), ["4"], "{name}");
        assert_eq!(check(&killed).unwrap().findings, [], "{name}");
    }
    drop(midst);
}

#[test]
fn a_log_cut_anywhere_is_replayed_up_to_its_last_commit_by_whoever_opens_first() {
    let folder = scratch();
    let whole = folder.path().join("whole");
    let mut store = Store::open(&whole).unwrap();
    register(&mut store, &[soft(1.0), ring(1.0)], 3);
    let log = whole.join("store.db-wal").metadata().unwrap().len();
    assert!(log > 40_000, "the first opening and the plan are in the log: {log}");
    for (number, end) in (0..=log).step_by(log as usize / 47).enumerate() {
        let (name, first) = FIRSTS[number % FIRSTS.len()];
        let place = format!("{name}, {end} of {log} bytes");
        let killed = folder.path().join(number.to_string());
        copy(&whole, &killed);
        std::fs::OpenOptions::new().write(true).open(killed.join("store.db-wal")).unwrap().set_len(end).unwrap();
        first(&killed).unwrap_or_else(|error| panic!("{place}: {error}"));
        let mut again = Store::open(&killed).unwrap_or_else(|error| panic!("{place}: {error}"));
        register(&mut again, &[soft(1.0), ring(1.0)], 3);
        drop(again);
        assert_eq!(csv(&killed, "SELECT count(*) FROM runs WHERE state = 'pending'"), ["6"], "{place}");
        assert_eq!(check(&killed).unwrap().findings, [], "{place}");
    }
}

#[test]
fn a_new_database_does_not_meet_the_log_of_one_that_is_gone() {
    let folder = scratch();
    let (whole, lost) = (folder.path().join("whole"), folder.path().join("lost"));
    let store = filled(&whole, &[soft(1.0)], 4, 2, 10);
    copy(&whole, &lost);
    drop(store);
    std::fs::remove_file(lost.join("store.db")).unwrap();
    std::fs::write(lost.join("store.db-journal"), b"of a database that is gone").unwrap();
    drop(Store::open(&lost).unwrap());
    assert_eq!(csv(&lost, "SELECT count(*) FROM runs"), ["0"]);
    assert_eq!(check(&lost).unwrap().findings, []);
    for kept in ["store.db-wal", "store.db-journal"] {
        assert!(lost.join("quarantine").join(kept).exists(), "{kept}");
    }
    let samples = std::fs::read_dir(lost.join("quarantine")).unwrap().count();
    assert!(samples > 2, "its sample files are kept too");
}

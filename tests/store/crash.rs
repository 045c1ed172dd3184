//! What a crash, a second process, a full disk or another version can do to a store: nothing that a reader would see.

use super::make::*;
use meniscus::parameters::JobId;
use meniscus::store::{Message, Store, StoreError, Writer, WriterStopped, query, status};
use rusqlite::Connection;
use std::path::Path;
use std::time::Duration;

fn sample_files(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir.join("samples")).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn a_batch_killed_half_way_leaves_no_half_row() {
    let dir = tempfile::tempdir().unwrap();
    drop(filled(dir.path(), &[soft(1.0)], 4, 3, 10));
    let (rows, files) = (csv(dir.path(), "SELECT * FROM samples"), sample_files(dir.path()));
    // Killed while the samples were written, and killed between their rename and the commit.
    let folder = dir.path().join("samples");
    std::fs::write(dir.path().join("aside/batch.tmp"), b"PAR1 and no footer").unwrap();
    std::fs::copy(folder.join(&files[0]), folder.join("00000000000000000000.parquet")).unwrap();
    assert_eq!(csv(dir.path(), "SELECT * FROM samples"), rows, "a reader sees catalogued files alone");
    drop(Store::open(dir.path()).unwrap());
    assert_eq!(sample_files(dir.path()), files);
    assert_eq!(csv(dir.path(), "SELECT * FROM samples"), rows);
}

#[test]
fn jobs_that_a_dead_process_left_running_are_pending_again() {
    let dir = tempfile::tempdir().unwrap();
    let store = filled(dir.path(), &[soft(1.0)], 3, 1, 10);
    let crash = "UPDATE jobs SET state = 'running' WHERE seed = 1; UPDATE jobs SET state = 'failed' WHERE seed = 2";
    store.connection().execute_batch(crash).unwrap();
    drop(store);
    drop(Store::open(dir.path()).unwrap());
    assert_eq!(csv(dir.path(), "SELECT state, attempts FROM runs ORDER BY seed"), ["done,1", "pending,1", "failed,1"]);
}

#[test]
fn a_second_writer_is_refused_and_told_who_holds_the_store() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let refusal = Store::open(dir.path()).unwrap_err();
    assert!(matches!(refusal, StoreError::Locked { .. }));
    assert!(refusal.to_string().contains(&format!("process {} on", std::process::id())), "{refusal}");
    drop(store);
    Store::open(dir.path()).unwrap();
}

#[test]
fn a_store_of_a_newer_program_is_refused_for_writing_and_for_reading() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    Connection::open(dir.path().join("store.db")).unwrap().pragma_update(None, "user_version", 999).unwrap();
    assert!(matches!(Store::open(dir.path()), Err(StoreError::Newer { found: 999, .. })));
    assert!(matches!(status(dir.path()), Err(StoreError::Newer { found: 999, .. })));
}

#[test]
fn outcomes_wait_out_a_disk_that_fails_for_a_while() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[soft(1.0)], 4);
    // A file in place of the folder stops every write of samples, for whatever user.
    let (folder, away) = (dir.path().join("samples"), dir.path().join("away"));
    std::fs::rename(&folder, &away).unwrap();
    std::fs::write(&folder, b"").unwrap();
    let mut patient = options(4);
    patient.pauses = vec![Duration::from_millis(20); 1000];
    let writer = Writer::spawn(store, patient).unwrap();
    (0..4).for_each(|seed| writer.sender().send(finished(&soft(1.0), seed, 2)).unwrap());
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(value::<i64>(dir.path(), "SELECT count(*) FROM outcomes"), 0);
    std::fs::remove_file(&folder).unwrap();
    std::fs::rename(&away, &folder).unwrap();
    writer.finish().unwrap();
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM runs JOIN samples USING (job_id) WHERE state = 'done'"), ["8"]);
}

#[test]
fn a_writer_that_cannot_save_gives_up_with_the_count_and_takes_no_more() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[soft(1.0)], 4);
    std::fs::remove_dir(dir.path().join("samples")).unwrap();
    let writer = Writer::spawn(store, options(2)).unwrap();
    let sender = writer.sender();
    (0..2).for_each(|seed| sender.send(finished(&soft(1.0), seed, 2)).unwrap());
    let error = writer.finish().unwrap_err();
    assert!(matches!(error, StoreError::GaveUp { unsaved: 2, attempts: 4, .. }), "{error}");
    assert_eq!(sender.send(Message::Started(JobId::new(soft(1.0).id(), 3))), Err(WriterStopped));
    // Nothing is half there, and the next opening can compute the jobs again.
    drop(Store::open(dir.path()).unwrap());
    assert_eq!(csv(dir.path(), "SELECT DISTINCT state, outcome FROM runs"), ["pending,"]);
}

#[test]
fn a_writer_dropped_without_a_word_still_saves() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[soft(1.0)], 1);
    let writer = Writer::spawn(store, options(1000)).unwrap();
    writer.sender().send(finished(&soft(1.0), 0, 2)).unwrap();
    drop(writer);
    assert_eq!(csv(dir.path(), "SELECT state FROM runs"), ["done"]);
}

#[test]
fn a_query_of_an_absent_store_says_how_to_make_one() {
    let dir = tempfile::tempdir().unwrap();
    let error = query(&dir.path().join("none"), "SELECT 1", meniscus::store::Format::Csv, &mut Vec::new()).unwrap_err();
    assert!(error.to_string().contains("meniscus run"), "{error}");
}

/// Where `the_victim_of_a_kill` writes.
const VICTIM_DIR: &str = "MENISCUS_TEST_VICTIM_DIR";

#[test]
#[ignore = "the other process of the next test"]
fn the_victim_of_a_kill() {
    let Some(dir) = std::env::var_os(VICTIM_DIR) else { return };
    let store = Store::open(Path::new(&dir)).unwrap();
    let writer = Writer::spawn(store, options(7)).unwrap();
    for seed in 0.. {
        writer.sender().send(Message::Started(JobId::new(ring(1.0).id(), seed))).unwrap();
        writer.sender().send(finished(&ring(1.0), seed, 50)).unwrap();
    }
}

#[test]
fn a_process_killed_at_any_instant_leaves_whole_results_or_none() {
    let dir = tempfile::tempdir().unwrap();
    register(&mut Store::open(dir.path()).unwrap(), &[ring(1.0)], 100_000);
    let mut kept: Vec<String> = Vec::new();
    for round in 0..8_u64 {
        let mut victim = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["crash::the_victim_of_a_kill", "--exact", "--ignored"])
            .env(VICTIM_DIR, dir.path())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let enough = kept.len() + 20;
        while status(dir.path()).unwrap().total.done < enough as u64 {
            assert_eq!(victim.try_wait().unwrap(), None, "the victim lives until it is killed");
            std::thread::sleep(Duration::from_millis(1));
        }
        // Another instant of the commit each round.
        std::thread::sleep(Duration::from_micros(700 * round));
        victim.kill().unwrap();
        victim.wait().unwrap();

        let store = Store::open(dir.path()).unwrap();
        let files = csv(dir.path(), "SELECT path FROM sample_files").len();
        assert_eq!(sample_files(dir.path()).len(), files, "nothing is left lying about");
        let done = csv(dir.path(), "SELECT * FROM runs WHERE state = 'done' ORDER BY seed");
        assert_eq!(done[..kept.len()], kept, "what was done stays as it was");
        let sql = "SELECT count(*) FROM runs JOIN samples USING (job_id) WHERE state = 'done'";
        assert_eq!(csv(dir.path(), sql), [(50 * done.len()).to_string()]);
        let clogs = "SELECT count(*) FROM runs JOIN clog_events USING (job_id) WHERE outcome = 'clogged'";
        assert_eq!(csv(dir.path(), clogs), csv(dir.path(), "SELECT count(*) FROM runs WHERE outcome = 'clogged'"));
        assert_eq!(csv(dir.path(), "SELECT count(*) FROM samples"), [(50 * done.len()).to_string()]);
        assert_eq!(csv(dir.path(), "SELECT count(*) FROM runs WHERE state = 'running'"), ["0"]);
        drop(store);
        kept = done;
    }
}

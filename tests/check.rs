//! `meniscus check` as people use it: a byte flips, the check says where, a repair and a run put it right.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{CAMPAIGN, expect, results};
use std::fs;
use std::path::Path;

fn flip(path: &Path, place: usize) {
    let mut bytes = fs::read(path).unwrap();
    bytes[place] ^= 0x10;
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_flipped_byte_is_named_with_the_next_step_and_check_repair_and_run_end_with_the_right_result() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("small.toml"), CAMPAIGN).unwrap();
    expect(0, dir, &["run", "small.toml"]);
    let store = dir.join("small.meniscus");
    let expected = results(dir, "small.meniscus");
    let clean = expect(0, dir, &["check", "small.meniscus"]);
    assert!(
        clean.stdout.is_empty() && String::from_utf8_lossy(&clean.stderr).contains("nothing is wrong with 24 jobs")
    );

    let samples = fs::read_dir(store.join("samples")).unwrap().next().unwrap().unwrap().path();
    let name = format!("samples/{}", samples.file_name().unwrap().display());
    for (file, name, place) in [(&samples, name.as_str(), 1000), (&store.join("store.db"), "store.db", 17)] {
        flip(file, place);
        let found = expect(1, dir, &["check"]);
        assert!(String::from_utf8_lossy(&found.stdout).starts_with(&format!("{name}: ")));
        assert!(String::from_utf8_lossy(&found.stderr).contains("meniscus check small.meniscus --repair"));
        let repaired = expect(1, dir, &["check", "--repair"]);
        assert!(String::from_utf8_lossy(&repaired.stdout).contains("quarantine/"));
        expect(0, dir, &["check"]);
        expect(0, dir, &["run", "small.toml"]);
        assert!(results(dir, "small.meniscus") == expected, "{name}: the results differ");
        expect(0, dir, &["check"]);
    }
    let mut kept: Vec<String> = fs::read_dir(store.join("quarantine"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.ends_with("-wal"))
        .collect();
    kept.sort();
    let samples = name.trim_start_matches("samples/");
    assert_eq!(kept, [samples, "store.db", "store.db.2"], "the database as it was before each of the repairs");
}

#[test]
fn a_run_on_a_store_with_a_damaged_database_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("small.toml"), CAMPAIGN).unwrap();
    expect(0, dir, &["run", "small.toml"]);
    flip(&dir.join("small.meniscus/store.db"), 3);
    for command in [&["run", "small.toml"][..], &["query", "small.meniscus", "select 1"], &["status"]] {
        let refusal = expect(1, dir, command);
        let text = String::from_utf8_lossy(&refusal.stderr).into_owned();
        assert!(
            text.contains("store.db") && text.contains("meniscus check small.meniscus --repair"),
            "{command:?}: {text}"
        );
    }
}

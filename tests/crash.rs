//! A campaign that is killed at any instant and run again ends as if nothing had happened.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{CAMPAIGN, ask, expect, meniscus, results};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Starts a run in the background.
fn start(dir: &Path, store: &str) -> std::process::Child {
    let mut command: Command = meniscus(dir, &["run", "small.toml", "--store", store]);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn a_run_killed_at_any_instant_and_run_again_equals_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    // Enough work that kills meet outcomes computed, written, and being committed.
    fs::write(dir.join("small.toml"), CAMPAIGN.replace("runs_per_point = 4", "runs_per_point = 100")).unwrap();
    let begin = Instant::now();
    expect(0, dir, &["run", "small.toml", "--store", "whole"]);
    let whole = begin.elapsed();
    let mut killed = 0;
    // Together four fifths of the work, whatever the machine.
    for share in [0.01, 0.16, 0.09, 0.16, 0.03, 0.2, 0.001, 0.15] {
        let mut child = start(dir, "killed");
        std::thread::sleep(whole.mul_f64(share));
        killed += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(killed >= 5, "most kills must hit a run at work, {killed} did");
    expect(0, dir, &["run", "small.toml", "--store", "killed"]);
    assert_eq!(results(dir, "killed"), results(dir, "whole"));
    // Files left by a kill are gone; what is there is catalogued.
    let files = fs::read_dir(dir.join("killed/samples")).unwrap().count();
    assert_eq!(ask(dir, "killed", "select count(*) from sample_files"), format!("count(*)\n{files}\n"));
}

#[test]
fn ctrl_c_ends_a_run_cleanly_and_the_same_command_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let long = CAMPAIGN.replace("runs_per_point = 4", "runs_per_point = 100");
    fs::write(dir.join("small.toml"), long).unwrap();
    let child = start(dir, "stopped");
    std::thread::sleep(Duration::from_millis(700));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let states = ask(dir, "stopped", "select distinct state from runs order by 1");
    assert!(states == "state\ndone\npending\n" || states == "state\npending\n", "{states}");
}

#[test]
fn a_second_run_on_the_same_store_is_refused_and_told_who_is_at_work() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("small.toml"), CAMPAIGN.replace("runs_per_point = 4", "runs_per_point = 100")).unwrap();
    let mut first = start(dir, "shared");
    while !dir.join("shared/store.db").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let second = expect(1, dir, &["run", "small.toml", "--store", "shared"]);
    let text = String::from_utf8_lossy(&second.stderr).into_owned();
    assert!(text.contains(&first.id().to_string()), "{text}");
    // Readers are welcome meanwhile.
    ask(dir, "shared", "select gamma, count(*), sum(outcome = 'clogged'), avg(r_end) from runs group by 1");
    ask(dir, "shared", "select count(*) from runs join samples using (job_id)");
    first.kill().unwrap();
    first.wait().unwrap();
}

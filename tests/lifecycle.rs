//! Life and death of a run as shells, pipes, terminals and the system's limits have it.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{CAMPAIGN, ask, expect, meniscus};
use rusqlite::Connection;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

/// Four runs that take longer than any test waits, each saved when it is told to stop.
const ENDLESS: &str = r#"
name = "endless"
model = "SP"
scene = "obstacles"
w_ob = 1.0
sigma_ob = 0.3
density = 0.1
e_w = 1.0
box_size = 40.0
runs_per_point = 4
sample_every = 1000.0
limits = { t_max = 1e9, distance = "none" }
"#;

const STORE: &str = "endless.meniscus";

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("endless.toml"), ENDLESS).unwrap();
    fs::write(folder.path().join("small.toml"), CAMPAIGN).unwrap();
    folder
}

/// The files of trajectories under way.
fn checkpoints(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir.join(STORE).join("checkpoints")).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "ckpt")).collect()
}

/// Arguments of a run that soon saves what it computes, so that one sees it at work; nobody may hear its talk.
const SAVING: [&str; 4] = ["run", "endless.toml", "--checkpoint-every", "0.02s"];

/// Waits until such a run is at work.
fn wait_for_work(dir: &Path) {
    while checkpoints(dir).is_empty() {
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The same in a new store.
fn begin_anew(dir: &Path) {
    let _ = fs::remove_dir_all(dir.join(STORE));
}

fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

/// A command line of bash in `dir`, with the program as `$M`.
fn bash(dir: &Path, line: &str) -> Command {
    let mut command = Command::new("bash");
    command.args(["-c", line]).current_dir(dir).env("M", env!("CARGO_BIN_EXE_meniscus"));
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

#[test]
fn a_store_that_outgrew_a_limit_while_it_was_made_is_made_by_the_next_run() {
    let folder = folder();
    let dir = folder.path();
    let limited = bash(dir, "ulimit -f 50; exec $M run small.toml").output().unwrap();
    let said = text(&limited.stderr);
    assert_eq!(code(&limited), Some(1), "{said}");
    assert!(said.contains("small.meniscus/store.db") && said.contains("too large"), "{said}");
    for first in ["status", "check"] {
        let refused = expect(1, dir, &[first, "small.meniscus"]);
        assert!(text(&refused.stderr).contains("meniscus run"), "{}", text(&refused.stderr));
    }
    expect(0, dir, &["run", "small.toml"]);
    expect(0, dir, &["check", "small.meniscus"]);
}

#[test]
fn a_run_whose_talk_breaks_off_goes_on_and_writes_its_tables() {
    let folder = folder();
    let dir = folder.path();
    let piped = bash(dir, "set -o pipefail; $M run small.toml -vv 2>&1 >out.txt | head -c 1 > /dev/null").output();
    assert_eq!(code(&piped.unwrap()), Some(0));
    assert!(fs::read_to_string(dir.join("out.txt")).unwrap().contains("lambda"));
    assert_eq!(ask(dir, "small.meniscus", "select distinct state from runs"), "state\ndone\n");
}

#[test]
fn a_run_whose_talk_broke_off_obeys_the_deadline_and_signals_and_saves() {
    let folder = folder();
    let dir = folder.path();
    let line = "set -o pipefail; $M run endless.toml --threads 1 -vv --deadline 0.4s 2>&1 >out.txt | true";
    assert_eq!(code(&bash(dir, line).output().unwrap()), Some(0));
    assert_eq!(checkpoints(dir).len(), 1);
    begin_anew(dir);
    let mut child = meniscus(dir, &[SAVING.as_slice(), &["-vv", "--threads", "2"]].concat());
    let mut child = child.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    wait_for_work(dir);
    signal(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(checkpoints(dir).len(), 2);
}

#[test]
fn a_run_whose_talk_nobody_reads_obeys_the_deadline() {
    let folder = folder();
    let dir = folder.path();
    let (reader, mut writer) = std::io::pipe().unwrap();
    // As much as a pipe holds: the next who writes to it waits.
    writer.write_all(&[b'x'; 65536]).unwrap();
    // The first line waits for a second, and no other does.
    let mut run = meniscus(dir, &["run", "endless.toml", "--deadline", "1.6s"]);
    let status = run.stdout(Stdio::null()).stderr(writer).status().unwrap();
    assert_eq!(status.code(), Some(0));
    assert!(!checkpoints(dir).is_empty());
    drop(reader);
}

#[test]
fn exit_codes_are_the_same_when_stderr_is_full_or_closed() {
    let folder = folder();
    let dir = folder.path();
    fs::write(dir.join("bad.toml"), CAMPAIGN.replace("density = 0.7", "densty = 0.7")).unwrap();
    let crowded = CAMPAIGN.replace("density = 0.7", "density = 2.785").replace("small", "crowded");
    fs::write(dir.join("crowded.toml"), crowded).unwrap();
    let cases: [(i32, &[&str]); 9] = [
        (0, &["run", "small.toml", "-vv"]),
        (3, &["run", "crowded.toml"]),
        (0, &["run", "endless.toml", "--deadline", "0.2s", "--threads", "999"]),
        (0, &["check", "small.meniscus"]),
        (0, &["render", "small.meniscus"]),
        (1, &["run", "bad.toml"]),
        (1, &["status", "nowhere"]),
        (1, &["accuracy", "nowhere.toml"]),
        (2, &["fly"]),
    ];
    for (expected, arguments) in cases {
        let full = meniscus(dir, arguments).stdout(Stdio::null()).stderr(File::create("/dev/full").unwrap()).status();
        assert_eq!(full.unwrap().code(), Some(expected), "{arguments:?} with a full stderr");
        let closed = bash(dir, &format!("exec $M {} >&- 2>&-", arguments.join(" "))).status();
        assert_eq!(closed.unwrap().code(), Some(expected), "{arguments:?} with stdout and stderr closed");
    }
}

#[test]
fn a_reader_that_has_seen_enough_ends_every_command_quietly() {
    let folder = folder();
    let dir = folder.path();
    expect(0, dir, &["run", "small.toml"]);
    let job = ask(dir, "small.meniscus", "select job_id from runs where model = 'DP' limit 1");
    let job = job.lines().nth(1).unwrap();
    for command in [
        &format!("render small.meniscus {job} -o - | head -c 8"),
        &format!("render small.meniscus {job} -o - --format png | true"),
        &format!("render small.meniscus {job} --format svg -o /dev/stdout | true"),
        "query small.meniscus 'select * from samples' | head -1",
        "fit small.meniscus | true",
        "plan small.toml | true",
        "status small.meniscus | true",
        "render small.meniscus | true",
        "check small.meniscus | true",
        "--help | true",
    ] {
        let quiet = bash(dir, &format!("set -o pipefail; $M --quiet {command}")).output().unwrap();
        assert_eq!((code(&quiet), quiet.stderr), (Some(0), Vec::new()), "{command}");
    }
}

#[test]
fn signals_within_a_second_are_one_and_a_hangup_saves_as_well() {
    let folder = folder();
    let dir = folder.path();
    for signals in [["-TERM", "-TERM"], ["-HUP", "-CONT"], ["-INT", "-HUP"]] {
        begin_anew(dir);
        let mut run = meniscus(dir, &[SAVING.as_slice(), &["--threads", "3"]].concat());
        let child = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        wait_for_work(dir);
        signals.iter().for_each(|name| signal(&child, name));
        let output = child.wait_with_output().unwrap();
        assert_eq!(code(&output), Some(130), "{signals:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains("under way are saved"), "{signals:?}: {}", text(&output.stderr));
        assert_eq!(checkpoints(dir).len(), 3, "{signals:?}");
    }
}

#[test]
fn timeout_signals_a_run_and_its_group_and_the_run_saves() {
    let folder = folder();
    let dir = folder.path();
    let output = bash(dir, "timeout 0.7 $M run endless.toml --threads 2").output().unwrap();
    assert_eq!(code(&output), Some(124));
    assert!(text(&output.stderr).contains("2 under way are saved"), "{}", text(&output.stderr));
    assert_eq!(checkpoints(dir).len(), 2);
}

#[test]
fn a_run_that_nohup_started_outlives_its_terminal() {
    let folder = folder();
    let dir = folder.path();
    let mut run = bash(dir, "trap '' HUP; exec $M run endless.toml --checkpoint-every 0.02s");
    let mut child = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_for_work(dir);
    signal(&child, "-HUP");
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(child.try_wait().unwrap(), None, "it goes on");
    signal(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn a_signal_a_second_after_the_first_ends_a_run_that_hangs() {
    let folder = folder();
    let dir = folder.path();
    let mut run = meniscus(dir, &[SAVING.as_slice(), &["--threads", "1"]].concat());
    let mut child = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    wait_for_work(dir);
    // Whoever writes to a database that somebody else writes to waits.
    let other = Connection::open(dir.join(STORE).join("store.db")).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    signal(&child, "-TERM");
    std::thread::sleep(Duration::from_millis(1200));
    assert_eq!(child.try_wait().unwrap(), None, "it hangs");
    signal(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    drop(other);
    expect(0, dir, &["run", "endless.toml", "--deadline", "0s"]);
    expect(0, dir, &["check", STORE]);
}

#[test]
fn a_deadline_is_told_as_it_was_understood() {
    let folder = folder();
    let dir = folder.path();
    let told = |deadline| text(&expect(0, dir, &["run", "endless.toml", "--deadline", deadline]).stderr);
    let said = told("0.2s");
    assert!(said.contains("stops at ") && said.contains(" today, in 200 ms") || said.contains("tomorrow"), "{said}");
    for (deadline, words) in [("1:30:00", "in 1 h 30 min"), ("1-00:00:00", "in 24 h 0 min"), ("1h30m", "in 1 h 30 min")]
    {
        begin_anew(dir);
        let mut run = meniscus(dir, &[SAVING.as_slice(), &["--deadline", deadline]].concat());
        let mut child = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        wait_for_work(dir);
        signal(&child, "-INT");
        let mut said = String::new();
        child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        child.wait().unwrap();
        assert!(said.contains(words), "{deadline}: {said}");
    }
}

#[test]
fn there_are_never_more_threads_than_jobs_and_too_many_for_the_cores_are_noted() {
    let folder = folder();
    let dir = folder.path();
    fs::write(dir.join("many.toml"), ENDLESS.replace("runs_per_point = 4", "runs_per_point = 40")).unwrap();
    let said = text(&expect(0, dir, &["run", "endless.toml", "--threads", "65535", "--deadline", "0.2s"]).stderr);
    assert!(said.contains("4 jobs to run on 4 threads"), "{said}");
    let arguments = ["run", "many.toml", "--store", "many", "--threads", "40", "--deadline", "0.2s"];
    let said = text(&expect(0, dir, &arguments).stderr);
    assert!(said.contains("note: 40 threads share"), "{said}");
}

#[test]
fn threads_that_the_system_refuses_are_an_error_that_says_what_to_do() {
    let folder = folder();
    let dir = folder.path();
    fs::write(dir.join("many.toml"), ENDLESS.replace("runs_per_point = 4", "runs_per_point = 400")).unwrap();
    // Root may start as many as it likes.
    fs::set_permissions(dir, std::os::unix::fs::PermissionsExt::from_mode(0o777)).unwrap();
    let nobody = "[ $(id -u) != 0 ] || nobody='setpriv --reuid=54321 --clear-groups'";
    let in_limit = |limit: u32, command: &str| {
        let line = format!("{nobody}; exec $nobody bash -c \"ulimit -u {limit}; exec $M {command}\"");
        bash(dir, &line).output().unwrap()
    };
    if code(&in_limit(1, "--version")) != Some(0) {
        return; // nobody else may start the program from where it lies
    }
    let plan = in_limit(1, "plan many.toml");
    assert_eq!(code(&plan), Some(0), "a plan needs no threads: {}", text(&plan.stderr));
    for limit in [1, 3, 6, 40] {
        let run = in_limit(limit, "run many.toml --threads 400");
        let said = text(&run.stderr);
        assert_eq!(code(&run), Some(1), "{limit}: {said}");
        assert!(said.contains("ulimit -u") && !said.contains("panicked"), "{limit}: {said}");
    }
    let store = dir.join(STORE);
    assert_eq!(code(&in_limit(1, &format!("check {}", store.display()))), Some(0), "a check needs none either");
}

#[test]
fn a_dumb_terminal_gets_no_colour_and_plain_lines() {
    let folder = folder();
    let dir = folder.path();
    fs::write(dir.join("bad.toml"), CAMPAIGN.replace("density = 0.7", "densty = 0.7")).unwrap();
    let seen = |term: &str, command: &str| {
        let line = format!("script -qec \"$M {command}\" /dev/null < /dev/null");
        text(&bash(dir, &line).env("TERM", term).env_remove("NO_COLOR").output().unwrap().stdout)
    };
    assert!(seen("xterm", "run bad.toml").contains('\x1b'), "elsewhere there are colours");
    let run = "run endless.toml --deadline 0.4s";
    assert!(seen("xterm", run).contains('\x1b'), "elsewhere there is a bar");
    for command in ["run bad.toml", run, "fly", "run"] {
        let said = seen("dumb", command);
        assert!(!said.is_empty() && !said.contains('\x1b'), "{command}: {said:?}");
    }
}

#[test]
fn every_command_that_is_shown_can_be_pasted() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("it's my\nfolder $HOME");
    fs::create_dir(&dir).unwrap();
    for (campaign, store) in [("a b.toml", "my 'store'"), ("./-c.toml", "./-s"), ("line\nfeed.toml", "tab\tulator")] {
        fs::write(dir.join(campaign), ENDLESS).unwrap();
        let arguments = ["run", campaign, "--store", store, "--threads", "1", "--deadline", "0.2s"];
        let said = text(&expect(0, &dir, &arguments).stderr);
        let shown: Vec<&str> =
            said.lines().filter_map(|line| line.split_once(": meniscus ").map(|two| two.1)).collect();
        assert_eq!(shown.len(), 1, "{said}");
        for command in shown {
            let command =
                if command.starts_with("run") { format!("{command} --deadline 0.2s") } else { command.into() };
            let pasted = bash(&dir, &format!("$M {command}")).output().unwrap();
            assert_eq!(code(&pasted), Some(0), "{command}: {}", text(&pasted.stderr));
        }
        let render = text(&expect(0, &dir, &["render", store]).stderr);
        let list = render.lines().find_map(|line| line.strip_prefix("name one: meniscus ")).unwrap();
        let list = list.split(" JOB_ID").next().unwrap();
        assert_eq!(code(&bash(&dir, &format!("$M {list}")).output().unwrap()), Some(0), "{list}");
        assert_eq!(fs::read_dir(&dir).unwrap().count() % 2, 0, "what was pasted went on with the same store");
    }
}

#[test]
fn a_campaign_from_a_pipe_is_called_the_same_campaign() {
    let folder = folder();
    let dir = folder.path();
    for line in [
        "$M run <(cat endless.toml) --deadline 0.2s",
        "cat endless.toml | $M run /dev/stdin --deadline 0.2s",
        "$M run /dev/stdin --deadline 0.2s < endless.toml",
    ] {
        let output = bash(dir, line).output().unwrap();
        let said = text(&output.stderr);
        assert_eq!(code(&output), Some(0), "{said}");
        assert!(said.contains("the same campaign") && !said.contains("/dev/"), "{line}: {said}");
    }
}

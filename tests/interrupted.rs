//! The program told to stop: by signals, by the clock, by failures; and what it does with what they leave.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{ask, expect, meniscus, results};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::time::Duration;

/// Four runs of half a second or more: a ring by either integrator, and a point.
const LONG: &str = r#"
name = "long"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.1
box_size = 40.0
runs_per_point = 1
limits.distance = "none"

[[block]]
name = "deformable"
model = "DP"
dynamics = "vertex"
integrator = "verlet"
n_vertices = 40
runs_per_point = 2
gamma = 0.3
limits.t_max = 12000.0

[[block]]
name = "implicit"
model = "DP"
dynamics = "vertex"
n_vertices = 40
integrator = "implicit"
gamma = 0.3
limits.t_max = 12000.0

[[block]]
name = "soft"
model = "SP"
e_w = 1.0
limits.t_max = 120000.0
"#;

/// Runs that end in a failure after a while: walls that give way.
const FAILING: &str = r#"
name = "failing"
scene = "obstacles"
model = "DP"
dynamics = "vertex"
w_ob = 0.2
sigma_ob = 0.3
density = 0.7
box_size = 40.0
n_vertices = 64
integrator = "implicit"
gamma = 1.0
e_w = 300.0
runs_per_point = 3
limits.t_max = 1000.0
"#;

fn folder(campaign: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("c.toml"), campaign).unwrap();
    folder
}

/// A run that is at work, and will be told to stop.
struct Running {
    child: Child,
    talk: BufReader<ChildStderr>,
}

impl Running {
    /// Starts a run and waits until it says what it does: from then on it heeds signals.
    fn start(dir: &Path, arguments: &[&str]) -> Self {
        let mut command = meniscus(dir, &[&["run", "c.toml"], arguments].concat());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut talk = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        talk.read_line(&mut line).unwrap();
        assert!(line.contains("jobs to run"), "{line}");
        Self { child, talk }
    }

    fn signal(&self, name: &str) {
        assert!(Command::new("kill").args([name, &self.child.id().to_string()]).status().unwrap().success());
    }

    /// Its exit code and what else it said.
    fn end(mut self) -> (Option<i32>, String) {
        let mut text = String::new();
        self.talk.read_to_string(&mut text).unwrap();
        (self.child.wait().unwrap().code(), text)
    }
}

fn checkpoints(dir: &Path, store: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir.join(store).join("checkpoints")).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|e| e == "ckpt")).collect()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_signal_saves_what_is_under_way_and_the_same_command_goes_on_to_the_same_bits() {
    let folder = folder(LONG);
    let dir = folder.path();
    expect(0, dir, &["run", "c.toml", "--store", "whole"]);
    assert_eq!(checkpoints(dir, "whole"), [] as [PathBuf; 0]);
    for (name, threads) in [("-INT", "1"), ("-TERM", "3"), ("-INT", "2")] {
        let run = Running::start(dir, &["--store", "cut", "--threads", threads, "--checkpoint-every", "0.02s"]);
        std::thread::sleep(Duration::from_millis(100));
        run.signal(name);
        let (code, text) = run.end();
        assert_eq!(code, Some(130), "{text}");
        assert!(text.contains("under way are saved") && text.contains("meniscus run c.toml --store cut"), "{text}");
        assert!(!checkpoints(dir, "cut").is_empty(), "{text}");
        assert_eq!(ask(dir, "cut", "select count(*) from runs where state = 'running'"), "count(*)\n0\n");
    }
    let goes_on = expect(0, dir, &["run", "c.toml", "--store", "cut"]);
    assert!(said(&goes_on).contains("from where they were saved"), "{}", said(&goes_on));
    assert_eq!(results(dir, "cut"), results(dir, "whole"));
    assert_eq!(checkpoints(dir, "cut"), [] as [PathBuf; 0], "they go with the outcomes");
}

#[test]
fn at_the_deadline_everything_is_saved_and_the_exit_code_is_0() {
    let folder = folder(&LONG.replace("000.0", "00000.0"));
    let dir = folder.path();
    let output = expect(0, dir, &["run", "c.toml", "--threads", "2", "--deadline", "0.5s"]);
    assert!(said(&output).contains("the deadline came") && said(&output).contains("2 under way are saved"));
    assert_eq!(checkpoints(dir, "long.meniscus").len(), 2, "{}", said(&output));
}

#[test]
fn two_signals_at_once_are_one_and_lose_nothing() {
    let folder = folder(LONG);
    let dir = folder.path();
    let run = Running::start(dir, &["--checkpoint-every", "0.02s"]);
    std::thread::sleep(Duration::from_millis(100));
    run.signal("-INT");
    run.signal("-INT");
    let (code, text) = run.end();
    assert_eq!(code, Some(130));
    assert!(text.contains("under way are saved"), "{text}");
    expect(0, dir, &["run", "c.toml"]);
    assert_eq!(ask(dir, "long.meniscus", "select state, count(*) from runs group by 1"), "state,count(*)\ndone,4\n");
}

#[test]
fn a_damaged_checkpoint_is_put_aside_and_its_job_begins_anew() {
    let folder = folder(LONG);
    let dir = folder.path();
    let run = Running::start(dir, &["--threads", "2"]);
    std::thread::sleep(Duration::from_millis(100));
    run.signal("-TERM");
    let (_, text) = run.end();
    let files = checkpoints(dir, "long.meniscus");
    assert_eq!(files.len(), 2, "{text}");
    let mut bytes = fs::read(&files[0]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 16;
    fs::write(&files[0], bytes).unwrap();
    let output = expect(0, dir, &["run", "c.toml"]);
    assert!(said(&output).contains("begins anew"), "{}", said(&output));
    assert!(dir.join("long.meniscus/quarantine").join(files[0].file_name().unwrap()).exists());
    expect(0, dir, &["run", "c.toml", "--store", "whole"]);
    assert_eq!(results(dir, "long.meniscus"), results(dir, "whole"));
}

#[test]
fn a_failed_job_leaves_a_dump_that_fails_again_and_can_be_tried_again() {
    let folder = folder(FAILING);
    let dir = folder.path();
    let store = "failing.meniscus";
    expect(3, dir, &["run", "c.toml", "--checkpoint-every", "0.01s"]);
    let failures = ask(dir, store, "select error_class, dump from failures order by job_id");
    let (class, _) = failures.lines().nth(1).unwrap().split_once(',').unwrap();
    let dumps: Vec<&str> = failures.lines().skip(1).map(|line| line.split_once(',').unwrap().1).collect();
    let mut from_the_middle = 0;
    for dump in &dumps {
        let output = expect(0, dir, &["replay", &format!("{store}/{dump}")]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("failed as recorded") && text.contains(class), "{text}");
        from_the_middle += usize::from(!text.contains("from step 0 "));
    }
    assert!(from_the_middle > 0, "a dump holds the last checkpoint");

    let before = results(dir, store);
    expect(3, dir, &["run", "c.toml"]);
    assert_eq!(ask(dir, store, "select max(attempts) from runs"), "max(attempts)\n1\n", "a failure is not tried again");
    let retry = |class: &str| expect(3, dir, &["run", "c.toml", "--retry", class]);
    retry("io");
    assert_eq!(ask(dir, store, "select max(attempts) from runs"), "max(attempts)\n1\n", "nor one of another class");
    retry(class);
    assert_eq!(ask(dir, store, "select max(attempts) from runs"), "max(attempts)\n2\n");
    assert_eq!(results(dir, store), before);
    let files = fs::read_dir(dir.join(store).join("dumps")).unwrap().count();
    assert_eq!(files, dumps.len());

    let path = dir.join(store).join(dumps[0]);
    let mut bytes = fs::read(&path).unwrap();
    bytes[60] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert!(said(&expect(1, dir, &["replay", &path.display().to_string()])).contains("damaged"));
    assert!(said(&expect(1, dir, &["replay", "none.ckpt"])).contains("none.ckpt"));
}

#[test]
fn the_same_failure_on_most_of_the_first_jobs_stops_a_campaign_and_says_what_to_do() {
    let soft_walls = FAILING.replace("e_w = 300.0", "e_w = 30.0").replace("runs_per_point = 3", "runs_per_point = 400");
    let folder = folder(&soft_walls);
    let dir = folder.path();
    let output = expect(1, dir, &["run", "c.toml", "--threads", "2"]);
    for text in ["failed alike (engulfed)", "meniscus query failing.meniscus", "meniscus replay", "--retry engulfed"] {
        assert!(said(&output).contains(text), "{}", said(&output));
    }
    let left = ask(dir, "failing.meniscus", "select count(*) from runs where state = 'pending'");
    let left: u64 = left.lines().nth(1).unwrap().parse().unwrap();
    assert!(left > 0, "most of the campaign was not tried");
}

//! Questions to a store: without the right to write, while a run goes on, after it was stopped, in every format.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "a test that cannot go on has failed")]

mod common;

use common::{ask, expect, meniscus};
use meniscus::store::Store;
use rusqlite::Connection;
use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Six soft particles, in a tenth of a second.
const QUICK: &str = r#"
name = "quick"
model = "SP"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.7
box_size = 20.0
runs_per_point = 3
limits.distance = 6.0
grid.e_w = [1.0, 10.0]
"#;

/// One of two blocks does not end in an hour.
const ENDLESS: &str = r#"
name = "endless"
model = "SP"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.7
box_size = 20.0
runs_per_point = 1
e_w = 1.0

[[block]]
name = "short"
runs_per_point = 3
limits = { t_max = 50.0 }

[[block]]
name = "long"
density = 0.01
limits = { t_max = 1e9, distance = "none" }
sample_every = 1000.0
"#;

fn folder(campaign: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("c.toml"), campaign).unwrap();
    folder
}

/// A folder with the finished store `quick.meniscus`.
fn finished() -> tempfile::TempDir {
    let folder = folder(QUICK);
    expect(0, folder.path(), &["run", "c.toml"]);
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn is_root() -> bool {
    text(&Command::new("id").arg("-u").output().unwrap().stdout).trim() == "0"
}

/// Takes the right to write away from everybody, root apart.
fn seal(dir: &Path) {
    assert!(Command::new("chmod").args(["-R", "a-w,a+rX"]).arg(dir).status().unwrap().success());
}

/// Gives it back, so that the folder can be removed.
fn unseal(dir: &Path) {
    assert!(Command::new("chmod").args(["-R", "u+w"]).arg(dir).status().unwrap().success());
}

/// Runs the program as somebody whom missing rights bind. `None`, and why, where that cannot be done.
fn bound(dir: &Path, arguments: &[&str]) -> Option<Output> {
    if !is_root() {
        return Some(meniscus(dir, arguments).output().unwrap());
    }
    fs::set_permissions(dir, fs::Permissions::from_mode(0o755)).unwrap();
    let nobody = ["--reuid=65534", "--regid=65534", "--clear-groups"];
    let setpriv = || {
        let mut command = Command::new("setpriv");
        command.args(nobody).arg(env!("CARGO_BIN_EXE_meniscus")).current_dir(dir);
        command
    };
    if !setpriv().arg("--version").output().is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: root is not bound by rights, and nobody else can be made to run the program");
        return None;
    }
    Some(setpriv().args(arguments).output().unwrap())
}

/// What the program says in a folder with other mounts, whose script mounts them. `None`, and why, where that cannot be
/// done.
fn mounted(dir: &Path, script: &str) -> Option<Output> {
    let run = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-c", script]).current_dir(dir).env("M", env!("CARGO_BIN_EXE_meniscus"));
        command.output()
    };
    if !run("mkdir -p mount && mount -t tmpfs tmpfs mount").is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: nothing can be mounted here");
        return None;
    }
    Some(run(&format!("set -e; {script}")).unwrap())
}

const QUESTIONS: [&[&str]; 6] = [
    &["status", "quick.meniscus"],
    &["query", "quick.meniscus", "select count(*) from samples join runs using (job_id)"],
    &["query", "quick.meniscus", "select count(*) from outline join obstacles using (job_id)"],
    &["fit", "quick.meniscus"],
    &["check", "quick.meniscus"],
    &["render", "quick.meniscus"],
];

#[test]
fn a_store_that_may_not_be_written_answers_as_one_that_may() {
    let folder = finished();
    let dir = folder.path();
    let expected = QUESTIONS.map(|question| text(&expect(0, dir, question).stdout));
    for beside in ["store.db-wal", "store.db-shm"] {
        let _ = fs::remove_file(dir.join("quick.meniscus").join(beside));
    }
    seal(&dir.join("quick.meniscus"));
    for (question, expected) in QUESTIONS.iter().zip(&expected) {
        let Some(output) = bound(dir, question) else { break };
        assert!(output.status.success(), "{question:?}: {}", text(&output.stderr));
        assert_eq!(&text(&output.stdout), expected, "{question:?}");
        if question[0] == "fit" {
            assert!(text(&output.stderr).contains("not kept in the store"), "{}", text(&output.stderr));
        }
    }
    unseal(&dir.join("quick.meniscus"));
}

#[test]
fn a_stopped_run_can_be_read_without_the_right_to_write() {
    let folder = folder(ENDLESS);
    let dir = folder.path();
    expect(0, dir, &["run", "c.toml", "--threads", "2", "--deadline", "0.5s"]);
    seal(&dir.join("endless.meniscus"));
    if let Some(output) = bound(dir, &["status", "endless.meniscus"]) {
        assert!(text(&output.stdout).contains("3 done"), "{}{}", text(&output.stdout), text(&output.stderr));
    }
    unseal(&dir.join("endless.meniscus"));
}

#[test]
fn results_in_a_log_that_cannot_be_read_are_not_passed_over() {
    let folder = finished();
    let dir = folder.path();
    // As after a kill: a log with pages that the database lacks, and no shared memory.
    let store = Store::open(&dir.join("quick.meniscus")).unwrap();
    let killed = dir.join("killed.meniscus");
    fs::create_dir(&killed).unwrap();
    for name in ["store.db", "store.db-wal"] {
        fs::copy(dir.join("quick.meniscus").join(name), killed.join(name)).unwrap();
    }
    drop(store);
    assert!(killed.join("store.db-wal").metadata().unwrap().len() > 0);
    seal(&killed);
    for question in ["status", "fit", "check", "render"] {
        let Some(output) = bound(dir, &[question, "killed.meniscus"]) else { break };
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{question}: {said}");
        assert!(said.contains("copy the whole folder") && said.contains("meniscus status"), "{question}: {said}");
    }
    unseal(&killed);
    expect(0, dir, &["status", "killed.meniscus"]);
}

#[test]
fn a_store_on_a_read_only_mount_answers() {
    let folder = finished();
    let script = "mount --bind quick.meniscus mount; mount -o remount,ro,bind mount; \
                  \"$M\" status mount; \"$M\" check mount; \"$M\" fit mount; \"$M\" render mount; \
                  \"$M\" query mount 'select count(*) from samples'; cd mount/samples; \"$M\" status";
    let Some(output) = mounted(folder.path(), script) else { return };
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout).matches("6 done").count(), 2, "{}", text(&output.stdout));
}

#[test]
fn who_may_not_undo_a_change_is_told_and_names_the_command_that_does() {
    let folder = finished();
    let dir = folder.path();
    // A change of the database that is too large to be kept in memory, so half of it is on the disk.
    let midst = Connection::open(dir.join("quick.meniscus/store.db")).unwrap();
    midst.pragma_update(None, "journal_mode", "delete").unwrap();
    midst.pragma_update(None, "cache_size", 2).unwrap();
    let large = "CREATE TABLE large AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 300)
                 SELECT i, randomblob(3000) FROM n";
    midst.execute_batch(&format!("BEGIN; UPDATE jobs SET state = 'failed'; {large}")).unwrap();
    let script = "cp -r quick.meniscus 'my store'; rm -f 'my store/store.db-shm'; mount --bind 'my store' mount; \
                  mount -o remount,ro,bind mount; \"$M\" status mount && exit 9; \"$M\" status 'my store'";
    let Some(output) = mounted(dir, script) else { return };
    let said = text(&output.stderr);
    assert!(said.contains("`meniscus status mount`"), "{said}");
    assert!(
        output.status.success() && text(&output.stdout).contains("6 done"),
        "the same, by somebody who may: {said}"
    );
    drop(midst);
}

#[test]
fn a_full_disk_can_be_read_and_is_not_taken_for_a_damaged_one() {
    let folder = finished();
    let script = "mount -t tmpfs -o size=1m tmpfs mount; cp -r quick.meniscus mount/s; rm -f mount/s/store.db-*; \
                  head -c 2m /dev/zero >mount/fill || true; \"$M\" status mount/s; \"$M\" check mount/s; \
                  \"$M\" fit mount/s; \"$M\" query mount/s 'select count(*) from samples'";
    let Some(output) = mounted(folder.path(), script) else { return };
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
    assert!(text(&output.stderr).contains("nothing is wrong") && text(&output.stdout).contains("Decay lengths"));
}

#[test]
fn fit_answers_while_another_process_writes_and_says_that_it_keeps_nothing() {
    let folder = finished();
    let dir = folder.path();
    let kept = || ask(dir, "quick.meniscus", "select count(*) from lambda_fits");
    let tables = expect(0, dir, &["fit"]).stdout;
    let mut store = Store::open(&dir.join("quick.meniscus")).unwrap();
    meniscus::store::save_fits(&mut store, &[]).unwrap();
    let output = expect(0, dir, &["fit"]);
    assert_eq!(text(&output.stdout), text(&tables));
    let said = text(&output.stderr);
    assert!(said.contains("not kept in the store") && said.contains("in use by process"), "{said}");
    assert_eq!(kept(), "count(*)\n0\n");
    drop(store);
    assert_eq!(text(&expect(0, dir, &["fit"]).stderr), "");
    assert_eq!(kept(), "count(*)\n2\n");
}

#[test]
fn a_run_that_is_stopped_prints_and_keeps_the_tables_of_what_is_finished() {
    let folder = folder(ENDLESS);
    let dir = folder.path();
    let at_deadline = expect(0, dir, &["run", "c.toml", "--threads", "2", "--deadline", "0.5s"]);
    let tables = text(&at_deadline.stdout);
    assert!(tables.contains("Decay lengths, SP") && tables.contains("Mean speeds"), "{tables}");
    assert_eq!(ask(dir, "endless.meniscus", "select runs from lambda_fits"), "runs\n3\n");

    let mut run = meniscus(dir, &["run", "c.toml", "--threads", "2"]);
    let mut run = run.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut talk = std::io::BufReader::new(run.stderr.take().unwrap());
    std::io::BufRead::read_line(&mut talk, &mut String::new()).unwrap();
    assert!(Command::new("kill").arg(run.id().to_string()).status().unwrap().success());
    let output = run.wait_with_output().unwrap();
    assert_eq!((output.status.code(), text(&output.stdout)), (Some(130), tables));
}

#[test]
fn a_run_that_is_stopped_before_anything_is_finished_prints_no_empty_table() {
    let slow = "1e9, distance = \"none\" }\nsample_every = 1000.0";
    let folder = folder(&ENDLESS.replace("density = 0.7", "density = 0.01").replace("50.0 }", slow));
    let dir = folder.path();
    let output = expect(0, dir, &["run", "c.toml", "--threads", "1", "--deadline", "0.3s"]);
    assert_eq!(text(&output.stdout), "");
    assert!(text(&expect(0, dir, &["fit"]).stderr).contains("no run is finished yet"));
}

#[test]
fn fit_plan_status_and_check_give_rows_to_programs() {
    let folder = finished();
    let dir = folder.path();
    let said = |arguments: &[&str]| text(&expect(0, dir, arguments).stdout);
    for (command, rows, columns) in [
        (vec!["fit"], 2, "point_id,model,"),
        (vec!["plan", "c.toml"], 1, "block,model,scene,points,"),
        (vec!["status"], 1, "campaign,jobs,pending,running,done,failed"),
        (vec!["check"], 0, "file,problem,cure"),
    ] {
        let csv = said(&[command.as_slice(), &["--format", "csv"]].concat());
        assert!(csv.starts_with(columns) && csv.lines().count() == rows + 1, "{command:?}: {csv}");
        let json = said(&[command.as_slice(), &["--format", "json"]].concat());
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        if command != ["status"] {
            assert_eq!(json.as_array().unwrap().len(), rows, "{command:?}");
        }
    }
    assert_eq!(said(&["status", "--json"]), said(&["status", "--format", "json"]));
    let fits: serde_json::Value = serde_json::from_str(&said(&["fit", "--format", "json"])).unwrap();
    let kept = ask(dir, "quick.meniscus", "select e_w, lambda from lambda_fits where e_w = 10.0");
    assert_eq!(kept, format!("e_w,lambda\n10.0,{}\n", fits[1]["lambda"]));

    fs::write(dir.join("quick.meniscus/samples/stray.parquet"), "stray").unwrap();
    let found = text(&expect(1, dir, &["check", "--format", "csv"]).stdout);
    assert!(found.lines().nth(1).unwrap().starts_with("samples/stray.parquet,"), "{found}");
}

#[test]
fn a_statement_comes_from_a_file_or_from_stdin_and_its_answer_goes_to_a_file_whole() {
    let folder = finished();
    let dir = folder.path();
    let store = "quick.meniscus";
    fs::write(dir.join("q.sql"), "-- How many?\nselect count(*) as n\nfrom runs;\n").unwrap();
    let csv = ["--format", "csv"];
    assert_eq!(text(&expect(0, dir, &[&["query", store, "-f", "q.sql"], &csv[..]].concat()).stdout), "n\n6\n");
    for from_stdin in [&["-"][..], &["-f", "-"]] {
        let mut asked = meniscus(dir, &[&["query", store], from_stdin, &csv].concat());
        let mut asked = asked.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        asked.stdin.take().unwrap().write_all(b"select 7 as n").unwrap();
        assert_eq!(text(&asked.wait_with_output().unwrap().stdout), "n\n7\n");
    }
    expect(2, dir, &["query", store, "select 1", "-f", "q.sql"]);
    expect(2, dir, &["query", store]);
    assert!(text(&expect(1, dir, &["query", store, "-f", "none.sql"]).stderr).contains("none.sql"));

    let answer = |sql: &str, code| expect(code, dir, &[&["query", store, sql, "-o", "link.csv"], &csv[..]].concat());
    fs::write(dir.join("real.csv"), "old").unwrap();
    std::os::unix::fs::symlink("real.csv", dir.join("link.csv")).unwrap();
    answer("select nothing", 1);
    answer("select abs(column1) from (values (1), (-9223372036854775808))", 1);
    assert_eq!(fs::read_to_string(dir.join("real.csv")).unwrap(), "old", "half an answer replaces nothing");
    assert_eq!(text(&answer("select 1 as n", 0).stdout), "");
    assert_eq!(fs::read_to_string(dir.join("real.csv")).unwrap(), "n\n1\n");
    assert!(dir.join("link.csv").symlink_metadata().unwrap().is_symlink());
    let left = fs::read_dir(dir).unwrap().filter(|entry| {
        let name = entry.as_ref().unwrap().file_name();
        name.to_string_lossy().starts_with(".meniscus")
    });
    assert_eq!(left.count(), 0);
    assert_eq!(
        text(&expect(0, dir, &["query", store, "select 1 as n", "-o", "-", "--format", "csv"]).stdout),
        "n\n1\n"
    );
    expect(0, dir, &["query", store, "select 1", "-o", "/dev/null"]);
    assert!(!Path::new("/dev/null").is_file());
    assert!(text(&expect(1, dir, &["query", store, "select 1", "-o", "no/such/f"]).stderr).contains("no/such/f"));
}

#[test]
fn a_table_that_was_cut_says_so() {
    let folder = finished();
    let many = "with recursive c(n) as (values (1) union all select n + 1 from c limit 10001) select n from c";
    let output = expect(0, folder.path(), &["query", "quick.meniscus", many]);
    assert!(text(&output.stderr).contains("stops at 10000 rows") && text(&output.stderr).contains("--format csv"));
    let quiet = expect(0, folder.path(), &["query", "quick.meniscus", many, "--quiet"]);
    assert_eq!(text(&quiet.stderr), "");
}

#[test]
fn parquet_is_not_printed_on_a_terminal() {
    let folder = finished();
    let asked = format!("'{}' query quick.meniscus 'select 1' --format parquet", env!("CARGO_BIN_EXE_meniscus"));
    let mut terminal = Command::new("script");
    let terminal = terminal.args(["-qec", &asked, "/dev/null"]).current_dir(folder.path()).stdin(Stdio::null());
    let Ok(output) = terminal.output() else {
        eprintln!("skipped: there is no `script` to make a terminal");
        return;
    };
    assert!(text(&output.stdout).contains("not for reading on a terminal"), "{}", text(&output.stdout));
    let piped = expect(0, folder.path(), &["query", "quick.meniscus", "select 1", "--format", "parquet"]).stdout;
    assert!(piped.starts_with(b"PAR1"));
}

#[test]
fn a_path_into_a_store_means_the_store() {
    let folder = finished();
    let dir = folder.path();
    fs::create_dir(dir.join("quick.meniscus/mine")).unwrap();
    for path in ["quick.meniscus", "quick.meniscus/", "quick.meniscus/store.db", "quick.meniscus/samples"] {
        assert!(text(&expect(0, dir, &["status", path]).stdout).contains("6 done"), "{path}");
        expect(0, dir, &["query", path, "select 1"]);
        expect(0, dir, &["render", path]);
        expect(0, dir, &["fit", path]);
        expect(0, dir, &["check", path]);
        assert!(text(&expect(0, dir, &["plan", "c.toml", "--store", path]).stdout).contains("6 done"), "{path}");
        assert!(text(&expect(0, dir, &["run", "c.toml", "--store", path]).stderr).contains("all 6 jobs are done"));
    }
    for path in ["quick.meniscus/mine", "quick.meniscus/other"] {
        assert!(text(&expect(1, dir, &["status", path]).stderr).contains("no store at"), "{path} is no part of it");
    }
    for inside in ["quick.meniscus", "quick.meniscus/samples"] {
        assert!(text(&expect(0, &dir.join(inside), &["status"]).stdout).contains("6 done"), "{inside}");
    }
}

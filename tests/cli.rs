//! The program as people use it: run, run again, ask, fit, and the errors they meet.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{CAMPAIGN, ask, expect, meniscus, results};
use std::fs;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("small.toml"), CAMPAIGN).unwrap();
    folder
}

#[test]
fn a_campaign_runs_to_its_tables_and_then_has_nothing_left_to_do() {
    let folder = folder();
    let dir = folder.path();
    let first = expect(0, dir, &["run", "small.toml"]);
    let tables = String::from_utf8_lossy(&first.stdout).into_owned();
    for text in ["Decay lengths, DP in obstacle arrays", "Decay lengths, SP", "Mean speeds, DP", "lambda [95%]"] {
        assert!(tables.contains(text), "{tables}");
    }
    let second = expect(0, dir, &["run", "small.toml"]);
    assert!(String::from_utf8_lossy(&second.stderr).contains("all 24 jobs are done"));
    assert_eq!(first.stdout, second.stdout, "the same results give the same tables");
    assert_eq!(expect(0, dir, &["fit"]).stdout, second.stdout);
    assert_eq!(
        ask(dir, "small.meniscus", "select count(*), sum(attempts) from runs"),
        "count(*),sum(attempts)\n24,24\n"
    );
    assert!(String::from_utf8_lossy(&expect(0, dir, &["status"]).stdout).contains("24 done"));
    assert!(String::from_utf8_lossy(&expect(0, dir, &["plan", "small.toml"]).stdout).contains("16 done"));
}

#[test]
fn a_store_of_an_earlier_schema_is_upgraded_by_what_the_refusal_to_read_it_names() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let old = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/store/fixtures/schema-4/store");
    fs::create_dir_all(dir.join("old.meniscus/samples")).unwrap();
    fs::copy(old.join("store.db"), dir.join("old.meniscus/store.db")).unwrap();
    for file in fs::read_dir(old.join("samples")).unwrap().map(Result::unwrap) {
        fs::copy(file.path(), dir.join("old.meniscus/samples").join(file.file_name())).unwrap();
    }
    let sql = "select count(*), count(point_id), count(block) from all_runs";
    let refusal = expect(1, dir, &["query", "old.meniscus", sql]).stderr;
    assert!(String::from_utf8_lossy(&refusal).contains("`meniscus fit old.meniscus` upgrades it"));
    expect(0, dir, &["fit", "old.meniscus"]);
    assert!(ask(dir, "old.meniscus", sql).ends_with("\n12,12,12\n"));
    assert!(dir.join("old.meniscus/store.db.schema-4").exists());
}

#[test]
fn tables_say_that_they_use_more_runs_than_the_campaign_asks_for() {
    let folder = folder();
    let dir = folder.path();
    let text = |output: std::process::Output| String::from_utf8(output.stdout).unwrap();
    let whole = text(expect(0, dir, &["run", "small.toml"]));
    assert!(!whole.contains("asks for"), "{whole}");
    fs::write(dir.join("small.toml"), CAMPAIGN.replace("runs_per_point = 4", "runs_per_point = 3")).unwrap();
    let fewer = text(expect(0, dir, &["run", "small.toml"]));
    assert!(fewer.starts_with(&whole), "the tables are the same\n{fewer}");
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words(&fewer).contains("At 2 of 4 points that is 4 runs, of which this campaign asks for 3."), "{fewer}");
    // Other seeds are further seeds, whatever their number.
    let other = CAMPAIGN.replace("runs_per_point = 4", "first_seed = 2\nruns_per_point = 4");
    fs::write(dir.join("small.toml"), other).unwrap();
    let other = text(expect(0, dir, &["run", "small.toml"]));
    let told = "At 4 of 4 points that is 6 to 10 runs, of which this campaign asks for 4 to 8.";
    assert!(words(&other).contains(told), "{other}");
    // `fit` is asked for all that there is.
    assert!(!text(expect(0, dir, &["fit"])).contains("asks for"));
    // Seeds that `until` may add are asked for.
    let until = CAMPAIGN
        .replace("runs_per_point = 8", "runs_per_point = 2")
        .replace("runs_per_point = 4", "runs_per_point = 2");
    let until = until.replacen("\n[limits]", "until = { relative_error = 1.0, max_runs = 10 }\n[limits]", 1);
    fs::write(dir.join("small.toml"), until).unwrap();
    assert!(!text(expect(0, dir, &["run", "small.toml"])).contains("asks for"));
}

#[test]
fn results_do_not_depend_on_threads_or_instruction_sets() {
    let folder = folder();
    let dir = folder.path();
    expect(0, dir, &["run", "small.toml", "--store", "one", "--threads", "1"]);
    expect(0, dir, &["run", "small.toml", "--store", "two", "--threads", "2"]);
    let scalar = meniscus(dir, &["run", "small.toml", "--store", "scalar"]).env("MENISCUS_SIMD", "scalar").output();
    assert!(scalar.unwrap().status.success());
    let one = results(dir, "one");
    assert!(one[0].contains("clogged") && one[0].contains("distance") && one[2].lines().count() > 500);
    assert_eq!(one, results(dir, "two"));
    assert_eq!(one, results(dir, "scalar"));
}

#[test]
fn a_campaign_that_grows_only_adds_jobs() {
    let folder = folder();
    let dir = folder.path();
    expect(0, dir, &["run", "small.toml"]);
    let before = ask(dir, "small.meniscus", "select job_id, r_end from runs order by 1");
    let grown = CAMPAIGN.replace("e_w = [1.0, 30.0]", "e_w = [1.0, 10.0, 30.0]");
    fs::write(dir.join("small.toml"), grown).unwrap();
    let output = expect(0, dir, &["run", "small.toml"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("8 jobs to run"));
    let after = ask(dir, "small.meniscus", "select job_id, r_end from runs order by 1");
    assert!(before.lines().all(|line| after.contains(line)));
    assert_eq!(ask(dir, "small.meniscus", "select sum(attempts) from runs"), "sum(attempts)\n32\n");
}

#[test]
fn a_campaign_with_mistakes_is_refused_before_anything_is_written() {
    let folder = folder();
    let dir = folder.path();
    fs::write(dir.join("bad.toml"), CAMPAIGN.replace("density = 0.7", "densty = 0.7\ndt = 1.0")).unwrap();
    let output = expect(1, dir, &["run", "bad.toml"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("bad.toml:7") && text.contains("density"), "{text}");
    assert!(fs::read_dir(dir).unwrap().count() == 2, "only the two campaign files");
    assert!(String::from_utf8_lossy(&expect(1, dir, &["run", "nowhere.toml"]).stderr).contains("nowhere.toml"));
}

#[test]
fn failed_jobs_are_rows_with_a_reason_and_end_a_run_with_exit_code_3() {
    let folder = folder();
    let dir = folder.path();
    // So many discs that some arrays are full before they hold them all.
    let crowded = CAMPAIGN.replace("density = 0.7", "density = 2.785");
    fs::write(dir.join("small.toml"), crowded).unwrap();
    expect(3, dir, &["run", "small.toml"]);
    let classes = ask(dir, "small.meniscus", "select distinct error_class from runs where state = 'failed'");
    assert_eq!(classes, "error_class\nbad_input\n");
    let left = ask(dir, "small.meniscus", "select count(*) from runs where state in ('pending', 'running')");
    assert_eq!(left, "count(*)\n0\n");
}

#[test]
fn mistakes_on_the_command_line_are_told() {
    let folder = folder();
    let dir = folder.path();
    let said = |code, arguments: &[&str]| String::from_utf8_lossy(&expect(code, dir, arguments).stderr).into_owned();
    assert!(said(1, &["status"]).contains("no store"));
    assert!(said(1, &["query", "no.meniscus", "select 1"]).contains("no.meniscus"));
    assert!(said(1, &["fit", "no.meniscus"]).contains("no.meniscus"));
    assert!(!dir.join("no.meniscus").exists(), "asking creates nothing");
    assert!(said(2, &["run", "small.toml", "--deadline", "soon"]).contains("8h"));
    assert!(said(2, &["run", "small.toml", "--threads", "0"]).contains("threads"));
    assert!(said(2, &["fly"]).contains("fly"));
}

#[test]
fn a_number_that_differs_in_its_last_digits_from_a_stored_one_is_told_by_plan_and_run() {
    let folder = folder();
    let dir = folder.path();
    let soft = |e_w: &str, more: &str| {
        let text = format!(
            "name = \"twins\"\nmodel = \"SP\"\nscene = \"plate\"\nruns_per_point = 1\n{more}\n[grid]\ne_w = {e_w}\n"
        );
        fs::write(dir.join("twins.toml"), text).unwrap();
    };
    let said = |command: &str| String::from_utf8(expect(0, dir, &[command, "twins.toml"]).stderr).unwrap();
    soft("[0.3, 1.0]", "limits.t_max = 5.0");
    assert!(!said("run").contains("nearly"));
    soft("[0.30000000000000004, 1.0, 1.1]", "limits.t_max = 5.0");
    for command in ["plan", "run"] {
        let text = said(command);
        assert!(text.contains("e_w = 0.30000000000000004 is nearly, but not, 0.3"), "{text}");
        assert_eq!(text.matches("nearly").count(), 1, "{text}");
    }
    assert!(!said("plan").contains("nearly"), "it was told when it was new");
    // A relative: the twins stand in one file, and in a key that is no column of the first schemas.
    soft("[5.0]", "limits.t_max = 5.000000000000001");
    assert!(said("plan").contains("t_max = 5.000000000000001 is nearly, but not, 5,"));
    soft("[7.0, 7.000000000000001, 8.0]", "limits.t_max = 5.0");
    assert!(said("plan").contains("e_w = 7.000000000000001 is nearly, but not, 7,"));
}

#[test]
fn what_is_no_folder_is_refused_as_a_store_with_a_way_out() {
    let folder = folder();
    let dir = folder.path();
    fs::write(dir.join("file"), "text").unwrap();
    std::os::unix::fs::symlink("nowhere", dir.join("dangling")).unwrap();
    let said = |arguments: &[&str]| String::from_utf8(expect(1, dir, arguments).stderr).unwrap();
    let ways: [&[&str]; 7] = [
        &["status"],
        &["check"],
        &["check", "--repair"],
        &["fit"],
        &["render"],
        &["run", "small.toml", "--store"],
        &["plan", "small.toml", "--store"],
    ];
    for way in ways {
        assert!(
            said(&[way, &["file"]].concat()).contains("file is a file, and a store is a folder: name another"),
            "{way:?}"
        );
        let text = said(&[way, &["dangling"]].concat());
        assert!(text.contains("a link to nowhere, which is not there") && text.contains("make that folder"), "{text}");
        let text = said(&[way, &["small.toml"]].concat());
        assert!(text.contains("small.toml is a campaign file") && text.contains("NAME.meniscus"), "{text}");
    }
    assert!(!dir.join("nowhere").exists(), "asking makes nothing");
    assert_eq!(fs::read_to_string(dir.join("file")).unwrap(), "text");
}

#[test]
fn a_channel_has_mean_speeds_and_no_decay_length() {
    let folder = folder();
    let dir = folder.path();
    let text = "name = \"channel\"\nmodel = \"SP\"\nscene = \"channel\"\nw = 1.2\ne_w = 10.0\nh_start = -1.0\n\
                runs_per_point = 2\nlimits.t_max = 200.0\n";
    fs::write(dir.join("channel.toml"), text).unwrap();
    let tables = String::from_utf8(expect(0, dir, &["run", "channel.toml"]).stdout).unwrap();
    assert!(tables.contains("Decay lengths: none") && tables.contains("Mean speeds, SP in channels"), "{tables}");
    assert!(!tables.contains("lambda"), "{tables}");
    assert_eq!(
        ask(dir, "channel.meniscus", "select count(lambda), count(lambda_low) from lambda_fits").lines().last(),
        Some("0,0")
    );
}

#[test]
fn thresholds_are_a_table_rows_and_a_plot_of_what_can_pass_and_need_no_store() {
    let folder = folder();
    let dir = folder.path();
    let campaign = |scene: &str| {
        let text = format!("name = \"narrow\"\nmodel = \"DP\"\ndynamics = \"vertex\"\nruns_per_point = 1\n{scene}");
        fs::write(dir.join("narrow.toml"), text).unwrap();
    };
    campaign("scene = \"channel\"\n[grid]\nw = [0.4, 0.7]\ngamma = [0.1, 0.5, 3.0]\n");
    let arguments = ["threshold", "narrow.toml", "--format", "csv", "-o", "narrow.svg"];
    let rows = String::from_utf8(expect(0, dir, &arguments).stdout).unwrap();
    let passes: Vec<&str> = rows.lines().skip(1).filter_map(|row| row.rsplit(',').next()).collect();
    assert_eq!(passes, ["1", "0", "0", "1", "1", "0"], "{rows}");
    let plot = fs::read_to_string(dir.join("narrow.svg")).unwrap();
    assert_eq!((plot.matches("class=\"curve\"").count(), plot.matches("class=\"steepest\"").count()), (4, 4));
    assert!(String::from_utf8(expect(0, dir, &["threshold", "narrow.toml"]).stdout).unwrap().contains("Gamma_c"));
    let refusal = |arguments: &[&str]| String::from_utf8(expect(1, dir, arguments).stderr).unwrap();
    assert!(refusal(&["threshold", "narrow.toml", "-o", "narrow.gif"]).contains(".svg or .png"));
    campaign("scene = \"plate\"\ngamma = 1.0\n");
    let refused = refusal(&["threshold", "narrow.toml"]);
    assert!(refused.contains("`narrow`") && refused.contains("channel_profiles.toml"), "{refused}");
    assert!(!dir.join("narrow.meniscus").exists());
}

#[test]
fn accuracy_says_first_how_long_it_takes() {
    let folder = folder();
    let dir = folder.path();
    let text = "name = \"small\"\nmodel = \"SP\"\nscene = \"plate\"\ne_w = 1.0\nruns_per_point = 1\nlimits.t_max = 5.0\n\
                [[block]]\nname = \"free.dt\"\n";
    fs::write(dir.join("accuracy.toml"), text).unwrap();
    let output = meniscus(dir, &["accuracy", "accuracy.toml", "--threads", "1"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("1 runs, about ") && said.contains(" on 1 threads"), "{said}");
}

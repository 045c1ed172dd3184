//! Runs until an interval is narrow enough.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{ask, expect, meniscus, results};
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

/// Hard points clog soon, soft ones hardly ever; both to a half-width of 30%.
const CAMPAIGN: &str = r#"
name = "rounds"
about = "seeds are added until lambda is known to a third"
model = "SP"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.7
box_size = 20.0
runs_per_point = 8
until = { relative_error = 0.3, max_runs = 100 }
limits = { t_max = 2000.0, distance = 30.0 }
grid = { e_w = [0.3, 3.0, 30.0] }
"#;

const COUNTS: &str = "select e_w, count(*), min(seed), max(seed), sum(state = 'done') from runs group by 1";

fn run(dir: &Path, store: &str, threads: &str) {
    expect(0, dir, &["run", "rounds.toml", "--store", store, "--threads", threads, "--quiet"]);
}

#[test]
fn seeds_are_added_in_doubling_rounds_until_the_interval_is_narrow_or_there_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("rounds.toml"), CAMPAIGN).unwrap();
    run(dir, "whole", "2");
    expect(0, dir, &["fit", "whole"]);
    let widths = ask(dir, "whole", "select e_w, runs, lambda, lambda_low, lambda_high from lambda_fits order by e_w");
    for line in widths.lines().skip(1) {
        let cells: Vec<Option<f64>> = line.split(',').map(|cell| cell.parse().ok()).collect();
        let runs = cells[1].unwrap();
        assert!([8.0, 16.0, 32.0, 64.0, 100.0].contains(&runs), "{widths}");
        let narrow = match cells[2..] {
            [Some(lambda), Some(low), Some(high)] => 0.5 * (high - low) / lambda <= 0.3,
            _ => false,
        };
        assert!(narrow || runs == 100.0, "{widths}");
    }
    // More than one number of rounds was needed, or nothing was decided.
    assert!(widths.lines().skip(1).any(|line| !line.contains(",100,")), "{widths}");

    // One thread, killed twice on the way: the same seeds, the same results.
    for pause in [300, 700] {
        let mut command = meniscus(dir, &["run", "rounds.toml", "--store", "cut", "--threads", "1", "--quiet"]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(pause));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    run(dir, "cut", "1");
    assert_eq!(ask(dir, "cut", COUNTS), ask(dir, "whole", COUNTS));
    assert_eq!(results(dir, "cut"), results(dir, "whole"));
    let blocks = ask(dir, "whole", "select distinct block from runs");
    assert_eq!(blocks, "block\nrounds\n", "a block keeps its name however many rounds it has");

    // A better answer costs the further rounds alone.
    fs::write(dir.join("rounds.toml"), CAMPAIGN.replace("relative_error = 0.3", "relative_error = 0.2")).unwrap();
    let before = ask(dir, "whole", "select job_id, attempts from runs order by 1");
    run(dir, "whole", "2");
    let after = ask(dir, "whole", "select job_id, attempts from runs order by 1");
    assert!(after.lines().count() >= before.lines().count());
    assert!(before.lines().all(|line| after.contains(line)), "no run was repeated");
}

//! What the tests of the whole program share: a small campaign, the program, and what a store answers.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]
#![allow(dead_code, reason = "every test file uses its part")]

use std::path::Path;
use std::process::{Command, Output};

/// Both models, clogs, flows and time limits, in a few seconds.
pub const CAMPAIGN: &str = r#"
name = "small"
about = "both models, clogs, flows and time limits"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.7
box_size = 20.0
runs_per_point = 4
sample_every = 2.0

[limits]
t_max = 400.0
distance = 6.0

[[block]]
name = "deformable"
model = "DP"
dynamics = "vertex"
n_vertices = 44
integrator = "verlet"
grid = { gamma = [0.3, 1.0] }

[[block]]
name = "soft"
model = "SP"
runs_per_point = 8
grid = { e_w = [1.0, 30.0] }
"#;

/// The program, in the folder `dir`.
pub fn meniscus(dir: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_meniscus"));
    command.args(arguments).current_dir(dir);
    command
}

/// Runs the program and expects an exit code.
pub fn expect(code: i32, dir: &Path, arguments: &[&str]) -> Output {
    let output = meniscus(dir, arguments).output().unwrap();
    let text = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "meniscus {arguments:?} said:\n{text}");
    output
}

/// What a store answers, as CSV.
pub fn ask(dir: &Path, store: &str, sql: &str) -> String {
    String::from_utf8(expect(0, dir, &["query", store, sql, "--format", "csv"]).stdout).unwrap()
}

/// All that a run decides: outcomes, clogs and samples, but not wall times and attempts.
pub fn results(dir: &Path, store: &str) -> [String; 3] {
    [
        "select job_id, model, gamma, e_w, density, dt, seed, state, outcome, r_end, t_end, v_g_mean, ek_ratio_end, \
         shape_max, area_error_max, overlap_max, steps, error_class, error from runs order by job_id",
        "select * from clog_events order by job_id",
        "select * from samples order by job_id, t",
    ]
    .map(|sql| ask(dir, store, sql))
}

//! What accuracy costs: the command, what it makes of runs, and the tolerance that reads its table.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{ask, expect};
use meniscus::campaign::choose::tolerance::{Kind, Table, table};
use meniscus::campaign::file::Campaign;
use meniscus::parameters::PointId;
use meniscus::results::fits::RunRecord;
use meniscus::results::trajectory::{Outcome, Samples};
use meniscus::study::accuracy::{Accuracy, judge};
use std::collections::HashMap;
use std::fs;

/// A free droplet and a passage on coarse rings, in a few seconds.
const SMALL: &str = r#"
name = "small"
about = "what accuracy costs, on coarse rings"
model = "DP"
dynamics = "vertex"
runs_per_point = 1
limits = { t_max = 500.0 }

[[block]]
name = "free.dt"
scene = "disc"
sigma_ob = 0.3
offset = 50.0
gamma = 1.0
n_vertices = 32
sample_every = 0.1
limits = { t_max = 2.0 }
grid = { dt = [2e-3, 1e-3, 5e-4] }

[[block]]
name = "passage.n_vertices"
scene = "channel"
w = 0.8
gamma = 0.4
v_t = 0.08
h_start = -1.2
h_end = 1.2
sample_every = 0.16
grid = { n_vertices = [32, 64, 128] }

[[block]]
name = "passage.settings"
scene = "channel"
w = 0.8
gamma = 0.4
v_t = 0.08
h_start = -1.2
h_end = 1.2
sample_every = 0.16
integrator = "implicit"
dt = 0.01
grid = { n_vertices = [32, 64] }
"#;

#[test]
fn one_command_measures_shows_and_records_and_the_next_computes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("small.toml"), SMALL).unwrap();
    let first = expect(0, dir, &["accuracy", "small.toml"]);
    let written = ["accuracy", "small.toml", "--markdown", "page.md", "--record", "table.toml", "--plot", "more.svg"];
    let second = expect(0, dir, &written);
    assert_eq!(first.stdout, second.stdout, "the same runs give the same tables");
    assert!(!String::from_utf8_lossy(&second.stderr).contains("jobs to run"));
    assert_eq!(ask(dir, "small.meniscus", "select sum(attempts) from runs"), "sum(attempts)\n8\n");

    let tables = String::from_utf8(first.stdout).unwrap();
    for part in
        ["free, dt of verlet alone", "passage, n_vertices alone", "A_max - 1", "order", "Error against time, passage"]
    {
        assert!(tables.contains(part), "{part} is not in\n{tables}");
    }
    let page = fs::read_to_string(dir.join("page.md")).unwrap();
    assert!(page.contains("page.svg") && page.contains("commit") && page.contains("\\*"), "{page}");
    let svg = fs::read_to_string(dir.join("page.svg")).unwrap();
    assert_eq!(svg, fs::read_to_string(dir.join("more.svg")).unwrap());
    let document = roxmltree::Document::parse(&svg).unwrap();
    let settings = document.descendants().filter(|node| node.attribute("class") == Some("setting")).count();
    assert_eq!(settings, 5, "every setting of the passage is drawn");
    assert!(fs::read(dir.join("page.png")).unwrap().starts_with(b"\x89PNG"));

    let recorded: Table = toml::from_str(&fs::read_to_string(dir.join("table.toml")).unwrap()).unwrap();
    assert_eq!(recorded.kinds[&Kind::Channel].settings.len(), 5);
}

#[test]
fn a_block_of_another_name_and_a_picture_of_another_kind_are_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    for (name, said) in [("pond.dt", "free, channel"), ("free.depth", "n_vertices, dt")] {
        fs::write(dir.join("odd.toml"), SMALL.replace("free.dt", name)).unwrap();
        let error = expect(1, dir, &["accuracy", "odd.toml"]).stderr;
        let error = String::from_utf8_lossy(&error);
        assert!(error.contains(name) && error.contains(said), "{error}");
    }
    fs::write(dir.join("small.toml"), SMALL).unwrap();
    let error = expect(1, dir, &["accuracy", "small.toml", "--plot", "front.jpg"]).stderr;
    assert!(String::from_utf8_lossy(&error).contains("front.jpg"));
    assert!(!dir.join("small.meniscus").exists());
}

/// An array campaign over N_v, and what made-up runs say of it.
fn judged(block: &str, run: impl Fn(usize, u64) -> RunRecord) -> Accuracy {
    let text = format!(
        "name = \"made_up\"\nmodel = \"DP\"\ndynamics = \"vertex\"\nscene = \"obstacles\"\ngamma = 1.0\nw_ob = 1.0\nsigma_ob = 0.3\n\
         density = 0.3\nruns_per_point = 6\n[[block]]\nname = \"{block}\"\nintegrator = \"verlet\"\n\
         grid = {{ n_vertices = [64, 128, 256, 512] }}"
    );
    let campaign = Campaign::parse("made_up.toml", &text).unwrap_or_else(|errors| panic!("{}", errors.render(false)));
    let runs: HashMap<PointId, Vec<RunRecord>> = [64, 128, 256, 512]
        .into_iter()
        .zip(&campaign.blocks[0].point_ids)
        .map(|(n, &id)| (id, (0..6).map(|seed| run(n, seed)).collect()))
        .collect();
    judge(&campaign, &runs).unwrap()
}

fn flowing(n: usize, seed: u64, v_g: f64) -> RunRecord {
    RunRecord {
        seed,
        outcome: Some(Outcome::Distance),
        v_g_mean: Some(v_g),
        r_end: 10.0,
        t_end: 100.0,
        // The time of a step grows as N_v does.
        wall_s: 1e-3 * n as f64,
        samples: Samples::default(),
        ..RunRecord::default()
    }
}

#[test]
fn the_spread_of_arrays_does_not_hide_the_error_of_a_ring() {
    // Arrays differ by a fifth, rings by 1/N_v^2 alone.
    let accuracy =
        judged("flow.n_vertices", |n, seed| flowing(n, seed, 0.7 + 0.05 * seed as f64 - 100.0 / (n * n) as f64));
    let column = &accuracy.ladders[0].columns[0];
    let (order, left) = (column.order.unwrap(), column.left_over.unwrap());
    assert!((order.p - 2.0).abs() < 1e-6 && order.is_clear());
    assert!((left * 0.825 - 100.0 / (512.0 * 512.0)).abs() < 1e-6, "{left}");
    let coarse = column.errors[0].unwrap();
    assert!(coarse.size > 0.02 && coarse.spread < 0.1 * coarse.size, "{coarse:?}");
    assert!(accuracy.ladders[0].rungs[0].statistical(column.observable).unwrap() > 0.03);
    assert!(accuracy.fronts[0].spots.iter().all(|spot| spot.on_front), "finer is slower and better");
    let recorded = accuracy.table(String::new());
    let errors: Vec<f64> = recorded.kinds[&Kind::Flow].settings.iter().map(|setting| setting.error).collect();
    assert!(errors.is_sorted_by(|a, b| a > b) && errors.len() == 4, "{errors:?}");
}

#[test]
fn what_is_slower_and_worse_is_not_on_the_front() {
    let speed = |n: usize| if n == 128 { 0.5 } else { 0.7 - 1.0 / n as f64 };
    let accuracy = judged("flow.n_vertices", |n, seed| flowing(n, seed, speed(n)));
    let on: Vec<(usize, bool)> = accuracy.fronts[0].spots.iter().map(|spot| (spot.setting.0, spot.on_front)).collect();
    assert_eq!(on, [(64, true), (128, false), (256, true), (512, true)]);
}

#[test]
fn lambda_is_known_no_better_than_so_few_arrays_can_tell() {
    let clogged =
        |n: usize, seed: u64, r_end: f64| RunRecord { outcome: Some(Outcome::Clogged), r_end, ..flowing(n, seed, 0.1) };
    let errors = |run: &dyn Fn(usize, u64) -> f64| -> Vec<f64> {
        let accuracy = judged("clog.n_vertices", |n, seed| clogged(n, seed, run(n, seed)));
        let recorded = accuracy.table(String::new());
        recorded.kinds[&Kind::Clog].settings.iter().map(|setting| setting.error).collect()
    };
    // Six droplets clog in the same places at every setting. Of six others three may not, here and on still finer
    // rings.
    let alike = errors(&|_, seed| 5.0 + seed as f64);
    assert!(alike[..3].iter().all(|error| (1.0..1.01).contains(error)), "{alike:?}");
    assert!((0.5..0.51).contains(&alike[3]), "the finest ring is what the others are held against");
    let one_differs = errors(&|n, seed| if (n, seed) == (64, 0) { 20.0 } else { 5.0 + seed as f64 });
    assert!(one_differs[0] > alike[0] + 0.2, "{one_differs:?}");
}

#[test]
fn a_droplet_that_is_stuck_has_no_error_and_says_so() {
    let accuracy =
        judged("channel.n_vertices", |n, seed| RunRecord { outcome: Some(Outcome::Clogged), ..flowing(n, seed, 0.1) });
    assert!(
        accuracy.fronts[0].spots.iter().all(|spot| spot.error.is_none() && !spot.on_front && spot.excuse == "stuck")
    );
    assert!(meniscus::report::accuracy::text(&accuracy).contains("stuck"));
}

fn with_tolerance(keys: &str) -> Result<Campaign, String> {
    let text = format!(
        "name = \"c\"\nmodel = \"DP\"\ndynamics = \"vertex\"\nscene = \"obstacles\"\ngamma = 1.0\nw_ob = 0.2\nsigma_ob = 0.3\ndensity = 0.39\n\
         runs_per_point = 2\nlimits.distance = 20.0\n{keys}"
    );
    Campaign::parse("c.toml", &text).map_err(|errors| errors.render(false))
}

#[test]
fn a_job_that_a_tolerance_chose_is_the_job_that_gives_its_setting() {
    let settings = &table().kinds[&Kind::Clog].settings;
    // No campaign may ask for less than one digit.
    for setting in settings.iter().filter(|setting| setting.error <= 0.5) {
        let chosen = with_tolerance(&format!("tolerance = {}", setting.error)).unwrap();
        let point = &chosen.blocks[0].points[0];
        let meniscus::parameters::Model::Deformable(ring) = &point.model else { panic!("a ring") };
        let keys = format!(
            "n_vertices = {}\nintegrator = \"{}\"\ndt = {}",
            ring.n_vertices,
            point.stepping.integrator.name(),
            point.stepping.dt
        );
        assert_eq!(chosen.blocks[0].point_ids, with_tolerance(&keys).unwrap().blocks[0].point_ids);
    }
}

#[test]
fn a_tolerance_finer_than_anything_measured_is_refused_with_the_finest() {
    let finest = table().kinds[&Kind::Clog].settings.iter().map(|setting| setting.error).fold(1.0, f64::min);
    let error = with_tolerance("tolerance = 1e-9").unwrap_err();
    assert!(
        error.contains("c.toml:11") && error.contains("the finest setting measured in arrays that clog"),
        "{error}"
    );
    assert!(error.contains(&format!("off by {}", meniscus::parameters::Short(finest))), "{error}");
    with_tolerance(&format!("tolerance = {finest}")).unwrap();
}

#[test]
fn the_plan_says_which_setting_a_tolerance_chose_and_what_it_saves() {
    use meniscus::campaign::plan::{KnownJobs, Speed, plan};
    let settings = &table().kinds[&Kind::Clog].settings;
    let worst = settings.iter().map(|setting| setting.error).fold(0.0, f64::max);
    let campaign = with_tolerance(&format!("tolerance = {}", worst.min(0.5))).unwrap();
    let text = plan(&campaign, &KnownJobs::default(), &Speed::default()).render(1);
    for part in ["for tolerance", "the cheapest measured in arrays that clog", "off by", "default"] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
}

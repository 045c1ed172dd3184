//! A campaign with a larger time limit or distance goes on from where the runs of the smaller one ended.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use meniscus::campaign::file::Campaign;
use meniscus::execute::{self, Event, Options, RunReport};
use meniscus::store::{Format, check, query};
use std::path::Path;

/// A campaign of both models; one run of each point is cut off in the midst of two checks.
fn campaign(name: &str, limits: &str) -> Campaign {
    let text = format!(
        "name = \"{name}\"\nscene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\ndensity = 0.7\nbox_size = 30.0\n\
         sample_every = 2.0\nshapes_every = 7.0\nruns_per_point = 4\nlimits = {{ {limits} }}\n\
         [[block]]\nname = \"soft\"\nmodel = \"SP\"\ne_w = 10.0\n\
         [[block]]\nname = \"ring\"\nmodel = \"DP\"\ndynamics = \"vertex\"\ngamma = 1.09\nn_vertices = 32\n"
    );
    Campaign::parse("longer.toml", &text).unwrap_or_else(|errors| panic!("{}", errors.render(false)))
}

/// Runs it to its end; returns how many jobs it ran, and how many of them went on from somewhere.
fn run(dir: &Path, campaign: &Campaign) -> (usize, usize) {
    let mut begun = (0, 0);
    let options = Options { threads: 2, ..Options::default() };
    let watch = |event: Event<'_>| {
        if let Event::RoundBegins { jobs, resumed, .. } = event {
            begun = (jobs, resumed);
        }
    };
    let report = execute::run(campaign, dir, &options, watch).unwrap();
    assert!(matches!(report, RunReport::Complete { failed: 0, .. }), "{report:?}");
    begun
}

fn ask(dir: &Path, sql: &str) -> String {
    let mut out = Vec::new();
    query(dir, sql, Format::Csv, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

/// All results of the points with this time limit.
fn results(dir: &Path, t_max: f64) -> Vec<String> {
    let of_points = format!("job_id in (select job_id from runs where t_max = {t_max})");
    [
        "select job_id, outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max, area_error_max, overlap_max, steps from runs",
        "select * from clog_events",
        "select * from arrest_events",
        "select * from pinch_events",
        "select * from samples",
        "select * from outline",
        "select * from stability",
    ]
    .map(|select| ask(dir, &format!("{select} where {of_points} order by 1, 2, 3, 4")))
    .to_vec()
}

#[test]
fn larger_limits_go_on_from_where_runs_ended_and_give_the_same_bits() {
    let (grown, whole) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert_eq!(run(grown.path(), &campaign("short", "t_max = 40.5, distance = 1.0")), (8, 0));
    let shorter = results(grown.path(), 40.5);
    let larger = campaign("long", "t_max = 2000.0, distance = 4.0");
    assert_eq!(run(grown.path(), &larger), (8, 8), "all go on");
    assert_eq!(run(whole.path(), &larger), (8, 0));
    assert_eq!(results(grown.path(), 2000.0), results(whole.path(), 2000.0));
    assert_eq!(results(grown.path(), 40.5), shorter, "what was there stays as it was");
    assert_eq!(check(grown.path()).unwrap().findings, []);
    let ends = ask(grown.path(), "select count(distinct outcome) > 1, count(*) from runs where t_max = 2000.0");
    assert_eq!(ends.lines().last(), Some("1,8"), "some clog and some do not");

    // A smaller limit again: an end state that lies behind it is of no use.
    let least = campaign("least", "t_max = 20.0, distance = 4.0");
    run(grown.path(), &least);
    run(whole.path(), &least);
    assert_eq!(results(grown.path(), 20.0), results(whole.path(), 20.0));
}

#[test]
fn a_damaged_end_state_is_not_taken_up() {
    let (grown, whole) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(grown.path(), &campaign("short", "t_max = 40.5"));
    let conn = rusqlite::Connection::open(grown.path().join("store.db")).unwrap();
    conn.execute("UPDATE end_states SET state = substr(state, 1, length(state) - 1) || x'77'", []).unwrap();
    drop(conn);
    std::fs::remove_file(grown.path().join("store.db.seal")).unwrap();
    let larger = campaign("long", "t_max = 90.0");
    run(grown.path(), &larger);
    run(whole.path(), &larger);
    assert_eq!(results(grown.path(), 90.0), results(whole.path(), 90.0));
}

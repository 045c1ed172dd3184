//! Laws of the planner.

use crate::campaign::file::Campaign;
use crate::campaign::plan::{Counts, KnownJobs, Plan, Speed, plan};
use crate::parameters::{JobId, JobState};
use proptest::prelude::*;
use std::collections::BTreeSet;

const SPEED: Speed =
    Speed { deformable_ns_per_vertex_step: 2.0, implicit_ns_per_vertex_newton: 30.0, soft_ns_per_step: 50.0 };

fn campaign(body: &str) -> Campaign {
    let head = "name = \"c\"\nscene = \"obstacles\"\nsigma_ob = 0.3\ndensity = 0.35\n";
    Campaign::parse("c.toml", &format!("{head}{body}")).unwrap_or_else(|errors| panic!("{errors}"))
}

fn soft(runs: u64, e_w: &str) -> Campaign {
    campaign(&format!("model = \"SP\"\nw_ob = 0.2\nruns_per_point = {runs}\ngrid = {{ e_w = {e_w} }}"))
}

fn fresh(campaign: &Campaign) -> Plan {
    plan(campaign, &KnownJobs::default(), &SPEED)
}

fn ids(plan: &Plan) -> BTreeSet<JobId> {
    plan.jobs.iter().map(|job| job.id).collect()
}

fn known(plan: &Plan, state: impl Fn(usize) -> JobState) -> KnownJobs {
    KnownJobs::new(plan.jobs.iter().enumerate().map(|(index, job)| (job.id, state(index))).collect())
}

proptest! {
    #[test]
    fn more_values_and_more_runs_only_add_jobs(
        values in prop::collection::btree_set(1_u32..40, 1..6),
        more_values in prop::collection::btree_set(1_u32..40, 0..6),
        runs in 1_u64..9,
        more_runs in 0_u64..9,
    ) {
        let small = fresh(&soft(runs, &list(&values)));
        let union: BTreeSet<u32> = values.union(&more_values).copied().collect();
        let large = soft(runs + more_runs, &list(&union));
        let done = known(&small, |_| JobState::Done);
        let next = plan(&large, &done, &SPEED);
        prop_assert_eq!(next.blocks[0].counts.done, small.jobs.len() as u64);
        prop_assert!(ids(&next).is_disjoint(&ids(&small)));
        prop_assert_eq!(next.jobs.len() + small.jobs.len(), union.len() * (runs + more_runs) as usize);
    }

    #[test]
    fn a_longer_logarithmic_range_only_adds_jobs(per_decade in 1_u32..12, decades in 1_u32..3) {
        let range = |decades: u32| {
            let points = per_decade * decades + 1;
            format!("{{ from = 0.1, to = 1e{}, points = {points}, scale = \"log\" }}", i64::from(decades) - 1)
        };
        let small = ids(&fresh(&soft(2, &range(decades))));
        let large = ids(&fresh(&soft(2, &range(decades + 1))));
        prop_assert!(small.is_subset(&large) && small.len() < large.len());
    }
}

fn list(values: &BTreeSet<u32>) -> String {
    format!("{:?}", values.iter().collect::<Vec<_>>())
}

#[test]
fn every_state_is_counted_and_only_new_and_pending_jobs_are_run() {
    let all = fresh(&soft(10, "[1.0, 2.0]"));
    let states = [JobState::Done, JobState::Failed, JobState::Pending, JobState::Running];
    let known = KnownJobs::new(
        known(&all, |index| states[index % 4]).0.into_iter().filter(|(id, _)| *id != all.jobs[0].id).collect(),
    );
    let next = plan(&soft(10, "[1.0, 2.0]"), &known, &SPEED);
    let expected = Counts { new: 1, pending: 5, running: 5, done: 4, failed: 5, ..Counts::default() };
    assert_eq!(next.blocks[0].counts, expected);
    assert_eq!((next.jobs.len() as u64, expected.new + expected.pending), (6, 6));
}

#[test]
fn failed_jobs_run_again_only_when_the_store_has_set_them_back_to_pending() {
    let campaign = soft(4, "[1.0]");
    let all = fresh(&campaign);
    for retried in [0, 1, 4] {
        let state = |index| if index < retried { JobState::Pending } else { JobState::Failed };
        let next = plan(&campaign, &known(&all, state), &SPEED);
        let counts = next.blocks[0].counts;
        assert_eq!((next.jobs.len(), counts.pending, counts.failed), (retried, retried as u64, 4 - retried as u64));
    }
}

#[test]
fn a_job_that_two_blocks_name_is_planned_once_and_counts_in_the_first() {
    let blocks = "model = \"SP\"\nw_ob = 0.2\nruns_per_point = 3\n[[block]]\nname = \"a\"\ngrid = { e_w = [1.0, 2.0] }\n\
                  [[block]]\nname = \"b\"\ne_w = 2.0\nruns_per_point = 5";
    let plan = fresh(&campaign(blocks));
    assert_eq!((plan.jobs.len(), ids(&plan).len()), (8, 8));
    assert_eq!((plan.blocks[0].counts.new, plan.blocks[1].counts.new, plan.blocks[1].counts.shared), (6, 2, 3));
}

#[test]
fn the_longest_jobs_come_first_and_equal_ones_by_seed() {
    let body = "model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 1.0\nruns_per_point = 3\n[grid]\ngamma = [0.3, 1.0]\nn_vertices = [64, 128]";
    let plan = fresh(&campaign(body));
    assert!(plan.jobs.is_sorted_by(|a, b| a.expected_s >= b.expected_s));
    let seeds: Vec<u64> = plan.jobs.iter().map(|job| job.job.seed).collect();
    assert_eq!(seeds, [0, 0, 1, 1, 2, 2, 0, 0, 1, 1, 2, 2]);
    assert!(plan.jobs.iter().all(|planned| planned.job.id() == planned.id));
}

#[test]
fn cost_is_steps_times_the_measured_speed() {
    let body = "model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 1.0\nruns_per_point = 4\ngamma = 1.0\ndt = 1e-3\nlimits.distance = 24.0";
    let plan = fresh(&campaign(body));
    // 24/(0.8 * 0.03) = 1000 t0 are 1e6 steps of 256 vertices at 3 * 2 ns each.
    assert!((plan.jobs[0].expected_s - 1.536).abs() < 1e-9);
    let cost = plan.blocks[0].cost;
    assert!(cost.by_distance && (cost.total_s - 6.144).abs() < 1e-9 && (cost.wall_s(2) - 3.072).abs() < 1e-9);
    assert!((cost.wall_s(64) - 1.536).abs() < 1e-9);
}

#[test]
fn without_a_distance_droplets_that_do_not_clog_cost_what_t_max_lets_them() {
    let plan =
        fresh(&campaign("model = \"SP\"\nw_ob = 1.0\nruns_per_point = 1\ne_w = 1.0\ndt = 1e-3\nlimits.t_max = 1e3"));
    assert!((plan.jobs[0].expected_s - 0.035).abs() < 1e-12);
    assert!(plan.render(2).contains("about 35 ms of CPU"));
}

#[test]
fn the_text_tells_what_acts_and_what_does_not_and_why() {
    let body = "model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 0.2\nruns_per_point = 2\n[grid]\ngamma = [0.3, 10.0]\nkappa = [0.0, 1e-3]";
    let text = fresh(&campaign(body)).render(2);
    for part in [
        "DP in obstacles, 4 points x 2 runs = 8 jobs",
        "8 new, 0 pending, 0 done, 0 failed",
        "0.125 between two looks at the droplet",
        "its step bound by tension",
        "tension (gamma = 0.3 .. 10)",
        "perimeter (kappa = 0 .. 0.001 in 2 of 4 points, else 0)",
        "near_wall_drag (b0 = 0: no distance is computed)",
    ] {
        assert!(text.contains(part), "{part} is not in\n{text}");
    }
    let soft = fresh(&soft(1, "[1.0]")).render(2);
    assert!(soft.contains("off      tension (SP has no ring)"), "{soft}");
}

#[test]
fn the_text_says_which_integrator_takes_what_and_why() {
    let body = |keys: &str| format!("model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 0.2\nruns_per_point = 1\n{keys}");
    for (keys, line) in [
        ("gamma = 1.0", "adaptive the cheaper one: verlet, its step bound by"),
        ("gamma = 0.1", "adaptive the cheaper one: verlet, its step bound by"),
        ("gamma = 1.0\nv_t = 3.0", "verlet   the cheaper one: adaptive would cost"),
        ("gamma = 1.0\nwall = \"per_vertex\"", "adaptive the cheaper one: verlet, its step bound by wall, would cost"),
        (
            "gamma = 1.0\ngrid = { v_t = [0.03, 2.0] }",
            "adaptive at 1 of 2 points: the cheaper one: verlet, its step bound by tension, would cost",
        ),
        ("gamma = 0.03", "adaptive the cheaper one: verlet, its step bound by self-contact, would cost 1."),
        ("gamma = 0.1\nb0 = 0.2", "verlet   near-wall drag presses folds together, which may cross in long steps"),
        ("gamma = 1.0\nintegrator = \"implicit\"", "implicit asked for"),
        ("gamma = 0.1\nintegrator = \"adaptive\"", "adaptive asked for; steps follow their error"),
        ("gamma = 1.0\nn_vertices = 2048\ndt = 1e-4", "verlet   dt is given, and no other integrator asked for"),
    ] {
        let text = fresh(&campaign(&body(keys))).render(2);
        assert!(text.contains(line), "{line} is not in\n{text}");
    }
    assert!(fresh(&soft(1, "[1.0]")).render(2).contains("verlet   that of SP where none is asked for"));
}

#[test]
fn a_job_is_the_same_whether_its_integrator_was_chosen_or_asked_for() {
    let points = |keys: &str| {
        let body = format!(
            "model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 0.2\nruns_per_point = 1\n{keys}\ngrid = {{ gamma = [0.1, 1.0, 10.0] }}"
        );
        campaign(&body).blocks[0].point_ids.clone()
    };
    let [chosen, verlet, adaptive] = ["", "integrator = \"verlet\"", "integrator = \"adaptive\""].map(points);
    assert_eq!(chosen, points("integrator = \"auto\""));
    assert_eq!(chosen, adaptive);
    assert!((0..3).all(|k| verlet[k] != adaptive[k]));
}

#[test]
fn known_jobs_may_come_in_any_order() {
    let campaign = soft(20, "[1.0]");
    let mut done: Vec<_> = fresh(&campaign).jobs.iter().map(|job| (job.id, JobState::Done)).collect();
    done.sort_by_key(|job| std::cmp::Reverse(job.0));
    done.push(done[0]);
    assert!(plan(&campaign, &KnownJobs::new(done), &SPEED).jobs.is_empty());
}

#[test]
fn a_plan_names_the_limits_the_box_and_every_switch_inside_a_grid() {
    let text = fresh(&campaign(
        "model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 0.2\nbox_size = 60.0\nruns_per_point = 2\nlimits = { t_max = 5e4, distance = 30.0 }
         grid = { gamma = [0.05, 0.1, 0.3, 1.0], v_t = [0.01, 0.03] }",
    ))
    .render(2);
    let limits = "  limits   t_max = 5e4, distance = 30, ek_threshold = 1e-17, box_size = 60\n";
    assert!(text.contains(limits), "{text}");
    let kappa = text.lines().find(|line| line.starts_with("  switch   kappa = ")).unwrap_or_else(|| panic!("{text}"));
    assert!(kappa.contains("0.318 at gamma = 0.05 .. 0.1") && kappa.contains("0.001 at gamma = 0.3 .. 1"), "{kappa}");
    assert!(!kappa.contains("v_t"), "what does not tell the places apart is not named: {kappa}");
    assert!(!text.contains("switch   integrator"), "{text}");
    let fixed = fresh(&campaign(
        "model = \"DP\"\ndynamics = \"vertex\"\nw_ob = 0.2\nruns_per_point = 2\nintegrator = \"verlet\"\ngrid = { gamma = [0.05, 1.0], kappa = [0.1, 0.2] }",
    ));
    assert!(!fixed.render(2).contains("switch"), "what the file gives is no switch");
    assert!(fixed.render(2).contains("distance = none"));
}

#[test]
fn a_plan_tells_the_rounds_of_until_and_their_largest_cost() {
    let text = |max_runs: u64, estimate: &str| {
        let until = format!("until = {{ relative_error = 0.1, max_runs = {max_runs}, estimate = \"{estimate}\" }}");
        let body = format!("model = \"SP\"\nw_ob = 1.0\nruns_per_point = 10\n{until}\ngrid = {{ e_w = [1.0, 2.0] }}");
        fresh(&campaign(&body)).render(2)
    };
    // 2e5 t0 in steps of 0.001, at 0.7 * 50 ns a step, are 7 s a job.
    let rounds = "rounds   10, 20, 40, ... up to 400 runs a point, until half of the interval of lambda is 10% of it; \
                  about 1 h 33 min of CPU if all points need all runs";
    assert!(text(400, "lambda").contains(rounds), "{}", text(400, "lambda"));
    assert!(text(20, "v_g").contains("rounds   10, ... up to 20 runs a point, until half of the interval of v_g"));
}

#[test]
fn a_way_beyond_the_box_is_warned_of() {
    let plan = |limits: &str| {
        let body = format!(
            "model = \"SP\"\nw_ob = 0.2\nbox_size = 60.0\nruns_per_point = 1\ngrid.e_w = [1.0, 2.0]\nlimits = {{ {limits} }}"
        );
        fresh(&campaign(&body))
    };
    for (limits, way) in [
        ("distance = 60.0", None),
        ("t_max = 2e3", None),
        ("distance = 61.0", Some(61.0)),
        ("t_max = 1e5", Some(3000.0)),
    ] {
        let plan = plan(limits);
        assert_eq!(plan.blocks[0].repeats.map(|repeats| repeats.way), way, "{limits}");
        let text = plan.render(1);
        assert_eq!(text.contains("meets the same obstacles again after box_size = 60"), way.is_some(), "{text}");
    }
}

#[test]
fn a_time_limit_that_leaves_no_time_to_come_to_rest_is_warned_of() {
    let limits = |limits: &str| {
        fresh(&campaign(&format!("model = \"SP\"\nw_ob = 0.2\ne_w = 1.0\nruns_per_point = 1\nlimits = {{ {limits} }}")))
    };
    let warned = |text: &str| {
        let plan = limits(text);
        assert_eq!(plan.render(1).contains("warning  t_max"), plan.blocks[0].short_time.is_some(), "{text}");
        plan.blocks[0].short_time
    };
    // 50 sigma at 0.7 V_t and 45 sigma of free fall, at V_t = 0.03.
    let needed = (50.0 / 0.7 + 45.0) / 0.03;
    assert_eq!(warned(&format!("distance = 50.0, t_max = {}", needed + 1.0)), None);
    let short = warned(&format!("distance = 50.0, t_max = {}", needed - 1.0)).unwrap();
    assert!((short.points, short.t_max) == (1, needed - 1.0) && (short.needed / needed - 1.0).abs() < 1e-12);
    assert_eq!(warned(&format!("distance = 50.0, ek_threshold = 1e-12, t_max = {}", needed - 400.0)), None);
    assert_eq!(warned("t_max = 10.0"), None, "where no distance is asked for, the time alone ends runs");
}

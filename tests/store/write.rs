//! Registering, writing, fitting: what goes in.

use super::make::*;
use meniscus::parameters::{JobId, JobState};
use meniscus::results::fits::{LambdaFit, PointRuns, SpeedAverage};
use meniscus::results::trajectory::{Arrest, FailureClass, Mechanism, Outcome, Pinch, Trajectory};
use meniscus::store::{
    CampaignRecord, Message, PlannedPoint, Provenance, StateCounts, Store, StoreError, Writer, check, job, job_states,
    outlines, point_runs, repair, save_fits, status,
};
use meniscus::study::fits::FittedPoint;
use meniscus::study::survival::kaplan_meier::Step;
use std::path::Path;
use std::time::Duration;

#[test]
fn registering_adds_what_is_new_and_changes_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = filled(dir.path(), &[soft(1.0)], 2, 3, 10);
    let before = csv(dir.path(), "SELECT * FROM runs ORDER BY seed");
    assert_eq!(register(&mut store, &[soft(1.0)], 2), 0);
    assert_eq!(register(&mut store, &[soft(1.0), ring(1.0)], 5), 3 + 5);
    assert_eq!(csv(dir.path(), "SELECT * FROM runs WHERE e_w = 1 AND seed < 2 ORDER BY seed"), before);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM runs WHERE state = 'pending' AND attempts = 0"), ["8"]);
}

#[test]
fn a_seed_that_sqlite_cannot_hold_is_refused_before_anything_is_added() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    let point = soft(1.0);
    let plan = [PlannedPoint { point: &point, point_id: point.id(), seeds: u64::MAX - 1..u64::MAX, block: "test" }];
    let refused = store.register(&CampaignRecord { name: "a", text: "" }, &plan);
    assert!(matches!(refused, Err(StoreError::SeedTooLarge(_))));
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM campaigns"), ["0"]);
}

#[test]
fn a_second_delivery_of_an_outcome_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let point = ring(1.0);
    let store = filled(dir.path(), std::slice::from_ref(&point), 4, 3, 2);
    let everything = || {
        let tables = ["runs", "clog_events", "samples", "sample_files", "outcomes"];
        tables.map(|table| csv(dir.path(), &format!("SELECT * FROM {table}")))
    };
    let before = everything();
    let writer = Writer::spawn(store, options(3)).unwrap();
    for seed in 0..4 {
        writer.sender().send(finished(&point, seed, 5)).unwrap();
        writer.sender().send(failed(&point, seed, FailureClass::Io)).unwrap();
        writer.sender().send(Message::Started(JobId::new(point.id(), seed))).unwrap();
    }
    writer.finish().unwrap();
    assert_eq!(everything(), before);
}

#[test]
fn of_two_outcomes_in_one_batch_the_first_counts() {
    let dir = tempfile::tempdir().unwrap();
    let point = soft(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 1);
    let writer = Writer::spawn(store, options(10)).unwrap();
    writer.sender().send(finished(&point, 0, 2)).unwrap();
    writer.sender().send(finished(&point, 0, 7)).unwrap();
    writer.finish().unwrap();
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM samples"), ["2"]);
}

#[test]
fn what_is_kept_of_a_job_does_not_depend_on_its_batch() {
    let points = [soft(1.0), ring(0.3)];
    let rows = |batch| {
        let dir = tempfile::tempdir().unwrap();
        filled(dir.path(), &points, 9, 11, batch);
        ["runs", "clog_events", "samples"]
            .map(|table| csv(dir.path(), &format!("SELECT * FROM {table} ORDER BY job_id, 2")))
    };
    let (alone, together) = (rows(1), rows(1000));
    assert_eq!(alone[2].len(), 2 * 9 * 11);
    assert_eq!(alone, together);
}

#[test]
fn a_failure_is_a_row_with_its_class_and_reason_and_can_be_tried_again() {
    let dir = tempfile::tempdir().unwrap();
    let point = soft(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 3);
    let writer = Writer::spawn(store, options(10)).unwrap();
    writer.sender().send(failed(&point, 0, FailureClass::Unstable)).unwrap();
    writer.sender().send(failed(&point, 1, FailureClass::Io)).unwrap();
    let mut store = writer.finish().unwrap();

    let sql = "SELECT seed, state, attempts, outcome, r_end, error_class, error FROM runs WHERE seed < 2 ORDER BY seed";
    let reason = |class| format!("failed,1,,,{class},made to be {class}");
    assert_eq!(csv(dir.path(), sql), [format!("0,{}", reason("unstable")), format!("1,{}", reason("io"))]);
    assert_eq!(csv(dir.path(), "SELECT error_step FROM outcomes"), ["17", "17"]);

    assert_eq!(store.retry(Some(FailureClass::Io)).unwrap(), 1);
    assert_eq!(csv(dir.path(), sql), [format!("0,{}", reason("unstable")), "1,pending,1,,,,".to_owned()]);
    let writer = Writer::spawn(store, options(10)).unwrap();
    writer.sender().send(finished(&point, 1, 2)).unwrap();
    writer.finish().unwrap();
    assert_eq!(csv(dir.path(), sql)[1], "1,done,2,distance,1.3333333333333333,,");
}

#[test]
fn a_trajectory_that_is_not_a_number_fails_alone() {
    let dir = tempfile::tempdir().unwrap();
    let point = soft(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 3);
    let writer = Writer::spawn(store, options(10)).unwrap();
    let spoil = |seed, spoil: fn(&mut Trajectory)| {
        let mut run = trajectory(&point, seed, 2);
        spoil(&mut run);
        let job = JobId::new(point.id(), seed);
        writer.sender().send(Message::Finished { job, result: Ok(run), wall_s: f64::NAN }).unwrap();
    };
    spoil(0, |run| run.r_end = f64::NAN);
    spoil(1, |run| run.samples.y.truncate(1));
    spoil(2, |_| ());
    writer.finish().unwrap();
    let seen = csv(dir.path(), "SELECT state, error_class, error FROM runs ORDER BY seed");
    assert_eq!(
        seen,
        ["failed,unstable,r_end is NaN", "failed,panicked,the recorded columns differ in length", "done,,"]
    );
}

#[test]
fn an_outcome_without_a_job_is_reported_and_the_others_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[soft(1.0)], 1);
    let writer = Writer::spawn(store, options(10)).unwrap();
    writer.sender().send(finished(&soft(2.0), 0, 2)).unwrap();
    writer.sender().send(finished(&soft(1.0), 0, 2)).unwrap();
    let stranger = JobId::new(soft(2.0).id(), 0);
    assert!(matches!(writer.finish(), Err(StoreError::UnknownJob(job)) if job == stranger));
    assert_eq!(csv(dir.path(), "SELECT state FROM runs"), ["done"]);
}

#[test]
fn a_started_job_shows_as_running_within_the_time_of_a_commit() {
    let dir = tempfile::tempdir().unwrap();
    let point = soft(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 2);
    let writer = Writer::spawn(store, options(1000)).unwrap();
    let id = JobId::new(point.id(), 1);
    writer.sender().send(Message::Started(id)).unwrap();
    while job(dir.path(), id).unwrap().unwrap().state != JobState::Running {
        std::thread::sleep(Duration::from_millis(5));
    }
    writer.sender().send(finished(&point, 1, 2)).unwrap();
    writer.finish().unwrap();
    assert_eq!(csv(dir.path(), "SELECT state, attempts FROM runs ORDER BY seed"), ["pending,0", "done,1"]);
}

#[test]
fn the_planner_reads_all_ids_in_order_and_an_absent_store_as_empty() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(job_states(&dir.path().join("none")).unwrap(), []);
    let mut store = filled(dir.path(), &[soft(1.0)], 3, 1, 10);
    register(&mut store, &[soft(1.0)], 5);
    let states = job_states(dir.path()).unwrap();
    let mut expected: Vec<_> = (0..5)
        .map(|seed| (JobId::new(soft(1.0).id(), seed), if seed < 3 { JobState::Done } else { JobState::Pending }))
        .collect();
    expected.sort_by_key(|(id, _)| *id);
    assert_eq!(states, expected);
}

#[test]
fn a_job_is_found_with_its_point_and_seed() {
    let dir = tempfile::tempdir().unwrap();
    filled(dir.path(), &[soft(1.0), ring(0.3)], 3, 1, 10);
    let found = job(dir.path(), JobId::new(ring(0.3).id(), 2)).unwrap().unwrap();
    assert_eq!((found.point, found.seed, found.state), (ring(0.3), 2, JobState::Done));
    assert_eq!(job(dir.path(), JobId::new(ring(0.3).id(), 3)).unwrap(), None);
}

#[test]
fn fits_read_finished_runs_by_parameter_as_a_number_and_their_answers_replace_the_last() {
    let dir = tempfile::tempdir().unwrap();
    let points = [soft(10.0), ring(1.0), soft(9.0), soft(100.0)];
    let mut store = filled(dir.path(), &points[..3], 3, 1, 10);
    register(&mut store, &points, 5);
    let read = point_runs(store.connection()).unwrap();
    let order: Vec<_> = read.iter().map(|runs| runs.point.clone()).collect();
    assert_eq!(order, [ring(1.0), soft(9.0), soft(10.0)]);
    let runs = &read[0].runs;
    assert_eq!(runs.iter().map(|run| run.seed).collect::<Vec<_>>(), [0, 1, 2]);
    assert_eq!((runs[0].outcome, runs[0].v_g_mean, runs[0].mechanism), (Outcome::Clogged, None, Some(Mechanism::Wrap)));
    assert_eq!(runs[1].mechanism, None);
    assert_eq!((runs[2].r_end.to_bits(), runs[2].v_g_mean), ((1.0_f64 + 2.0 / 3.0).to_bits(), Some(0.7)));

    let fit = LambdaFit {
        runs: 3,
        clogs: 1,
        by_time: 2,
        r_from: 0.5,
        lambda: Some(24.0),
        lambda_low: Some(12.0),
        lambda_if_stuck: Some(8.0),
        weibull_shape: Some(1.25),
        p_exponential: Some(0.5),
        runs_for_ten_percent: Some(400),
        ..LambdaFit::default()
    };
    let average = SpeedAverage {
        runs: 3,
        flowing: 2,
        by_distance: 1,
        by_time: 1,
        arrested: 0,
        v_g: Some(0.7),
        v_g_low: None,
        v_g_high: None,
        ca: Some(0.55),
    };
    let step = Step { r: 1.5, survival: 0.75, variance: Some(0.04), at_risk: 4, events: 1 };
    let fitted = |point, lambda| FittedPoint { point, lambda, curve: vec![step], speed: average };
    save_fits(&mut store, &[fitted(&read[1], LambdaFit { clogs: 2, ..fit })]).unwrap();
    save_fits(&mut store, &[fitted(&read[0], fit)]).unwrap();
    assert_eq!(
        csv(
            dir.path(),
            "SELECT model, scene, gamma, e_w, w_ob, sigma_ob, saturated, k_a, n_vertices, runs, clogs, lambda,
                    lambda_low, lambda_high, p_exponential, runs_for_ten_percent, wrap_share, hybrid_share
             FROM lambda_fits"
        ),
        ["DP,obstacles,1.0,10000.0,0.2,0.3,1,10000.0,256,3,1,24.0,12.0,,0.5,400,1.0,0.0"]
    );
    assert_eq!(
        csv(
            dir.path(),
            "SELECT gamma, runs, flowing, v_g, v_g_low, ca, by_distance, by_time, arrested FROM speed_averages"
        ),
        ["1.0,3,2,0.7,,0.55,1,1,0"]
    );
    let cut =
        "SELECT by_distance, by_time, beyond_box, arrested, r_from, lambda_if_stuck, weibull_shape FROM lambda_fits";
    assert_eq!(csv(dir.path(), cut), ["0,2,0,0,0.5,8.0,1.25"]);
    let curve = "SELECT r, at_risk, clogs, survival, survival_low < 0.75, survival_high > 0.75
                 FROM survival JOIN lambda_fits USING (point_id)";
    assert_eq!(csv(dir.path(), curve.replace("clogs", "survival.clogs").as_str()), ["2.0,4,1,0.75,1,1"]);
    let other = PointRuns { point_id: soft(7.0).id(), point: soft(7.0), runs: Vec::new() };
    assert!(save_fits(&mut store, &[fitted(&other, fit)]).is_err(), "the point is not in the store");
    assert_eq!(csv(dir.path(), "SELECT clogs FROM lambda_fits"), ["1"], "and the old rows stay");
}

#[test]
fn status_counts_states_failures_and_the_progress_of_the_run() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(status(dir.path()).unwrap().total.jobs(), 0);
    let mut store = Store::open(dir.path()).unwrap();
    let point = soft(1.0);
    let plan = [PlannedPoint { point: &point, point_id: point.id(), seeds: 0..10, block: "test" }];
    let campaign = store.register(&CampaignRecord { name: "speed", text: "a" }, &plan).unwrap().campaign;
    store.register(&CampaignRecord { name: "speed", text: "b" }, &plan).unwrap();
    let provenance = Provenance { program_version: "0.1", git_commit: "c", rustc: "r", cpu_features: "f", campaign };
    store.begin_run(&provenance).unwrap();
    let writer = Writer::spawn(store, options(2)).unwrap();
    (0..5).for_each(|seed| writer.sender().send(finished(&point, seed, 2)).unwrap());
    (5..7).for_each(|seed| writer.sender().send(failed(&point, seed, FailureClass::Engulfed)).unwrap());
    while status(dir.path()).unwrap().total.pending > 3 {
        std::thread::sleep(Duration::from_millis(5));
    }
    let during = status(dir.path()).unwrap();
    assert_eq!(during.holder.unwrap().pid, Some(std::process::id()));
    assert_eq!(during.total, StateCounts { pending: 3, running: 0, done: 5, failed: 2 });
    assert_eq!((during.campaigns.len(), during.campaigns[0].counts), (1, during.total));
    assert_eq!((during.clogs, during.stale), (2, 0));
    let failure = &during.failures[0];
    assert_eq!(
        (failure.class.as_str(), failure.jobs, failure.example.as_str()),
        ("engulfed", 2, "made to be engulfed")
    );
    assert_eq!(during.run.as_ref().unwrap().ended, None);
    drop(writer.finish().unwrap());
    let after = status(dir.path()).unwrap();
    assert_eq!(after.holder, None);
    let run = after.run.unwrap();
    assert_eq!((run.finished, run.finished_in_window), (7, 7));
    assert!(run.ended.unwrap() >= run.started);
    assert!(serde_json::to_string(&during.campaigns).unwrap().contains(r#""done":5"#));
}

#[test]
fn results_of_another_physics_version_are_kept_but_stand_apart() {
    let dir = tempfile::tempdir().unwrap();
    let store = filled(dir.path(), &[soft(1.0)], 8, 1, 10);
    store.connection().execute("UPDATE jobs SET physics_version = 0 WHERE seed < 6", []).unwrap();
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM runs"), ["2"]);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM stale_runs"), ["6"]);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM clog_events"), ["0"]);
    let now = status(dir.path()).unwrap();
    assert_eq!((now.total.done, now.stale, now.clogs), (2, 6, 0));
    assert_eq!(point_runs(store.connection()).unwrap()[0].runs.len(), 2);
}

#[test]
fn shapes_read_back_bit_for_bit_and_those_of_a_failure_go_when_it_is_tried_again() {
    let dir = tempfile::tempdir().unwrap();
    let points = [soft(10.0), ring(1.0)];
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &points, 3);
    let writer = Writer::spawn(store, options(2)).unwrap();
    for point in &points {
        writer.sender().send(finished(point, 0, 1)).unwrap();
        writer.sender().send(failed(point, 1, FailureClass::Engulfed)).unwrap();
    }
    let mut store = writer.finish().unwrap();
    for (point, is_ring) in [(&points[0], false), (&points[1], true)] {
        let kept = |seed| outlines(dir.path(), JobId::new(point.id(), seed)).unwrap();
        assert_eq!(kept(0), [outline(0.0, 0, is_ring), outline(1000.0, 0, is_ring)]);
        assert_eq!(kept(1), [outline(17.0, 0, true)]);
        assert_eq!(kept(2), []);
    }
    assert_eq!(csv(dir.path(), "SELECT sum(json_array_length(loads)), count(DISTINCT job_id) FROM shapes"), ["12,4"]);
    store.retry(None).unwrap();
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM shapes"), ["4"]);
}

#[test]
fn a_shape_with_a_coordinate_that_is_no_number_makes_a_failed_run_that_keeps_the_one_before() {
    let dir = tempfile::tempdir().unwrap();
    let point = ring(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 1);
    let writer = Writer::spawn(store, options(1)).unwrap();
    let mut run = trajectory(&point, 0, 1);
    run.outlines[1].x[2] = f64::NAN;
    let job = JobId::new(point.id(), 0);
    writer.sender().send(Message::Finished { job, result: Ok(run), wall_s: 0.1 }).unwrap();
    writer.finish().unwrap();
    assert_eq!(csv(dir.path(), "SELECT state, error_class FROM runs"), ["failed,unstable"]);
    assert_eq!(outlines(dir.path(), job).unwrap(), [outline(0.0, 0, true)]);
}

/// Turns all ends of this kind in a sound store into another. A check finds the problem, and a repair puts it right.
fn contradict(dir: &Path, outcome: &str, problem: &str) {
    assert_eq!(check(dir).unwrap().findings, []);
    let conn = rusqlite::Connection::open(dir.join("store.db")).unwrap();
    conn.execute("UPDATE outcomes SET outcome = 'distance' WHERE outcome = ?1", [outcome]).unwrap();
    drop(conn);
    std::fs::remove_file(dir.join("store.db.seal")).unwrap();
    let found = check(dir).unwrap().findings;
    assert!(found.iter().any(|finding| finding.problem.contains(problem)), "{found:?}");
    repair(dir).unwrap();
}

#[test]
fn a_closed_film_is_kept_read_back_and_checked() {
    let dir = tempfile::tempdir().unwrap();
    let point = ring(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 1);
    let run = Trajectory {
        outcome: Outcome::Pinched,
        clog: None,
        pinch: Some(Pinch { x: 251.5, y: 249.25 }),
        ..trajectory(&point, 0, 3)
    };
    let writer = Writer::spawn(store, options(1)).unwrap();
    let job = JobId::new(point.id(), 0);
    writer.sender().send(Message::Finished { job, result: Ok(run), wall_s: 1.0 }).unwrap();
    drop(writer.finish().unwrap());
    let kept = "SELECT r = r_end, t = t_end, x, y, outcome FROM pinch_events JOIN runs USING (job_id)";
    assert_eq!(csv(dir.path(), kept), ["1,1,251.5,249.25,pinched"]);
    contradict(dir.path(), "pinched", "closed film contradict");
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM pinch_events"), ["0"]);
}

#[test]
fn an_arrest_is_kept_read_back_counted_as_a_clog_and_checked() {
    let dir = tempfile::tempdir().unwrap();
    let point = ring(1.0);
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, std::slice::from_ref(&point), 3);
    let arrest = Arrest { r: 2.25, x: 252.0, y: 249.5, way_left: 1e-3, energy_left: 1e-6 };
    let cut = Trajectory {
        outcome: Outcome::TimeLimit,
        v_g_mean: Some(1e-4),
        arrest: Some(arrest),
        ..trajectory(&point, 1, 4)
    };
    let writer = Writer::spawn(store, options(2)).unwrap();
    writer.sender().send(finished(&point, 0, 4)).unwrap();
    let job = JobId::new(point.id(), 1);
    writer.sender().send(Message::Finished { job, result: Ok(cut), wall_s: 1.0 }).unwrap();
    let store = writer.finish().unwrap();
    let run = &point_runs(store.connection()).unwrap()[0].runs[1];
    assert_eq!((run.outcome, run.arrested, run.stays_at()), (Outcome::TimeLimit, Some(2.25), Some(2.25)));
    drop(store);
    let kept = "SELECT r, x, y, way_left, energy_left, outcome FROM arrest_events JOIN runs USING (job_id)";
    assert_eq!(csv(dir.path(), kept), ["2.25,252.0,249.5,0.001,1e-6,time_limit"]);
    contradict(dir.path(), "time_limit", "result and arrest contradict");
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM arrest_events"), ["0"]);
    assert_eq!(csv(dir.path(), "SELECT state FROM runs ORDER BY seed"), ["done", "pending", "pending"]);
}

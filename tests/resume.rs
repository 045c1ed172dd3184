//! A trajectory that is cut anywhere, saved, and taken up again has the bits of one that is not.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[path = "common/single.rs"]
#[allow(dead_code, reason = "every test file uses its part")]
mod single;

use meniscus::parameters::{Integrator, Job, Stepping};
use meniscus::physics::simd::best_instruction_set;
use meniscus::physics::simulate::{Context, EndState, Keeper, NoKeeper, RunEnded, Snapshot, go_on};
use meniscus::physics::walls::arrays::library::ArrayLibrary;
use meniscus::results::trajectory::{Failure, Samples, Trajectory};
use proptest::prelude::*;
use single::job;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const DENSE: &str = "scene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\nbox_size = 40.0\ndensity = 0.7\n";

/// Every motion and every effect that remembers something; in short.
fn cases() -> Vec<(&'static str, Job)> {
    let dense = |keys: &str| job(&format!("{DENSE}{keys}"), 0).0;
    let in_steps = |mut job: Job, dt: f64| {
        Arc::make_mut(&mut job.point).stepping = Stepping { integrator: Integrator::Verlet, dt };
        job
    };
    vec![
        ("wrapped", dense("integrator = \"verlet\"\ngamma = 0.3\nn_vertices = 64\nshapes_every = 20.0\nlimits.t_max = 120.0")),
        ("piled up", dense("integrator = \"verlet\"\ngamma = 0.05\nkappa = 1e-3\nn_vertices = 64\ne_w = 1e5\nlimits.t_max = 60.0")),
        ("hydrostatic", job("scene = \"plate\"\ngamma = 0.2\nkappa = 0.3\nn_vertices = 48\ngravity = \"centroid\"\nlimits.t_max = 60.0", 0).0),
        ("near walls", dense("integrator = \"verlet\"\ngamma = 0.3\nn_vertices = 48\nb0 = 0.4\nlimits.t_max = 60.0")),
        ("refused steps", in_steps(dense("gamma = 1.0\nn_vertices = 64\nlimits.t_max = 60.0"), 2.5e-2)),
        ("implicit", dense("gamma = 1.09\nwall = \"per_vertex\"\nintegrator = \"implicit\"\nn_vertices = 64\nlimits.t_max = 90.0")),
        ("adaptive", dense("gamma = 1.09\nstep_error = 1e-7\nn_vertices = 64\nshapes_every = 7.0\nlimits.t_max = 300.0")),
        ("adaptive, folded", dense("gamma = 0.05\nn_vertices = 64\nlimits.t_max = 80.0")),
        ("adaptive, near walls", dense("gamma = 0.3\nb0 = 0.4\nwall = \"per_vertex\"\nn_vertices = 64\nlimits.t_max = 60.0")),
        ("implicit, near walls", dense("gamma = 0.1\nb0 = 0.4\nintegrator = \"implicit\"\nn_vertices = 64\nlimits.t_max = 60.0")),
        ("liquid", dense("dynamics = \"darcy\"\ngamma = 0.8\nn_vertices = 32\nlimits.t_max = 60.0")),
        ("soft", dense("model = \"SP\"\ne_w = 10.0\nlimits.t_max = 3000.0")),
        ("soft, near walls", dense("model = \"SP\"\ne_w = 10.0\nb0 = 0.4\nlimits.t_max = 100.0")),
        ("soft, adaptive", dense("model = \"SP\"\ne_w = 10.0\nintegrator = \"adaptive\"\nshapes_every = 7.0\nlimits.t_max = 3000.0")),
        ("soft, adaptive, near walls", dense("model = \"SP\"\ne_w = 10.0\nb0 = 0.4\nintegrator = \"adaptive\"\nlimits.t_max = 300.0")),
        ("channel", job("scene = \"channel\"\nw = 0.9\nv_t = 0.08\nh_start = -1.2\nh_end = 1.0\ngamma = 0.8\nn_vertices = 64\nb0 = 0.4", 0).0),
        ("plate", job("scene = \"plate\"\ngamma = 1.0\nn_vertices = 64\nlimits.t_max = 60.0", 0).0),
    ]
}

/// All bits of a result, signs of zeros too.
fn bits(result: &Result<Trajectory, Failure>) -> String {
    format!("{result:?}")
}

/// Through the bytes of a file and back.
fn saved(snapshot: &Snapshot) -> Snapshot {
    let back: Snapshot = postcard::from_bytes(&postcard::to_stdvec(snapshot).unwrap()).unwrap();
    assert_eq!(format!("{back:?}"), format!("{snapshot:?}"));
    back
}

/// Stops a run at the checks it is given, and takes the snapshots of others.
struct Cutter<'a> {
    stop: &'a AtomicBool,
    checks: u64,
    cuts: &'a [u64],
    seen: u64,
}

impl Keeper for Cutter<'_> {
    fn wants(&mut self) -> bool {
        self.checks += 1;
        if self.cuts.contains(&self.checks) {
            self.stop.store(true, Ordering::Relaxed);
        }
        self.checks.is_multiple_of(7)
    }
    fn keep(&mut self, _: Snapshot) {
        self.seen += 1;
    }
}

/// The result of a job that is cut at these checks; and how many snapshots were taken.
fn cut(job: &Job, cuts: &[u64]) -> (Result<Trajectory, Failure>, u64) {
    let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
    let mut cutter = Cutter { stop: &stop, checks: 0, cuts, seen: 0 };
    let mut from = None;
    loop {
        let context = Context { arrays: &arrays, instruction_set: best_instruction_set(), stop: &stop };
        match go_on(job, context, from.as_ref(), &mut cutter) {
            Ok(RunEnded::Finished(trajectory)) => return (Ok(*trajectory), cutter.seen),
            Ok(RunEnded::Stopped(snapshot)) => from = snapshot.map(|snapshot| saved(&snapshot)),
            Ok(RunEnded::WrongSnapshot) => panic!("a snapshot fits its job"),
            Err(failure) => return (Err(failure), cutter.seen),
        }
        stop.store(false, Ordering::Relaxed);
    }
}

#[test]
fn a_run_cut_at_many_checks_equals_an_uninterrupted_one_for_every_motion() {
    for (name, job) in cases() {
        let (whole, _) = cut(&job, &[]);
        let result = whole.as_ref().unwrap_or_else(|failure| panic!("{name}: {failure}"));
        assert!(result.steps > 100 && result.samples.len() > 3, "{name}");
        assert!(
            result.refused > 0 || !["refused steps", "implicit", "adaptive"].contains(&name),
            "{name} refuses none"
        );
        let (often, seen) = cut(&job, &[2, 3, 5, 8, 13, 21, 34, 38, 44, 45, 46, 55, 57]);
        assert!(seen > 2, "{name}");
        assert_eq!(bits(&often), bits(&whole), "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn it_does_wherever_it_is_cut(case in 0..15_usize, cuts in proptest::collection::vec(1..60_u64, 1..6)) {
        let (name, job) = cases().swap_remove(case);
        prop_assert_eq!(bits(&cut(&job, &cuts).0), bits(&cut(&job, &[]).0), "{}", name);
    }
}

/// Takes the end state.
#[derive(Default)]
struct End(Option<EndState>);

impl Keeper for End {
    fn wants(&mut self) -> bool {
        false
    }
    fn keep(&mut self, _: Snapshot) {}
    fn wants_end(&self) -> bool {
        true
    }
    fn keep_end(&mut self, end: EndState) {
        self.0 = Some(end);
    }
}

/// The trajectory of a job from a snapshot on, and its end state.
fn ended(job: &Job, from: Option<&Snapshot>) -> (Trajectory, EndState) {
    let (arrays, stop, mut end) = (ArrayLibrary::default(), AtomicBool::new(false), End::default());
    let context = Context { arrays: &arrays, instruction_set: best_instruction_set(), stop: &stop };
    match go_on(job, context, from, &mut end) {
        Ok(RunEnded::Finished(trajectory)) => (*trajectory, end.0.unwrap()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_that_goes_on_from_the_end_of_a_shorter_one_equals_an_uninterrupted_one_for_every_motion() {
    for (name, job) in cases() {
        let whole = ended(&job, None);
        let t = whole.0.t_end;
        // Limits at a check, between two checks, and at a distance.
        for (t_max, distance) in [((0.4 * t).ceil(), None), (0.7 * t + 0.3, None), (t, Some(0.5 * whole.0.r_end))] {
            let mut shorter = job.clone();
            let limits = &mut Arc::make_mut(&mut shorter.point).limits;
            (limits.t_max, limits.distance) = (t_max, distance);
            let (cut, end) = ended(&shorter, None);
            assert!(end.step() < cut.steps && cut.t_end <= t, "{name}");
            let end: EndState = postcard::from_bytes(&postcard::to_stdvec(&end).unwrap()).unwrap();
            let snapshot = end.snapshot(cut.samples, cut.outlines).unwrap();
            assert_eq!(
                format!("{:?}", ended(&job, Some(&snapshot))),
                format!("{whole:?}"),
                "{name} {t_max} {distance:?}"
            );
        }
        let (cut, end) = whole;
        assert!(end.snapshot(Samples::default(), cut.outlines).is_none(), "the series belong to it");
    }
}

#[test]
fn a_run_stopped_at_any_instant_between_two_checks_equals_an_uninterrupted_one() {
    let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
    for (name, job) in cases().into_iter().filter(|(name, _)| ["piled up", "implicit", "adaptive"].contains(name)) {
        let (mut from, mut stops, mut pause) = (None, 0, 200);
        let result = loop {
            let ended = std::thread::scope(|scope| {
                scope.spawn(|| {
                    std::thread::sleep(Duration::from_micros(pause));
                    stop.store(true, Ordering::Relaxed);
                });
                let context = Context { arrays: &arrays, instruction_set: best_instruction_set(), stop: &stop };
                go_on(&job, context, from.as_ref(), &mut NoKeeper)
            });
            stop.store(false, Ordering::Relaxed);
            match ended {
                Ok(RunEnded::Finished(trajectory)) => break Ok(*trajectory),
                Ok(RunEnded::Stopped(snapshot)) => from = snapshot.map(|snapshot| saved(&snapshot)).or(from),
                Ok(RunEnded::WrongSnapshot) => panic!("a snapshot fits its job"),
                Err(failure) => break Err(failure),
            }
            (stops, pause) = (stops + 1, pause + 1371);
        };
        assert!(stops > 0, "{name} was never stopped");
        assert_eq!(bits(&result), bits(&cut(&job, &[]).0), "{name}");
    }
}

#[test]
fn a_run_that_fails_fails_alike_from_any_of_its_checks_on() {
    let mut job = job(&format!("{DENSE}gamma = 1.0\nn_vertices = 64\ne_w = 300.0\nlimits.t_max = 300.0"), 1).0;
    Arc::make_mut(&mut job.point).limits.ek_threshold = 1e-30;
    let (whole, _) = cut(&job, &[]);
    assert!(whole.is_err(), "{whole:?}");
    assert_eq!(bits(&cut(&job, &[1, 4, 5, 9, 17, 18, 40]).0), bits(&whole));
}

#[test]
fn the_snapshot_of_another_job_is_refused() {
    let stop = AtomicBool::new(true);
    let context = Context { arrays: &ArrayLibrary::default(), instruction_set: best_instruction_set(), stop: &stop };
    let begin = |job: &Job| match go_on(job, context, None, &mut NoKeeper) {
        Ok(RunEnded::Stopped(Some(snapshot))) => *snapshot,
        other => panic!("{other:?}"),
    };
    // Where nothing has to be blown up, a run that is told to stop has begun all the same.
    let on = |keys: &str| job(&format!("scene = \"disc\"\nsigma_ob = 0.3\n{keys}"), 0).0;
    let jobs = [
        on("gamma = 1.0\nn_vertices = 64\nintegrator = \"verlet\""),
        on("gamma = 1.0\nn_vertices = 72\nintegrator = \"verlet\""),
        on("gamma = 1.0\nn_vertices = 64\nintegrator = \"implicit\""),
        on("gamma = 1.0\nn_vertices = 64\nintegrator = \"adaptive\""),
        on("gamma = 1.0\nn_vertices = 64\ndynamics = \"darcy\""),
        on("gamma = 1.0\nn_vertices = 64\nintegrator = \"verlet\"\nself_contact = \"off\""),
        on("model = \"SP\"\ne_w = 1.0"),
    ];
    for (i, one) in jobs.iter().enumerate() {
        for (j, other) in jobs.iter().enumerate() {
            let ended = go_on(one, context, Some(&begin(other)), &mut NoKeeper).unwrap();
            assert_eq!(matches!(ended, RunEnded::WrongSnapshot), i != j, "{i} {j}");
        }
    }
}

//! A droplet that is at rest when its time runs out is told from one that flows.
//!
//! Runs are computed twice: to the end that the full rule gives them, and cut off at many instants by t_max. After the
//! arrest a cut run must count as arrested where the whole run clogs. Before it, or in a run that never clogs, it must
//! not be arrested anywhere else.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that cannot go on has failed, and tells its figures"
)]

#[path = "common/single.rs"]
mod single;

use meniscus::parameters::Job;
use meniscus::physics::simd::best_instruction_set;
use meniscus::physics::simulate::{Context, Keeper, NoKeeper, RunEnded, Snapshot, go_on};
use meniscus::physics::walls::arrays::library::ArrayLibrary;
use meniscus::results::trajectory::{Arrest, Clog, Outcome, Trajectory};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const ARRAY: &str = "scene = \"obstacles\"\nsigma_ob = 0.3\nw_ob = 0.2\nbox_size = 40.0\ndensity = 1.0\n\
                     sample_every = 1.0\nlimits = { t_max = 2e4, distance = 12.0 }\n";

/// E_k/E_t of a droplet that moves at V_t/100.
const CREEPING: f64 = 1e-4;

/// Keeps the snapshots at these times.
struct At<'a> {
    times: &'a [f64],
    dt: f64,
    checks: f64,
    kept: Vec<(f64, Snapshot)>,
}

impl Keeper for At<'_> {
    fn wants(&mut self) -> bool {
        self.checks += 1.0;
        self.times.contains(&(self.checks - 1.0))
    }

    fn keep(&mut self, snapshot: Snapshot) {
        self.kept.push((snapshot.step() as f64 * self.dt, snapshot));
    }
}

/// The end of a job, from a snapshot on if there is one.
fn end(job: &Job, from: Option<&Snapshot>, arrays: &ArrayLibrary, keeper: &mut dyn Keeper) -> Trajectory {
    let stop = AtomicBool::new(false);
    let context = Context { arrays, instruction_set: best_instruction_set(), stop: &stop };
    match go_on(job, context, from, keeper) {
        Ok(RunEnded::Finished(trajectory)) => *trajectory,
        other => panic!("{other:?}"),
    }
}

/// The same job, cut off at this time.
fn cut_at(job: &Job, t_max: f64) -> Job {
    let mut cut = job.clone();
    Arc::make_mut(&mut cut.point).limits.t_max = t_max;
    cut
}

/// The last time at which the droplet was faster than V_t/100, or had more than 0.01 sigma left to its clog.
fn arrested_from(run: &Trajectory, clog: &Clog) -> f64 {
    let samples = &run.samples;
    let moves = |i: &usize| {
        let way = libm::hypot(clog.x - samples.h[*i], clog.y - samples.y[*i]);
        samples.ek_ratio[*i] >= CREEPING || way > 0.01
    };
    (0..samples.len()).rev().find(moves).map_or(0.0, |i| samples.t[i])
}

/// Two equilibria nearer than this are one place, in sigma. Where the vertices of a coarse ring lie along its outline
/// is not the same in both, because steps of other lengths turn them by another share of an edge.
const SAME_PLACE: f64 = 2e-3;

/// What became of cut runs.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    runs: u32,
    clogs: u32,
    /// Cuts between arrest and threshold, those that are told as arrested, and those of which there is another place.
    after: u32,
    found: u32,
    misplaced: u32,
    /// Cuts before the arrest or of a run that does not clog, and those of them that are told as arrested elsewhere
    /// than where the run clogs.
    before: u32,
    gained: u32,
    /// Those that were slower than V_t/100.
    slow: u32,
}

impl Counts {
    /// Whether the arrest is where the run clogs.
    fn is_at_clog(arrest: &Arrest, run: &Trajectory) -> bool {
        run.clog.as_ref().is_some_and(|clog| libm::hypot(arrest.x - clog.x, arrest.y - clog.y) < SAME_PLACE)
    }

    fn add(&mut self, job: &Job, cuts: u32, arrays: &ArrayLibrary) {
        let run = end(job, None, arrays, &mut NoKeeper);
        let clogs = run.clog.is_some();
        let from = run.clog.as_ref().map_or(run.t_end, |clog| arrested_from(&run, clog));
        let spread =
            |a: f64, b: f64| (0..cuts).map(move |k| (a + (b - a) * f64::from(k + 1) / f64::from(cuts + 1)).floor());
        let mut times: Vec<f64> = spread(0.0, from).chain(spread(from, run.t_end)).collect();
        times.retain(|t| *t >= 1.0 && *t < run.t_end - 1.0);
        times.dedup();
        let mut at = At { times: &times, dt: job.point.stepping.dt, checks: 0.0, kept: Vec::new() };
        assert_eq!(end(job, None, arrays, &mut at).t_end, run.t_end);
        (self.runs, self.clogs) = (self.runs + 1, self.clogs + u32::from(clogs));
        for (t, snapshot) in &at.kept {
            let cut = end(&cut_at(job, t + 1.0), Some(snapshot), arrays, &mut NoKeeper);
            assert_eq!((cut.outcome, cut.t_end), (Outcome::TimeLimit, t + 1.0));
            let arrested = cut.arrest.as_ref();
            let elsewhere = u32::from(arrested.is_some_and(|arrest| !Self::is_at_clog(arrest, &run)));
            if clogs && *t > from {
                self.after += 1;
                self.found += u32::from(arrested.is_some());
                self.misplaced += elsewhere;
                if arrested.is_none() {
                    println!("lost: seed {} t {t} of {from} .. {} ek {:.1e}", job.seed, run.t_end, cut.ek_ratio_end);
                }
            } else {
                self.before += 1;
                self.gained += elsewhere;
                self.slow += u32::from(cut.ek_ratio_end < CREEPING);
            }
            if elsewhere > 0 {
                println!("elsewhere: seed {} t {t} of {from} .. {}: {arrested:?} {:?}", job.seed, run.t_end, run.clog);
            }
        }
    }

    fn of(keys: &str, runs: u64, cuts: u32) -> Self {
        let mut counts = Self::default();
        for seed in 0..runs {
            counts.add(&single::job(&format!("{ARRAY}{keys}"), seed).0, cuts, &ArrayLibrary::default());
        }
        counts
    }
}

#[test]
fn no_clog_is_lost_and_no_flow_is_gained_wherever_runs_are_cut() {
    let cases = [
        ("gamma = 0.8\nn_vertices = 32\nintegrator = \"implicit\"", 20),
        ("gamma = 0.8\nn_vertices = 32\nintegrator = \"verlet\"\nkappa = 1e-3", 8),
        ("gamma = 0.8\nn_vertices = 32\ndynamics = \"darcy\"", 8),
        ("model = \"SP\"\ne_w = 1.0", 20),
    ];
    for (keys, runs) in cases {
        let counts = Counts::of(keys, runs, 10);
        println!("{keys}\n{counts:?}");
        assert!(u64::from(counts.clogs) > runs / 2 && u64::from(counts.after) > 4 * runs, "{counts:?}");
        assert_eq!((counts.found, counts.misplaced, counts.gained), (counts.after, 0, 0), "{keys}");
    }
}

#[test]
fn a_droplet_that_flows_freely_or_has_another_end_before_it_is_not_arrested() {
    let falls =
        single::run("scene = \"channel\"\nw = 9.0\ngamma = 1.0\nn_vertices = 32\nlimits.t_max = 30.0", 0).unwrap();
    assert_eq!((falls.outcome, falls.arrest, falls.creeps()), (Outcome::TimeLimit, None, false));
    // Stuck before the orifice: cut while it comes to rest, and the same where the way that is asked for ends before.
    let stuck = |limits: &str| {
        let keys = "scene = \"channel\"\nw = 0.7\ngamma = 2.4\nn_vertices = 64\nh_start = -1.0";
        single::run(&format!("{keys}\nlimits = {{ {limits} }}"), 0).unwrap()
    };
    let clog = stuck("t_max = 1e4").clog.unwrap();
    let cut = stuck(&format!("t_max = {}", (0.5 * clog.t).floor()));
    let arrest = cut.arrest.unwrap();
    assert!((arrest.r - clog.r).abs() < 1e-6 && arrest.way_left <= 0.01 && !cut.creeps(), "{arrest:?} {clog:?}");
    let ahead = (30..300).map(|k| stuck(&format!("t_max = {k}"))).find(|run| run.arrest.is_some()).unwrap();
    let arrest = ahead.arrest.unwrap();
    assert!(arrest.energy_left > 0.0 && (ahead.r_end + arrest.way_left - arrest.r).abs() < 1e-6, "it has a way left");
    let nearer = 0.5 * (ahead.r_end + arrest.r);
    let cut = stuck(&format!("t_max = {}, distance = {nearer}", ahead.t_end));
    assert_eq!(
        (cut.outcome, cut.r_end, cut.arrest),
        (Outcome::TimeLimit, ahead.r_end, None),
        "it has gone far enough then"
    );
}

#[test]
fn a_droplet_that_hangs_on_an_unstable_balance_is_not_arrested() {
    // Head-on against a disc, nothing pushes the droplet to either side, but the least push would.
    let run = single::run(
        "scene = \"disc\"\nsigma_ob = 0.3\noffset = 0.0\ngamma = 3.0\nn_vertices = 64\nlimits.t_max = 60.0\nintegrator = \"implicit\"",
        0,
    )
    .unwrap();
    assert_eq!(run.outcome, Outcome::TimeLimit);
    assert!(run.samples.v_g.last().unwrap().abs() < 0.01, "{:?}", run.samples.v_g.last());
    assert!(run.arrest.is_none() && run.creeps(), "{:?}", run.arrest);
}

#[test]
#[ignore = "a thousand runs of each droplet take minutes; `cargo test --release --test arrest -- --ignored --nocapture`"]
fn a_thousand_runs_cut_at_ten_instants() {
    for (gamma, dynamics) in
        [(0.8, "integrator = \"implicit\""), (0.4, "integrator = \"implicit\""), (0.8, "dynamics = \"darcy\"")]
    {
        let keys = format!("gamma = {gamma}\nn_vertices = 32\n{dynamics}");
        println!("{keys}\n{:?}", Counts::of(&keys, 1000, 10));
    }
}

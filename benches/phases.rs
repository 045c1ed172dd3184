//! Where the steps and the time of a run go: free flight, contact, and the decay after an arrest.
//!
//! ```text
//! cargo bench --bench phases [-- SEEDS]
//! ```
//!
//! Each scheme takes the same droplets from start to clog at the reference point (Gamma = 1.09, density 0.39). A unit of
//! time belongs to the *decay* if E_k/E_t is below 1e-6 at its end, else to *contact* if an obstacle carries load, else to
//! *free* flight. Steps are counted in one run and timed in another, so that counting is not timed. Rings must clog in the
//! same places by every scheme before anything is printed.

#![allow(missing_docs, reason = "a program")]
#![allow(clippy::print_stdout, reason = "a program that answers on stdout")]
#![allow(clippy::unwrap_used, reason = "a bench that cannot go on has failed")]

#[path = "../tests/common/single.rs"]
#[allow(dead_code, reason = "every program uses its part")]
mod single;

use meniscus::parameters::Job;
use meniscus::physics::motion::implicit::StepCounts;
use meniscus::physics::simd::best_instruction_set;
use meniscus::physics::simulate::{Context, Keeper, RunEnded, Sighting, Snapshot, go_on};
use meniscus::physics::walls::arrays::library::ArrayLibrary;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const ARRAY: &str =
    "scene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\ndensity = 0.39\ngamma = 1.09\nsample_every = 1.0\n";

const SCHEMES: [(&str, &str); 4] = [
    ("verlet", "integrator = \"verlet\""),
    ("implicit, 1/16", "integrator = \"implicit\""),
    ("adaptive", "integrator = \"adaptive\""),
    ("liquid, N_v = 64", "dynamics = \"darcy\"\nn_vertices = 64"),
];

const PHASES: [&str; 3] = ["free", "contact", "decay"];

/// What one phase took.
#[derive(Clone, Copy, Default)]
struct Phase {
    t: f64,
    seconds: f64,
    steps: u64,
    iterations: u64,
    refused: u64,
}

/// Counts steps from check to check.
#[derive(Default)]
struct Counter {
    before: StepCounts,
    /// The phase of each unit of time, and what it took.
    seen: Vec<(usize, StepCounts)>,
}

impl Keeper for Counter {
    fn wants(&mut self) -> bool {
        true
    }

    fn keep(&mut self, snapshot: Snapshot) {
        let Sighting { contacts, ek_ratio, counts: now } = snapshot.sighting();
        let phase = if ek_ratio < 1e-6 { 2 } else { usize::from(contacts > 0) };
        let StepCounts { accepted, refused, iterations } = self.before;
        let took = StepCounts {
            accepted: now.accepted - accepted,
            refused: now.refused - refused,
            iterations: now.iterations - iterations,
        };
        self.before = now;
        self.seen.push((phase, took));
    }
}

/// Notes the time at each check.
#[derive(Default)]
struct Clock(Vec<Instant>);

impl Keeper for Clock {
    fn wants(&mut self) -> bool {
        self.0.push(Instant::now());
        false
    }

    fn keep(&mut self, _: Snapshot) {}
}

/// Runs a job; returns where it clogged.
fn clog(job: &Job, arrays: &ArrayLibrary, keeper: &mut dyn Keeper) -> f64 {
    let context = Context { arrays, instruction_set: best_instruction_set(), stop: &AtomicBool::new(false) };
    match go_on(job, context, None, keeper).unwrap() {
        RunEnded::Finished(trajectory) => trajectory.r_end,
        other => panic!("{other:?}"),
    }
}

fn main() {
    let seeds = std::env::args().filter_map(|argument| argument.parse().ok()).next().unwrap_or(10_u64);
    let (mut places, mut rows): (Vec<Vec<f64>>, Vec<String>) = (Vec::new(), Vec::new());
    for (name, keys) in SCHEMES {
        let mut phases = [Phase::default(); 3];
        let mut ends = Vec::new();
        for seed in 0..seeds {
            let job = single::job(&format!("{ARRAY}{keys}"), seed).0;
            let (arrays, mut counter, mut clock) = (ArrayLibrary::default(), Counter::default(), Clock::default());
            ends.push(clog(&job, &arrays, &mut counter));
            clog(&job, &arrays, &mut clock);
            for (i, &(phase, took)) in counter.seen.iter().enumerate().skip(1) {
                let phase = &mut phases[phase];
                phase.t += 1.0;
                phase.seconds += (clock.0[i] - clock.0[i - 1]).as_secs_f64();
                phase.steps += took.accepted;
                phase.iterations += took.iterations;
                phase.refused += took.refused;
            }
        }
        for (phase, Phase { t, seconds, steps, iterations, refused }) in PHASES.iter().zip(phases) {
            let runs = seeds as f64;
            let a_t0 = |count: u64| count as f64 / t.max(1.0);
            rows.push(format!(
                "| {name} | {phase} | {:.0} | {:.2} | {:.2} | {:.3} | {:.2} |",
                t / runs,
                1e3 * seconds / runs,
                a_t0(steps),
                a_t0(refused),
                iterations as f64 / steps.max(1) as f64
            ));
        }
        places.push(ends);
    }
    for ring in &places[1..3] {
        let near = ring.iter().zip(&places[0]).filter(|(a, b)| (**a - **b).abs() < 1e-2).count();
        assert!(near * 10 >= ring.len() * 9, "droplets clog elsewhere: {ring:?} and {:?}", places[0]);
    }
    println!("{seeds} runs from start to clog; CPU in ms a run, the rest in each t0 of the phase");
    println!("| scheme | phase | t0 a run | ms a run | steps | refused | Newton steps a step |");
    println!("|---|---|---:|---:|---:|---:|---:|");
    rows.iter().for_each(|row| println!("{row}"));
}

//! Laws of the liquid droplet, `dynamics = "darcy"`.

#[path = "common/single.rs"]
mod single;

use meniscus::physics::simd::{InstructionSet, best_instruction_set};
use meniscus::physics::simulate::{Context, Keeper, NoKeeper, RunEnded, Snapshot, go_on};
use meniscus::physics::walls::arrays::library::ArrayLibrary;
use meniscus::results::trajectory::{Outcome, Samples, Trajectory};
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

const CHANNEL: &str = "dynamics = \"darcy\"\nscene = \"channel\"\nh_start = -1.2\nh_end = 1.5\nv_t = 0.032\n\
                       sample_every = 1.0\n";
const ARRAY: &str = "dynamics = \"darcy\"\nscene = \"obstacles\"\nsigma_ob = 0.3\nw_ob = 0.2\nbox_size = 60.0\n";

fn run(keys: &str) -> Trajectory {
    let trajectory = single::run(keys, 1).unwrap_or_else(|failure| panic!("{keys}: {}", failure.reason));
    assert!(trajectory.energy_rise_max < 1e-10, "{keys}: energy rose by {:.1e}", trajectory.energy_rise_max);
    assert!(trajectory.area_error_max.is_some_and(|error| error < 5e-3), "{keys}: {:?}", trajectory.area_error_max);
    trajectory
}

fn through(w: f64, gamma: f64, n_vertices: usize) -> Trajectory {
    run(&format!("{CHANNEL}w = {w}\ngamma = {gamma}\nn_vertices = {n_vertices}\nlimits.t_max = 3000.0"))
}

/// When the centroid passed `h`.
fn passes(samples: &Samples, h: f64) -> f64 {
    let i = samples.h.windows(2).position(|pair| pair[0] < h && pair[1] >= h).expect("it passes");
    samples.t[i] + (h - samples.h[i]) / (samples.h[i + 1] - samples.h[i])
}

fn transit(trajectory: &Trajectory) -> f64 {
    passes(&trajectory.samples, 1.0) - passes(&trajectory.samples, -1.0)
}

#[test]
fn a_free_droplet_falls_at_its_terminal_speed_and_stays_round_at_any_tension() {
    for gamma in [0.01, 0.3, 10.0] {
        let fall = format!("{CHANNEL}w = 5.0\ngamma = {gamma}\nh_start = -50.0\nlimits.t_max = 100.0");
        let trajectory = run(&fall.replacen("h_start = -1.2\n", "", 1));
        assert!((trajectory.r_end / 3.2 - 1.0).abs() < 1e-6, "{gamma}: {}", trajectory.r_end);
        let roundest = Some(64.0 / PI * libm::tan(PI / 64.0));
        let same = |a: Option<f64>| a.zip(roundest).is_some_and(|(a, b)| (a / b - 1.0).abs() < 1e-6);
        assert!(same(trajectory.shape_max), "{gamma}: {:?}", trajectory.shape_max);
    }
}

#[test]
fn a_passage_takes_the_same_time_on_coarse_and_on_fine_rings() {
    let [coarse, fine] = [32, 64].map(|n| through(0.7, 0.8, n));
    let (a, b) = (transit(&coarse), transit(&fine));
    assert!((a / b - 1.0).abs() < 0.015, "{a} {b}");
    let stretch = |trajectory: &Trajectory| trajectory.shape_max.unwrap() - 1.0;
    assert!((stretch(&coarse) / stretch(&fine) - 1.0).abs() < 0.08);
}

#[test]
fn it_passes_an_orifice_just_below_the_static_threshold_and_sticks_just_above_it() {
    // Gamma_c = M/max dP/dh = 1.09 at w = 0.7, by the least perimeter P(h).
    assert_eq!(through(0.7, 1.06, 64).outcome, Outcome::Exited);
    assert_eq!(through(0.7, 1.12, 64).outcome, Outcome::Clogged);
}

/// How far a liquid of this tension sinks on a plate that it does not wet: the Young-Laplace equation in two
/// dimensions, `d(phi)/ds = k + z/Gamma`, from the apex (phi = 0) to the plate (phi = pi), at the k that gives the area
/// pi/4.
fn young_laplace(gamma: f64) -> f64 {
    let sessile = |k: f64| {
        let (mut x, mut z, mut phi, h) = (0.0_f64, 0.0_f64, 0.0_f64, 2e-5);
        let (mut area, mut moment) = (0.0, 0.0);
        while phi < PI {
            let middle = phi + 0.5 * h * (k + z / gamma);
            let (dx, dz) = (h * libm::cos(middle), h * libm::sin(middle));
            area += 2.0 * (x + 0.5 * dx) * dz;
            moment += 2.0 * (x + 0.5 * dx) * dz * (z + 0.5 * dz);
            phi += h * (k + (z + 0.5 * dz) / gamma);
            (x, z) = (x + dx, z + dz);
        }
        (area, z - moment / area)
    };
    let (mut low, mut high) = (0.01, 4.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if sessile(middle).0 > 0.25 * PI { low = middle } else { high = middle }
    }
    0.5 - sessile(low).1
}

#[test]
fn on_a_plate_it_sinks_as_the_young_laplace_equation_says() {
    for gamma in [0.3, 1.0] {
        let keys = format!("dynamics = \"darcy\"\nscene = \"plate\"\ngamma = {gamma}\nn_vertices = 128");
        let sunk = run(&keys).delta_s.expect("it settles");
        let exact = young_laplace(gamma);
        assert!((sunk - exact).abs() < 1e-3, "{gamma}: {sunk} {exact}");
    }
}

#[test]
fn it_clogs_in_the_same_place_whatever_the_drag_near_walls() {
    let keys = format!("{ARRAY}density = 1.0\ngamma = 0.8\n");
    let [free, slow] = ["", "b0 = 0.2\nlimits.t_max = 1e5"].map(|more| run(&format!("{keys}{more}")));
    assert_eq!((free.outcome, slow.outcome), (Outcome::Clogged, Outcome::Clogged));
    assert!(slow.t_end > 3.0 * free.t_end, "{} {}", slow.t_end, free.t_end);
    let overlap = free.overlap_max.max(slow.overlap_max);
    assert!(overlap < 1e-4, "the walls are hard: {overlap}");
}

#[test]
fn a_soft_droplet_that_meets_a_disc_head_on_breaks_in_two() {
    let keys =
        "dynamics = \"darcy\"\nscene = \"disc\"\nsigma_ob = 0.3\noffset = 0.005\ngamma = 0.05\nlimits.t_max = 500.0";
    let trajectory = run(keys);
    assert_eq!(trajectory.outcome, Outcome::Pinched);
    assert!(trajectory.t_end < 200.0 && trajectory.shape_max > Some(2.0));
}

#[test]
fn stiff_droplets_come_to_rest_in_dense_arrays() {
    let trajectory = run(&format!("{ARRAY}density = 1.0\ngamma = 10.0"));
    assert_eq!(trajectory.outcome, Outcome::Clogged);
    assert!(trajectory.ek_ratio_end < 1e-17);
}

/// A run in the array of this seed, which ends by itself.
fn among_obstacles(keys: &str, seed: u64) -> Trajectory {
    let keys = format!("{ARRAY}density = 1.0\nlimits.t_max = 3e4\n{keys}");
    single::run(&keys, seed).unwrap_or_else(|failure| panic!("{keys}, seed {seed}: {}", failure.reason))
}

#[test]
fn it_clogs_in_the_same_place_on_coarse_and_on_fine_rings_and_its_edges_stay_even() {
    for seed in [0, 2, 4, 5, 8] {
        let [coarse, fine] = [32, 64].map(|n| among_obstacles(&format!("gamma = 0.8\nn_vertices = {n}"), seed));
        assert_eq!((coarse.outcome, fine.outcome), (Outcome::Clogged, Outcome::Clogged), "seed {seed}");
        assert!((coarse.r_end - fine.r_end).abs() < 0.006, "seed {seed}: {} {}", coarse.r_end, fine.r_end);
        let outline = fine.outlines.last().expect("the last shape is kept");
        let n = outline.x.len();
        let edges: Vec<f64> = (0..n)
            .map(|i| libm::hypot(outline.x[(i + 1) % n] - outline.x[i], outline.y[(i + 1) % n] - outline.y[i]))
            .collect();
        let mean = edges.iter().sum::<f64>() / 64.0;
        assert!(edges.iter().all(|edge| *edge < 1.5 * mean), "seed {seed}: {edges:?}");
    }
}

#[test]
fn soft_droplets_that_hang_over_obstacles_end_without_a_failure() {
    for seed in 0..4 {
        let run = among_obstacles("gamma = 0.05\nn_vertices = 96\nlimits.distance = 6.0", seed);
        assert!(matches!(run.outcome, Outcome::Pinched | Outcome::Distance), "seed {seed}: {:?}", run.outcome);
        assert!(run.energy_rise_max < 1e-10, "seed {seed}: the energy rose by {:.1e}", run.energy_rise_max);
    }
}

#[test]
fn its_steps_do_not_depend_on_when_it_is_looked_at() {
    let keys = |every: f64| format!("{ARRAY}density = 1.0\ngamma = 0.8\nlimits.t_max = 60.0\nsample_every = {every}");
    let [often, seldom] = [0.5, 3.0].map(|every| run(&keys(every)));
    assert_eq!(often.refused, seldom.refused);
    for (i, t) in seldom.samples.t.iter().enumerate() {
        let j = often.samples.t.iter().position(|other| other == t).unwrap();
        assert_eq!(often.samples.r[j].to_bits(), seldom.samples.r[i].to_bits(), "at {t}");
    }
}

/// Keeps the snapshot of one check.
struct At {
    checks: u32,
    kept: Option<Snapshot>,
}

impl Keeper for At {
    fn wants(&mut self) -> bool {
        self.checks = self.checks.wrapping_sub(1);
        self.checks == 0
    }
    fn keep(&mut self, snapshot: Snapshot) {
        self.kept = Some(snapshot);
    }
}

fn ended(run: RunEnded) -> Trajectory {
    match run {
        RunEnded::Finished(trajectory) => *trajectory,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_run_that_is_taken_up_again_and_any_instruction_set_give_the_same_bits() {
    let keys = format!("{ARRAY}density = 1.0\ngamma = 0.2\nn_vertices = 40\nb0 = 0.1\nlimits.t_max = 80.0");
    let (job, _) = single::job(&keys, 3);
    let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
    let on = |instruction_set| Context { arrays: &arrays, instruction_set, stop: &stop };
    let mut keeper = At { checks: 41, kept: None };
    let whole = ended(go_on(&job, on(best_instruction_set()), None, &mut keeper).unwrap());
    let from = keeper.kept.expect("it came that far");
    let rest = ended(go_on(&job, on(best_instruction_set()), Some(&from), &mut NoKeeper).unwrap());
    assert_eq!(rest, whole);
    let plain = ended(go_on(&job, on(InstructionSet::fallback()), None, &mut NoKeeper).unwrap());
    assert_eq!(plain, whole);
}

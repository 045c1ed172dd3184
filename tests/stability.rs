//! Where simulations of droplets break: each hard case in short, against its limits; campaigns/stress.toml is the
//! overnight size. A run that crosses itself, swallows an obstacle or gains energy fails by itself, so a trajectory is
//! good news already.

#[path = "common/single.rs"]
mod single;

use meniscus::campaign::file::Campaign;
use meniscus::parameters::{ContactKind, Integrator, MASS, Model, regular_edge};
use meniscus::physics::motion::guard::GuardedMotion;
use meniscus::physics::motion::verlet::VerletMotion;
use meniscus::physics::motion::{Interruption, Motion};
use meniscus::physics::ring::Ring;
use meniscus::physics::ring::effects::RingEffects;
use meniscus::physics::ring::forces::area::Area;
use meniscus::physics::ring::forces::contact::Contact;
use meniscus::physics::ring::forces::drag::Drag;
use meniscus::physics::ring::forces::gravity::Gravity;
use meniscus::physics::ring::forces::tension::EdgeTension;
use meniscus::physics::simd::InstructionSet;
use meniscus::physics::simulate::stability::StabilityLimit;
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use meniscus::results::trajectory::{FailureClass, Outcome, Trajectory};
use single::{job, run};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const ARRAY: &str = "scene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\nbox_size = 40.0\n";
const DENSE: &str = "scene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\nbox_size = 40.0\ndensity = 0.7\n";

/// kappa of the linear spring.
const EVEN: f64 = std::f64::consts::FRAC_1_PI;

/// Runs a case by Verlet, in fixed implicit steps, and in steps that follow their error, if it takes these by itself;
/// overlap and energy must stay within what contact at this stiffness explains. Verlet must not take anything back.
/// Implicit steps of both kinds may, one in twenty. Where a droplet folds or its vertices pile up, steps that follow their
/// error find by refusals how long they may be, and fixed ones are not meant for it.
fn bears(keys: &str, seed: u64, overlap: f64) -> Trajectory {
    let run = |keys: &str, refusals: u64| {
        let trajectory = run(keys, seed).unwrap_or_else(|failure| panic!("{keys}\nseed {seed}: {failure}"));
        assert!(trajectory.energy_rise_max < 1e-6, "{keys}: energy rose by {:.1e}", trajectory.energy_rise_max);
        assert!(trajectory.overlap_max < overlap, "{keys}: overlap {:.1e}", trajectory.overlap_max);
        assert_eq!(trajectory.engulfed_t, None, "{keys}");
        assert!(trajectory.refused * 20 <= trajectory.steps * refusals, "{keys}: {} refused", trajectory.refused);
        trajectory
    };
    let point = job(keys, seed).0.point;
    let folds = matches!(&point.model, Model::Deformable(ring) if ring.gamma < 0.25);
    if point.stepping.integrator == Integrator::Verlet {
        return run(keys, 0);
    }
    run(&format!("integrator = \"verlet\"\n{keys}"), 0);
    if folds {
        return run(keys, 60);
    }
    run(&format!("integrator = \"implicit\"\n{keys}"), 1);
    run(keys, 1)
}

fn area_error(trajectory: &Trajectory) -> f64 {
    trajectory.area_error_max.expect("a ring has an area")
}

#[test]
fn the_softest_and_the_stiffest_droplet_run_in_an_array() {
    let soft = bears(&format!("{DENSE}gamma = 0.01\nlimits.t_max = 150.0"), 0, 0.02);
    assert!(soft.shape_max.unwrap() > 2.0 && area_error(&soft) < 1e-3, "it wraps round obstacles");
    let stiff = bears(&format!("{DENSE}gamma = 10.0\nlimits.t_max = 150.0"), 0, 0.01);
    // The pressure Gamma/R = 20 over K_a is 0.25% of the area.
    assert!(stiff.shape_max.unwrap() < 1.01 && area_error(&stiff) < 3e-3);
}

#[test]
fn springs_are_weak_by_themselves_unless_vertices_would_pile_up_where_a_droplet_may_hang() {
    let kappa = |keys: &str| match &job(keys, 0).0.point.model {
        Model::Deformable(ring) => ring.kappa,
        Model::Soft(_) => panic!("{keys}: no ring"),
    };
    let channel = "scene = \"channel\"\nw = 0.4\n";
    assert_eq!([kappa(&format!("{DENSE}gamma = 0.3")), kappa(&format!("{channel}gamma = 0.16"))], [1e-3; 2]);
    assert_eq!(kappa(&format!("{DENSE}gamma = 0.1\nkappa = 1e-2")), 1e-2, "what is written holds");
    assert!((kappa(&format!("{DENSE}gamma = 0.1")) / EVEN - 1.0).abs() < 1e-3);
}

#[test]
fn springs_along_the_ring_may_be_weak_or_strong() {
    for kappa in [0.0, 1e-4, 1e-3, EVEN] {
        let run = bears(&format!("{DENSE}gamma = 0.3\nkappa = {kappa}\nlimits.t_max = 150.0"), 1, 0.01);
        assert!(area_error(&run) < 1e-3);
    }
}

#[test]
fn vertices_that_pile_up_below_a_wrapped_droplet_stay_apart() {
    let keys = format!("{DENSE}gamma = 0.05\nkappa = 1e-3\nn_vertices = 64\ne_w = 1e5\nlimits.t_max = 150.0");
    let piled = run(&keys, 0).unwrap();
    assert!(piled.shape_max.unwrap() > 3.0 && area_error(&piled) < 5e-3 && piled.energy_rise_max < 0.01);
}

#[test]
fn the_literal_wall_lets_nothing_in() {
    let (literal, integrator) = (format!("{DENSE}gamma = 1.09\nwall = \"per_vertex\"\n"), Integrator::Adaptive);
    assert_eq!(job(&literal, 0).1, integrator);
    let run = run(&format!("{literal}limits.t_max = 150.0"), 0).unwrap();
    assert!(run.overlap_max < 1e-8 && run.energy_rise_max < 1e-6 && area_error(&run) < 1e-3);
}

#[test]
fn a_stiff_area_keeps_it() {
    let run = bears(&format!("{DENSE}gamma = 1.09\nk_a = 1e6\nlimits.t_max = 100.0"), 0, 0.01);
    assert!(area_error(&run) < 1e-5);
}

#[test]
fn drag_in_contact_stops_nothing_for_good_and_gives_no_energy() {
    let run = bears(&format!("{DENSE}gamma = 0.3\nb0 = 0.4\nlimits.t_max = 150.0"), 0, 0.01);
    assert!(run.r_end > 0.2, "{}", run.r_end);
}

#[test]
fn soft_droplets_squeeze_through_narrow_channels() {
    let channel = "scene = \"channel\"\nv_t = 0.08\nh_start = -1.2\nh_end = 1.0\nsample_every = 1.0\n";
    let at = |w: f64, gamma: f64| bears(&format!("{channel}w = {w}\ngamma = {gamma}\n"), 0, 0.01);
    let wide = at(0.4, 0.16);
    assert_eq!(wide.outcome, Outcome::Exited);
    let narrow = at(0.2, 0.05);
    assert_eq!(narrow.outcome, Outcome::Exited);
    assert!(narrow.shape_max > wide.shape_max && area_error(&narrow) < 1e-3);
}

#[test]
fn coarse_and_fine_rings_run() {
    for n_vertices in [32, 1024] {
        let run = bears(&format!("{DENSE}gamma = 1.09\nn_vertices = {n_vertices}\nlimits.t_max = 60.0"), 0, 0.01);
        assert!(area_error(&run) < 1e-3);
    }
}

#[test]
fn a_droplet_that_meets_an_obstacle_head_on_stays_on_its_axis() {
    let disc = "scene = \"disc\"\nsigma_ob = 0.3\nlimits.t_max = 60.0\n";
    for gamma in [0.3, 1.09, 10.0] {
        let run = bears(&format!("{disc}gamma = {gamma}"), 0, 0.01);
        assert!(run.samples.y.iter().all(|y| y.abs() < 1e-6), "gamma = {gamma}: {:?}", run.samples.y.last());
        assert!(run.samples.v_g.last().unwrap().abs() < 0.5, "it is held up");
    }
}

#[test]
fn a_droplet_is_blown_up_and_held_in_an_array_without_free_room() {
    let run = bears(&format!("{ARRAY}density = \"saturated\"\ngamma = 1.09\nlimits.t_max = 100.0"), 0, 0.05);
    assert!(run.r_end < 1.0 && area_error(&run) < 1e-3);
}

#[test]
fn nine_tenths_of_the_stability_limit_run_and_eleven_tenths_are_refused() {
    let keys = format!("{DENSE}gamma = 10.0\n");
    let limit = StabilityLimit::of(&job(&keys, 0).0.point).dt_max;
    bears(&format!("{keys}dt = {}\nlimits.t_max = 60.0", 0.9 * limit), 0, 0.01);
    let text = format!(
        "name = \"one\"\nmodel = \"DP\"\ndynamics = \"vertex\"\nruns_per_point = 1\n{keys}dt = {}",
        1.1 * limit
    );
    let refusal = Campaign::parse("one.toml", &text).unwrap_err().render(false);
    assert!(refusal.contains("stability limit") && refusal.contains("tension"), "{refusal}");
}

const N: usize = 100;

/// Nobody stops these droplets.
static NEVER: AtomicBool = AtomicBool::new(false);

/// A droplet that falls on two discs, its centre starting at `centre`.
fn falling(centre: [f64; 2], dt: f64, gamma: f64) -> VerletMotion {
    let discs = ObstacleArray::from_centres(40.0, 0.15, &[10.7, 10.8], &[10.3, 9.6]);
    let eps = 0.1 * regular_edge(N);
    let effects = RingEffects {
        tension: EdgeTension::Line { gamma },
        area: Area { stiffness: 1e4, rest: MASS },
        gravity: Gravity::new(N),
        drag: Drag::Far { rate: 33.0 },
        eps_squared: eps * eps,
        walls: Box::new(Contact::new(
            Arc::new(discs),
            ContactKind::Edge,
            N,
            1e4 / N as f64,
            0.0123,
            InstructionSet::new(),
        )),
        others: Vec::new(),
    };
    VerletMotion::start(Ring::regular(N, centre, 0.5), effects, dt, InstructionSet::new())
}

#[test]
fn a_job_shifted_by_a_hundred_thousand_diameters_has_the_same_bits() {
    // 2500 boxes of 40.
    let [mut here, mut there] = [10.0, 10.0 + 1e5].map(|x| falling([x, 10.0], 1e-3, 1.0));
    for _ in 0..20 {
        here.advance(1000, &NEVER).unwrap();
        there.advance(1000, &NEVER).unwrap();
        here.follow();
        there.follow();
    }
    assert_eq!(here.ring.x, there.ring.x);
    assert_eq!(here.ring.uy, there.ring.uy);
    assert!(here.observe().contacts > 0, "it has come to the discs");
}

#[test]
fn a_guarded_run_has_the_bits_of_an_unguarded_one_until_its_energy_rises() {
    let mut plain = falling([10.0, 10.0], 1e-3, 1.0);
    let mut guarded = GuardedMotion::new(falling([10.0, 10.0], 1e-3, 1.0));
    for _ in 0..5 {
        plain.advance(1000, &NEVER).unwrap();
        guarded.advance(1000, &NEVER).unwrap();
    }
    assert_eq!((&plain.ring.x, &plain.ring.ux), (&guarded.motion.ring.x, &guarded.motion.ring.ux));
    assert_eq!(guarded.refused(), 0);
}

#[test]
fn a_stretch_whose_steps_are_too_long_is_taken_in_shorter_ones_and_ends_at_the_same_place() {
    // Area and tension allow steps of 3.6e-3 here: these need two halvings and three.
    for (dt, steps) in [(8e-3, 125), (16e-3, 64)] {
        let mut fine = falling([10.0, 10.0], 1e-3, 1.0);
        let mut guarded = GuardedMotion::new(falling([10.0, 10.0], dt, 1.0));
        for _ in 0..40 {
            fine.advance((dt * steps as f64 * 1e3).round() as u64, &NEVER).unwrap();
            guarded.advance(steps, &NEVER).unwrap();
        }
        assert!(guarded.refused() > 1);
        let (a, b) = (fine.observe(), guarded.motion.observe());
        assert!((a.x - b.x).abs() < 1e-3 && (a.y - b.y).abs() < 1e-3, "dt = {dt}: {} {}, {} {}", a.x, a.y, b.x, b.y);
    }
}

#[test]
fn a_droplet_in_free_fall_falls_as_galileo_says_however_often_its_steps_are_halved() {
    // The scheme is exact for a constant force. These steps need halvings at once.
    let mut motion = falling([20.0, 20.0], 16e-3, 1.0);
    motion.effects.drag = Drag::Far { rate: 0.0 };
    let mut guarded = GuardedMotion::new(motion);
    let start = guarded.motion.observe();
    (0..5).for_each(|_| guarded.advance(64, &NEVER).unwrap());
    assert!(guarded.refused() > 1, "{}", guarded.refused());
    let (end, t) = (guarded.motion.observe(), 5.0 * 64.0 * 16e-3);
    assert!((end.velocity - start.velocity - t).abs() < 1e-9, "{} {t}", end.velocity);
    assert!((end.x - start.x - (start.velocity + 0.5 * t) * t).abs() < 1e-7, "{}", end.x);
}

#[test]
fn a_run_that_gains_energy_in_the_shortest_steps_too_ends_as_unstable_where_it_was_sound() {
    let mut hopeless = GuardedMotion::new(falling([10.0, 10.0], 0.3, 1.0));
    let interruption = (0..20).find_map(|_| hopeless.advance(10, &NEVER).err()).unwrap();
    let Interruption::Failed(failure) = interruption else { panic!("{interruption:?}") };
    assert_eq!(failure.class, FailureClass::Unstable);
    assert!(failure.reason.contains("rose") && hopeless.motion.ring.x.iter().all(|x| x.is_finite()), "{failure}");
}

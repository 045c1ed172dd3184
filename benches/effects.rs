//! What each effect of a droplet costs, and that an absent one is free.
//!
//! ```text
//! cargo bench --bench effects [-- ROUNDS]
//! ```
//!
//! Each line is a whole job (start, checks, samples; 50 t0 against 10 t0, so that the start cancels), as a ratio to the
//! bare kernel: a ring with tension, perimeter, area, weight and far drag, and nothing that could act besides. Rounds
//! go through all lines in turn, and the medians are compared, so that a busy machine troubles all alike. Every droplet
//! must fall as far as theory says before it counts.

#![allow(missing_docs, reason = "a program")]
#![allow(clippy::print_stdout, reason = "a program that answers on stdout")]
#![allow(clippy::unwrap_used, reason = "a bench that cannot go on has failed")]

#[path = "../tests/common/single.rs"]
mod single;

use meniscus::parameters::Deformable;
use meniscus::physics::motion::verlet::VerletMotion;
use meniscus::physics::ring::Ring;
use meniscus::physics::ring::effects::RingEffects;
use meniscus::physics::ring::forces::contact::Contact;
use meniscus::physics::ring::forces::drag::Drag;
use meniscus::physics::ring::forces::gravity::Gravity;
use meniscus::physics::ring::forces::tension::EdgeTension;
use meniscus::physics::simd::best_instruction_set;
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const N: usize = 256;
const V_T: f64 = 0.03;
const SHORT: u64 = 10;
const LONG: u64 = 50;

/// A droplet that falls far from everything: what acts is in the keys.
const FREE: &str =
    "scene = \"channel\"\nw = 0.7\ngamma = 1.0\nv_t = 0.03\nh_start = -20.0\ndt = 5e-4\nsample_every = 10.0\n";
/// One that hangs on obstacles.
const HUNG: &str = "scene = \"disc\"\nsigma_ob = 0.3\ngamma = 1.0\nh_start = -0.66\ndt = 5e-4\nsample_every = 10.0\n";

/// Lines of the table: what acts, and the keys of the job.
const LINES: &[(&str, &str, &str)] = &[
    ("all that is absent", FREE, "self_contact = \"off\""),
    ("kappa = 0: no perimeter", FREE, "self_contact = \"off\"\nkappa = 0.0"),
    ("linear spring", FREE, "self_contact = \"off\"\nkappa = 0.3183018965200345"),
    ("self-contact, nothing folded", FREE, ""),
    ("hydrostatic gravity", FREE, "self_contact = \"off\"\ngravity = \"centroid\"\nkappa = 0.32"),
    ("near-wall drag", FREE, "self_contact = \"off\"\nb0 = 0.1"),
    ("contact with one disc", HUNG, "self_contact = \"off\""),
    ("contact and near-wall drag", HUNG, "self_contact = \"off\"\nb0 = 0.1"),
];

/// Nanoseconds of the bare kernel per vertex and step.
fn bare() -> f64 {
    let droplet = Deformable { n_vertices: N, ..Deformable::of_tension(1.0) };
    let nowhere = Arc::new(ObstacleArray::from_centres(40.0, 0.15, &[], &[]));
    let walls = Contact::new(nowhere, droplet.contact, N, droplet.k_w(), droplet.delta, best_instruction_set());
    let effects = RingEffects {
        gravity: Gravity::new(N),
        drag: Drag::Far { rate: 1.0 / V_T },
        ..RingEffects::elastic(&droplet, Box::new(walls))
    };
    let ring = Ring::regular(N, [20.0, 20.0], Ring::regular_radius(N));
    let mut motion = VerletMotion::start(ring, effects, 5e-4, best_instruction_set());
    let begin = Instant::now();
    motion.advance((LONG - SHORT) * 2000, &AtomicBool::new(false)).unwrap();
    let time = begin.elapsed().as_secs_f64();
    assert!((motion.observe().velocity / V_T - 1.0).abs() < 1e-9, "it falls at V_t");
    time * 1e9 / ((LONG - SHORT) * 2000) as f64 / N as f64
}

/// The same of a whole job.
fn job(scene: &str, keys: &str) -> f64 {
    let time = |t_max: u64| {
        let begin = Instant::now();
        let run = single::run(&format!("{scene}{keys}\nlimits.t_max = {t_max}.0\n"), 0).unwrap();
        // Hydrostatic pressure and distant walls change the speed a little.
        if scene == FREE && !keys.contains("gravity") && !keys.contains("b0") {
            assert!((run.samples.v_g.last().unwrap() - 1.0).abs() < 1e-6, "{keys}: it falls at V_t");
        }
        begin.elapsed().as_secs_f64()
    };
    (time(LONG) - time(SHORT)) * 1e9 / ((LONG - SHORT) * 2000) as f64 / N as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let linear = Deformable { n_vertices: N, kappa: 0.3183018965200345, ..Deformable::of_tension(1.0) };
    assert!(matches!(EdgeTension::of(&linear), EdgeTension::Linear { .. }), "the line of the linear spring is one");
    let rounds = std::env::args().skip(1).find_map(|word| word.parse().ok()).unwrap_or(15);
    let (mut base, mut times) = (Vec::new(), vec![Vec::new(); LINES.len()]);
    for _ in 0..rounds {
        base.push(bare());
        for (times, (_, scene, keys)) in times.iter_mut().zip(LINES) {
            times.push(job(scene, keys));
        }
    }
    let base = median(base);
    println!("bare kernel: {base:.3} ns a vertex and step, N_v = {N}, medians of {rounds} rounds");
    for (times, (name, ..)) in times.into_iter().zip(LINES) {
        let time = median(times);
        println!("{name:30} {time:.3} ns   ratio {:.3}", time / base);
    }
}

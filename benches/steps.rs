//! Time of a step of one droplet, in the words of `benches/baseline/plain_loop.cpp`, so that both can be run in turn.
//!
//! ```text
//! cargo bench --bench steps -- SCENE [N_v] [STEPS]      SCENE: free_general, free_linear, contact, implicit, soft
//! ```
//!
//! prints the scene, N_v, the steps, nanoseconds per vertex and step (per Newton step for `implicit`, per step for
//! `soft`), and the mean x at the end, by which the answer is checked. `scripts/compare-baseline` does both.

#![allow(missing_docs, reason = "a program")]
#![allow(clippy::print_stdout, reason = "a program that answers on stdout")]

use meniscus::parameters::{ContactKind, MASS, regular_edge};
use meniscus::physics::motion::Motion;
use meniscus::physics::motion::implicit::ImplicitMotion;
use meniscus::physics::motion::verlet::VerletMotion;
use meniscus::physics::point::{SoftEffects, SoftMotion};
use meniscus::physics::ring::Ring;
use meniscus::physics::ring::effects::RingEffects;
use meniscus::physics::ring::forces::area::Area;
use meniscus::physics::ring::forces::contact::Contact;
use meniscus::physics::ring::forces::drag::Drag;
use meniscus::physics::ring::forces::gravity::Gravity;
use meniscus::physics::ring::forces::tension::EdgeTension;
use meniscus::physics::simd::best_instruction_set;
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const GAMMA: f64 = 1.0;
const V_T: f64 = 0.03;
const DT: f64 = 1e-3;

/// Nobody stops these droplets.
static NEVER: AtomicBool = AtomicBool::new(false);

/// Where the droplet starts: discs need positive coordinates.
const CENTRE: [f64; 2] = [20.0, 20.0];

/// The discs of the baseline's scene `contact`, or none.
fn discs(some: bool) -> Arc<ObstacleArray> {
    let count = if some { 6 } else { 0 };
    let x: Vec<f64> = (0..count).map(|k| CENTRE[0] + 0.72 + 0.05 * f64::from(k % 2)).collect();
    let y: Vec<f64> = (0..count).map(|k| CENTRE[1] - 1.0 + 0.4 * f64::from(k)).collect();
    Arc::new(ObstacleArray::from_centres(40.0, 0.15, &x, &y))
}

fn effects(n: usize, tension: EdgeTension, discs: Arc<ObstacleArray>) -> RingEffects {
    let rest = regular_edge(n);
    RingEffects {
        tension,
        area: Area { stiffness: 1e4, rest: MASS },
        gravity: Gravity::new(n),
        drag: Drag::Far { rate: 1.0 / V_T },
        eps_squared: 0.01 * rest * rest,
        walls: Box::new(Contact::new(discs, ContactKind::Edge, n, 1e4 / n as f64, rest, best_instruction_set())),
        others: Vec::new(),
    }
}

fn general(n: usize) -> EdgeTension {
    EdgeTension::Springs { gamma: GAMMA, stiffness: 1e-3 * GAMMA * n as f64, rest: regular_edge(n) }
}

fn ring(n: usize) -> Ring {
    Ring::regular(n, CENTRE, Ring::regular_radius(n))
}

fn mean_x(ring: &Ring) -> f64 {
    ring.x[..ring.n].iter().sum::<f64>() / ring.n as f64 + ring.origin[0] - CENTRE[0]
}

/// Nanoseconds that `run` takes.
fn nanoseconds(run: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    run();
    begin.elapsed().as_secs_f64() * 1e9
}

/// Nanoseconds per vertex and step, and the mean x.
fn verlet(n: usize, steps: u64, tension: EdgeTension, discs: Arc<ObstacleArray>) -> (f64, f64) {
    let mut motion = VerletMotion::start(ring(n), effects(n, tension, discs), DT, best_instruction_set());
    let time = nanoseconds(|| motion.advance(steps, &NEVER).expect("nobody stops it"));
    (time / steps as f64 / n as f64, mean_x(&motion.ring))
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let word = |i: usize| words.get(i).map(String::as_str);
    let number = |i: usize, default: u64| word(i).and_then(|text| text.parse().ok()).unwrap_or(default);
    let (n, steps) = (number(1, 256) as usize, number(2, 20_000));
    let rest = regular_edge(n);
    let all = ["free_general", "free_linear", "contact", "implicit", "soft"];
    for scene in all.into_iter().filter(|scene| word(0).is_none_or(|asked| asked == *scene)) {
        let (time, x) = match scene {
            "free_general" => verlet(n, steps, general(n), discs(false)),
            "free_linear" => verlet(n, steps, EdgeTension::Linear { stiffness: GAMMA / rest, rest }, discs(false)),
            "contact" => verlet(n, steps, general(n), discs(true)),
            "implicit" => {
                let mut motion =
                    ImplicitMotion::start(ring(n), effects(n, general(n), discs(true)), 0.02, best_instruction_set());
                let time = nanoseconds(|| motion.advance(steps / 20, &NEVER).expect("this scene is an easy one"));
                (time / motion.counts.iterations as f64, mean_x(&motion.ring))
            }
            _ => {
                let effects = SoftEffects { stiffness: 10.0, weight: MASS, far_rate: 1.0 / V_T, b0: 0.0, alpha: 1.0 };
                let mut motion = SoftMotion::start(CENTRE, effects, DT, discs(true), best_instruction_set());
                let time = nanoseconds(|| motion.advance(steps));
                (time / steps as f64, motion.observe().x - CENTRE[0])
            }
        };
        println!("{scene} {n} {steps} {time:.3} {x:.12}");
    }
}

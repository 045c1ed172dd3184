//! The static theory against the liquid of `dynamics = "darcy"`, which shares no code with it.

use crate::parameters::MASS;
use crate::physics::liquid::dissipation::Dissipation;
use crate::physics::liquid::{polygon::Polygon, potential::Potential, self_contact::SelfContact};
use crate::physics::motion::{Motion, darcy::DarcyMotion};
use crate::physics::simd::best_instruction_set;
use crate::physics::walls::{arrays::obstacles::ObstacleArray, wall::Walls, wedge::ChannelWalls};
use crate::study::threshold::{End, Passage, Throat};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const DELTA: f64 = PI / 256.0;
const K_A: f64 = 1e4;
const V_T: f64 = 0.032;

/// Diameter of the discs.
const SIGMA_OB: f64 = 0.3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Passed,
    Stuck,
    /// A film of liquid closed: the droplet parts.
    Parted,
}

/// What becomes of a liquid droplet of `n` vertices that comes down on the axis from `h`.
fn fate<W: Walls>(walls: &Arc<W>, gamma: f64, n: usize, h: f64) -> Fate {
    follow(walls, gamma, n, [h, 0.0]).0
}

/// The same for one that starts anywhere, and where its centroid is at last.
fn follow<W: Walls>(walls: &Arc<W>, gamma: f64, n: usize, from: [f64; 2]) -> (Fate, [f64; 2]) {
    // The stiffness that campaigns take in channels.
    let k_w = (5e7 * gamma.max(1.0)).min(1e8) / n as f64;
    let potential = Potential {
        walls: walls.clone(),
        gamma,
        k_a: K_A,
        rest: MASS,
        weight: MASS,
        k_w,
        reach: walls.surface() + 0.5 * DELTA,
        folds: Some(SelfContact::new(n, DELTA, k_w)),
    };
    let (set, stop, step) = (best_instruction_set(), AtomicBool::new(false), 1.0 / 8.0);
    let dissipation = Dissipation::new(n, 1.0 / V_T, None, set);
    let mut motion = DarcyMotion::start(ring(n), from, potential, dissipation, [step, 3e-4], set);
    let mut place = from;
    for _ in 0..2000 {
        if motion.advance(40, &stop).is_err() || motion.pinched().is_some() {
            return (Fate::Parted, place);
        }
        motion.follow();
        let seen = motion.observe();
        place = [seen.x, seen.y];
        if seen.x > 0.4 {
            return (Fate::Passed, place);
        }
        if seen.kinetic < 1e-13 * 0.5 * MASS * V_T * V_T {
            break;
        }
    }
    (Fate::Stuck, place)
}

/// An even polygon of the droplet's area.
fn ring(n: usize) -> Polygon {
    let radius = (2.0 * MASS / (n as f64 * libm::sin(2.0 * PI / n as f64))).sqrt();
    let angle = |k: usize| 2.0 * PI * k as f64 / n as f64;
    Polygon {
        x: (0..n).map(|k| radius * libm::cos(angle(k))).collect(),
        y: (0..n).map(|k| radius * libm::sin(angle(k))).collect(),
    }
}

fn pair(gap: f64) -> Arc<ObstacleArray> {
    let (side, c) = (100.0, 0.5 * (gap + SIGMA_OB));
    Arc::new(ObstacleArray::from_centres(side, 0.5 * SIGMA_OB, &[0.0, 0.0], &[c, side - c]))
}

/// Gamma_c of a droplet whose area gives way as `K_a` says: `a = a0 - Gamma p/K_a` with the pressure p over the
/// tension.
fn threshold(throat: Throat) -> f64 {
    let mut area = MASS;
    let mut gamma = f64::NAN;
    for _ in 0..6 {
        let passage = Passage::of(throat, area).expect("it is followed");
        gamma = passage.gamma_c();
        area = MASS - gamma * passage.steepest.expect("it touches").pressure / K_A;
    }
    gamma
}

#[test]
fn a_liquid_droplet_passes_below_the_threshold_of_statics_and_sticks_above_it() {
    let channel = (Arc::new(ChannelWalls::new(0.7, 45.0, 0.1)), threshold(Throat::channel(0.7, 45.0, 0.1, DELTA)));
    let discs = (pair(0.6), threshold(Throat::discs(0.6, SIGMA_OB, DELTA)));
    for (share, expected) in [(0.98, Fate::Passed), (1.005, Fate::Stuck)] {
        assert_eq!(fate(&channel.0, share * channel.1, 64, -0.6), expected, "channel, {share}");
        assert_eq!(fate(&discs.0, share * discs.1, 64, -0.7), expected, "discs, {share}");
    }
}

#[test]
fn off_a_narrow_pair_of_small_discs_it_slides_sideways_where_statics_on_the_axis_would_hold_it() {
    let throat = Throat::discs(0.2, SIGMA_OB, DELTA);
    assert_eq!(Passage::of(throat, MASS).expect("it is followed").end, End::Around);
    let (gamma, walls, beside) = (threshold(throat), pair(0.2), [-0.8, 0.01]);
    assert_eq!(follow(&walls, 8.0 * gamma, 64, beside).0, Fate::Stuck);
    let (soft, [_, y]) = follow(&walls, 1.2 * gamma, 64, beside);
    assert!(soft == Fate::Passed && y.abs() > 0.5, "{soft:?} at {y}");
}

/// The largest tension that does not stick and the smallest that does, to 0.3%.
fn bracket<W: Walls>(walls: &Arc<W>, n: usize, about: f64, h: f64) -> ([f64; 2], Fate) {
    let (mut low, mut high, mut last) = (0.9 * about, 1.1 * about, Fate::Passed);
    while high / low > 1.003 {
        let middle = (low * high).sqrt();
        match fate(walls, middle, n, h) {
            Fate::Stuck => high = middle,
            other => (low, last) = (middle, other),
        }
    }
    ([low, high], last)
}

#[test]
#[ignore = "a table for docs/physics.md, five minutes"]
fn thresholds_of_dynamics_and_of_statics() {
    let line = |name: String, throat: Throat, n: usize, ([low, high], last): ([f64; 2], Fate)| {
        let (hard, soft) = (Passage::of(throat, MASS).expect("it is followed").gamma_c(), threshold(throat));
        let off = |gamma: f64| 100.0 * (gamma / soft - 1.0);
        println!("{name}, N_v = {n}: statics {hard:.5}, with K_a {soft:.5}; dynamics {low:.5} ({last:?}) .. {high:.5}");
        println!("    off by {:.2} .. {:.2} %", off(low), off(high));
    };
    for n in [64, 96] {
        for (w, tip) in [(0.4, 0.0), (0.7, 0.0), (0.9, 0.0), (0.4, 0.05), (0.7, 0.05), (0.9, 0.05)] {
            let (walls, throat) = (Arc::new(ChannelWalls::new(w, 45.0, tip)), Throat::channel(w, 45.0, tip, DELTA));
            line(format!("w = {w}, tip {tip}"), throat, n, bracket(&walls, n, threshold(throat), -0.7));
        }
        for gap in [0.5, 0.7] {
            let (walls, throat) = (pair(gap), Throat::discs(gap, SIGMA_OB, DELTA));
            line(format!("discs, gap {gap}"), throat, n, bracket(&walls, n, threshold(throat), -0.7));
        }
    }
}

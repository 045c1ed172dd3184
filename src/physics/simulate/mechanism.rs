//! How a clog holds: by wrapping, by squeezing, or otherwise.
//!
//! The support of an obstacle is the part of its load against gravity, `s_i = max(0, -F_x,i)`; `S = sum s_i`. With the
//! obstacles sorted by `s_i`, the largest first, the first rule that is fulfilled names the mechanism:
//!
//! | mechanism | rule |
//! |---|---|
//! | wrap | one obstacle carries `s_1 >= 0.7 S`, and along its contact the ring turns by 60 degrees or more |
//! | squeeze | two carry `s_1 + s_2 >= 0.8 S`, each `s_i >= 0.15 S`, push towards each other, and the throat is filled |
//! | hybrid | any other support |
//!
//! Two obstacles push towards each other if the one at larger y has `F_y < 0` and the other `F_y > 0`. The droplet
//! fills the throat between them if the midpoint of the two contacts lies inside the droplet.
//!
//! A soft particle has no ring that could bend, so it never wraps, and its squeeze does not need a filled throat.
//!
//! Shares and angle are a choice of this program: [C24] names the cases, but not their limits. Outlines hold all that
//! the rule needs, so other limits can be tried on finished runs.

use crate::results::outline::{LoadRecord, Outline};
use crate::results::trajectory::Mechanism;

/// Smallest share of the support of an obstacle that is wrapped.
const WRAP_SHARE: f64 = 0.7;

/// Smallest angle by which the ring turns round an obstacle that it wraps, in degrees.
const WRAP_TURN: f64 = 60.0;

/// Smallest share of the support of two obstacles together, between which a droplet is squeezed.
const SQUEEZE_SHARE: f64 = 0.8;

/// Smallest share of each of these two.
const SQUEEZE_LEAST: f64 = 0.15;

/// The mechanism; `None` if nothing pushes against gravity.
///
/// ```
/// use meniscus::physics::simulate::mechanism;
/// use meniscus::results::{outline::{LoadRecord, Outline}, trajectory::Mechanism};
/// let load = |obstacle, y, fy| LoadRecord { obstacle, x: 0.5, y, fx: -0.4, fy, turn: 0.1 };
/// let loads = vec![load(7, -0.4, 0.3), load(9, 0.4, -0.3)];
/// let point = Outline { t: 0.0, x: vec![0.0], y: vec![0.0], loads };
/// assert_eq!(mechanism::of(&point), Some(Mechanism::Squeeze));
/// ```
pub fn of(outline: &Outline) -> Option<Mechanism> {
    let support = |load: &LoadRecord| (-load.fx).max(0.0);
    let total: f64 = outline.loads.iter().map(support).sum();
    if !(total > 0.0) {
        return None;
    }
    let mut shares: Vec<(f64, &LoadRecord)> = outline.loads.iter().map(|load| (support(load) / total, load)).collect();
    // The sort is stable: equal shares stay in the order of the obstacles.
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    let is_ring = outline.x.len() > 1;
    let wraps = |&(share, load): &(f64, &LoadRecord)| share >= WRAP_SHARE && load.turn.to_degrees() >= WRAP_TURN;
    Some(match shares.as_slice() {
        [first, ..] if is_ring && wraps(first) => Mechanism::Wrap,
        [(a, first), (b, second), ..]
            if a + b >= SQUEEZE_SHARE
                && *b >= SQUEEZE_LEAST
                && face_each_other(first, second)
                && (!is_ring || fills_throat(outline, first, second)) =>
        {
            Mechanism::Squeeze
        }
        _ => Mechanism::Hybrid,
    })
}

/// Whether two obstacles push towards each other.
fn face_each_other(a: &LoadRecord, b: &LoadRecord) -> bool {
    let (lower, upper) = if a.y < b.y { (a, b) } else { (b, a) };
    lower.fy > 0.0 && upper.fy < 0.0
}

fn fills_throat(outline: &Outline, a: &LoadRecord, b: &LoadRecord) -> bool {
    outline.contains(0.5 * (a.x + b.x), 0.5 * (a.y + b.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A load at `(x, y)` of `force`, along which the ring turns by `degrees`.
    fn load(obstacle: u32, [x, y]: [f64; 2], [fx, fy]: [f64; 2], degrees: f64) -> LoadRecord {
        LoadRecord { obstacle, x, y, fx, fy, turn: degrees.to_radians() }
    }

    /// A round droplet at the origin with these loads.
    fn ring(loads: &[LoadRecord]) -> Outline {
        let (y, x) = (0..64).map(|i| libm::sincos(f64::from(i) * PI / 32.0)).map(|(s, c)| (0.5 * s, 0.5 * c)).unzip();
        Outline { t: 1.0, x, y, loads: loads.to_vec() }
    }

    fn point(loads: &[LoadRecord]) -> Outline {
        Outline { t: 1.0, x: vec![0.0], y: vec![0.0], loads: loads.to_vec() }
    }

    const LOWER: [f64; 2] = [0.4, -0.3];
    const UPPER: [f64; 2] = [0.4, 0.3];

    #[test]
    fn a_droplet_bent_round_one_obstacle_wraps_it() {
        let bent = load(3, [0.4, 0.0], [-0.8, 0.1], 75.0);
        assert_eq!(of(&ring(&[bent])), Some(Mechanism::Wrap));
        let aside = load(5, UPPER, [-0.3, -0.1], 10.0);
        assert_eq!(of(&ring(&[aside, bent])), Some(Mechanism::Wrap), "0.73 of the support is most of it");
        let more = load(5, UPPER, [-0.4, 0.1], 10.0);
        assert_eq!(of(&ring(&[more, bent])), Some(Mechanism::Hybrid), "0.67 is not");
        let flat = load(3, [0.4, 0.0], [-0.8, 0.0], 45.0);
        assert_eq!(of(&ring(&[flat])), Some(Mechanism::Hybrid), "nothing bends");
    }

    #[test]
    fn a_droplet_between_two_obstacles_that_close_the_throat_squeezes() {
        let (lower, upper) = (load(1, LOWER, [-0.5, 0.9], 20.0), load(2, UPPER, [-0.3, -0.9], 20.0));
        assert_eq!(of(&ring(&[lower, upper])), Some(Mechanism::Squeeze));
        assert_eq!(of(&ring(&[upper, lower])), Some(Mechanism::Squeeze), "whatever their order");
        let third = load(4, [-0.2, 0.4], [-0.15, -0.1], 5.0);
        assert_eq!(of(&ring(&[lower, upper, third])), Some(Mechanism::Squeeze), "84% is enough");
        let third = load(4, [-0.2, 0.4], [-0.25, -0.1], 5.0);
        assert_eq!(of(&ring(&[lower, upper, third])), Some(Mechanism::Hybrid), "76% is not");
        let light = load(2, UPPER, [-0.08, -0.9], 20.0);
        assert_eq!(of(&ring(&[lower, light])), Some(Mechanism::Hybrid), "both must bear");
    }

    #[test]
    fn two_obstacles_on_one_side_or_with_an_empty_throat_do_not_squeeze() {
        let lower = load(1, LOWER, [-0.4, 0.2], 20.0);
        let same_side = load(2, UPPER, [-0.4, 0.2], 20.0);
        assert_eq!(of(&ring(&[lower, same_side])), Some(Mechanism::Hybrid));
        let (outwards, too) = (load(1, LOWER, [-0.4, -0.2], 20.0), load(2, UPPER, [-0.4, 0.2], 20.0));
        assert_eq!(of(&ring(&[outwards, too])), Some(Mechanism::Hybrid), "they push it apart");
        let beyond = |y: f64| [0.6, y];
        let (a, b) = (load(1, beyond(-0.3), [-0.4, 0.2], 20.0), load(2, beyond(0.3), [-0.4, -0.2], 20.0));
        assert_eq!(of(&ring(&[a, b])), Some(Mechanism::Hybrid), "the front hangs back from the throat");
        assert_eq!(of(&point(&[a, b])), Some(Mechanism::Squeeze), "which a point cannot tell");
    }

    #[test]
    fn a_soft_particle_never_wraps() {
        assert_eq!(of(&point(&[load(3, [0.4, 0.0], [-0.8, 0.0], 170.0)])), Some(Mechanism::Hybrid));
    }

    #[test]
    fn loads_that_push_along_gravity_hold_nothing() {
        assert_eq!(of(&ring(&[])), None);
        assert_eq!(of(&ring(&[load(1, [-0.5, 0.0], [0.3, 0.0], 10.0)])), None);
        let (lower, upper) = (load(1, LOWER, [-0.4, 0.3], 20.0), load(2, UPPER, [-0.4, -0.3], 20.0));
        let behind = load(3, [-0.5, 0.0], [9.0, 0.0], 10.0);
        assert_eq!(of(&ring(&[lower, upper, behind])), Some(Mechanism::Squeeze));
    }
}

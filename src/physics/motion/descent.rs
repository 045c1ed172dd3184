//! Where a droplet would come to rest: a descent of its potential energy without inertia.
//!
//! Steps of backward Euler of `c dx/dt = -grad U`, with the friction c of the droplet, lead down from the present
//! shape. They are 1, 4, 16 ... 1e6 t0 long. A step is taken only where `c/h + U''` is positive definite all along, so
//! that it has one solution nearby and passes no barrier. Elsewhere it is taken again, four times as short, and the
//! steps after it grow by a factor of two.
//!
//! The droplet has an equilibrium where a step of 1e6 t0 moves nothing any more. That this step could be taken says
//! that the second variation of U is positive there, to within `c/1e6`: nothing grows by a factor e within 1e6 t0.

use crate::physics::motion::Interruption;
use std::sync::atomic::{AtomicBool, Ordering};

/// Length of the first step, in t0.
const FIRST: f64 = 1.0;

/// Length of the last step, in t0.
const LAST: f64 = 1e6;

/// By what factor a step is longer than the one before, or shorter than one that was refused.
const FACTOR: f64 = 4.0;

/// By what factor a step is longer than the one before once a step was refused.
const CAREFUL: f64 = 2.0;

/// The descent is given up where even so short a step cannot be taken, in t0.
const SHORTEST: f64 = 1e-3;

/// The descent is given up after so many steps, refused ones among them. Eleven lead from 1 to 1e6 t0. A ring whose
/// vertices still turn along its outline while its centroid hardly moves may take some hundred.
const MOST_STEPS: u32 = 1000;

/// A shape rests if no part of it moves further than this in a step of [`LAST`], in sigma.
const STILL: f64 = 1e-6;

/// A place where a droplet stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equilibrium {
    /// Unwrapped centroid, x.
    pub x: f64,
    /// Unwrapped centroid, y.
    pub y: f64,
    /// Potential energy, in g rho sigma^3.
    pub energy: f64,
}

/// A droplet that can move without inertia.
pub(super) trait Sinking {
    /// Takes a step of `h` t0; returns the largest distance that a part of the droplet moved. `None`, and nothing
    /// moves, where the step has no unique solution nearby.
    fn sink(&mut self, h: f64) -> Option<f64>;

    /// Where the droplet is, and its potential energy.
    fn here(&self) -> Equilibrium;
}

/// Descends to the equilibrium that the droplet reaches without inertia. `None` if there is none within `farthest` of
/// its present centroid.
///
/// # Errors
/// [`Interruption::Stopped`], once `stop` is set.
pub(super) fn descend(
    droplet: &mut dyn Sinking,
    farthest: f64,
    stop: &AtomicBool,
) -> Result<Option<Equilibrium>, Interruption> {
    let begin = droplet.here();
    let (mut h, mut growth) = (FIRST, FACTOR);
    for _ in 0..MOST_STEPS {
        if stop.load(Ordering::Relaxed) {
            return Err(Interruption::Stopped);
        }
        match droplet.sink(h) {
            Some(moved) => {
                let here = droplet.here();
                // Negated, so that a NaN is no equilibrium either.
                if !(libm::hypot(here.x - begin.x, here.y - begin.y) <= farthest) {
                    return Ok(None);
                }
                if h >= LAST && moved <= STILL {
                    return Ok(Some(here));
                }
                h = (growth * h).min(LAST);
            }
            None => (h, growth) = (h / FACTOR, CAREFUL),
        }
        if h < SHORTEST {
            return Ok(None);
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point of friction 1 in the potential `U(x)` with these first and second derivatives.
    struct Bead {
        x: f64,
        slope: fn(f64) -> f64,
        curvature: fn(f64) -> f64,
    }

    impl Sinking for Bead {
        fn sink(&mut self, h: f64) -> Option<f64> {
            let mut x = self.x;
            for _ in 0..50 {
                let stiffness = 1.0 / h + (self.curvature)(x);
                if stiffness <= 0.0 {
                    return None;
                }
                x -= ((x - self.x) / h + (self.slope)(x)) / stiffness;
            }
            let moved = (x - self.x).abs();
            (moved < 0.01).then(|| {
                self.x = x;
                moved
            })
        }

        fn here(&self) -> Equilibrium {
            Equilibrium { x: self.x, y: 0.0, energy: 0.0 }
        }
    }

    fn rests(x: f64, slope: fn(f64) -> f64, curvature: fn(f64) -> f64) -> Option<f64> {
        let found = descend(&mut Bead { x, slope, curvature }, 0.01, &AtomicBool::new(false)).unwrap();
        found.map(|equilibrium| equilibrium.x)
    }

    #[test]
    fn a_bead_in_a_bowl_rests_at_its_bottom_if_that_is_near() {
        let bottom = rests(0.009, |x| 0.3 * x, |_| 0.3).unwrap();
        assert!(bottom.abs() < 1e-9, "{bottom}");
        assert_eq!(rests(0.011, |x| 0.3 * x, |_| 0.3), None, "the way is too long");
    }

    #[test]
    fn a_bead_on_a_top_on_a_slope_or_past_a_bottleneck_does_not_rest() {
        assert_eq!(rests(0.0, |x| -0.3 * x, |_| -0.3), None, "a top is an equilibrium, but nothing stays there");
        assert_eq!(rests(0.0, |_| -1e-3, |_| 0.0), None, "a slope");
        // U' = -(1e-5 + x^2): where the bead is slowest it creeps, and rests nowhere.
        assert_eq!(rests(-0.004, |x| -(1e-5 + x * x), |x| -2.0 * x), None, "a bottleneck");
        // U' = 1e-5 - x^2 has a minimum at -sqrt(1e-5).
        let caught = rests(-0.004, |x| x * x - 1e-5, |x| 2.0 * x);
        assert_eq!(caught, None, "the minimum of this one lies on the other side");
        let caught = rests(0.004, |x| x * x - 1e-5, |x| 2.0 * x).unwrap();
        assert!((caught - 1e-5_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_descent_stops_when_it_is_told_to() {
        let mut bead = Bead { x: 0.0, slope: |x| x, curvature: |_| 1.0 };
        assert!(matches!(descend(&mut bead, 0.01, &AtomicBool::new(true)), Err(Interruption::Stopped)));
    }
}

//! How long the next step is where steps follow their error.
//!
//! The error of a step of order p goes with `h^(p + 1)`. So the step that has the error allowed is `root h` long, with
//!
//! ```text
//! root = (allowed/error)^(1/(p + 1))
//! ```
//!
//! The next step stays a little below that. [`step_control`](crate::physics::motion::step_control) is for steps that are
//! halves of a nominal one.

/// Length of the first step, in t0.
pub(super) const FIRST: f64 = 1e-3;

/// The shortest step, in t0.
pub(super) const SHORTEST: f64 = 1e-9;

/// The longest step, in t0.
const LONGEST: f64 = 50.0;

/// By what factor steps grow at most; backward differences of second order are stable below 2.41.
const GROWTH: f64 = 2.0;

/// The step after one of length `h` that was taken.
pub(super) fn after(h: f64, root: f64) -> f64 {
    (h * (0.9 * root).clamp(0.4, GROWTH)).min(LONGEST)
}

/// The step in place of one of length `h` whose error was too large.
pub(super) fn instead(h: f64, root: f64) -> f64 {
    h * (0.8 * root).clamp(0.1, 0.7)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_with_the_error_allowed_is_followed_by_one_almost_as_long_and_a_worse_one_by_a_shorter_one() {
        assert!(after(0.5, 1.0) < 0.5 && after(0.5, 1.0) > 0.4);
        assert_eq!(after(0.5, 1e9), 1.0, "steps grow by a factor of two at most");
        assert_eq!(after(40.0, 1e9), LONGEST);
        for root in [1e-9, 0.5, 1.0] {
            let shorter = instead(0.5, root);
            assert!(shorter < 0.5 && shorter > 0.04, "{root}: {shorter}");
        }
    }
}

//! An interval of numbers that says in words what it contains.

use crate::parameters::written::Short;
use std::fmt;

/// The numbers between two ends, each of which belongs to the interval or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    low: f64,
    low_included: bool,
    high: f64,
    high_included: bool,
}

pub(crate) const fn above(low: f64) -> Interval {
    Interval { low, low_included: false, high: f64::INFINITY, high_included: false }
}

pub(crate) const fn at_least(low: f64) -> Interval {
    Interval { low, low_included: true, high: f64::INFINITY, high_included: false }
}

/// All numbers from `low` to `high`, both included.
pub(crate) const fn between(low: f64, high: f64) -> Interval {
    Interval { low, low_included: true, high, high_included: true }
}

impl Interval {
    /// The same interval, but only up to and including `high`.
    pub(crate) const fn up_to(self, high: f64) -> Self {
        Self { high, high_included: true, ..self }
    }

    pub(crate) const fn below(self, high: f64) -> Self {
        Self { high, high_included: false, ..self }
    }

    /// Its lower end, and whether that is in.
    pub(crate) const fn low(self) -> (f64, bool) {
        (self.low, self.low_included)
    }

    /// Its upper end, which may be infinite, and whether that is in.
    pub(crate) const fn high(self) -> (f64, bool) {
        (self.high, self.high_included)
    }

    /// Whether the number lies in the interval.
    pub fn contains(&self, number: f64) -> bool {
        let above_low = number > self.low || (self.low_included && number == self.low);
        let below_high = number < self.high || (self.high_included && number == self.high);
        above_low && below_high
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = (Short(self.low), Short(self.high));
        match (self.low_included, self.high.is_finite(), self.high_included) {
            (true, true, true) => write!(f, "from {low} to {high}"),
            (true, true, false) => write!(f, "of at least {low} and below {high}"),
            (true, false, _) => write!(f, "of at least {low}"),
            (false, true, true) => write!(f, "above {low} and at most {high}"),
            (false, true, false) => write!(f, "above {low} and below {high}"),
            (false, false, _) => write!(f, "above {low}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_says_which_of_its_ends_it_contains() {
        let open = above(0.0).below(0.5);
        assert!(!open.contains(0.0) && open.contains(0.25) && !open.contains(0.5) && !open.contains(f64::NAN));
        assert_eq!(open.to_string(), "above 0 and below 0.5");
        let closed = between(1e-3, 1e8);
        assert!(closed.contains(1e-3) && closed.contains(1e8));
        assert_eq!(closed.to_string(), "from 0.001 to 1e8");
        assert!(!at_least(0.0).contains(f64::INFINITY));
    }
}

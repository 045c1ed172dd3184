//! The smallest and the largest of some numbers, as a plan shows them.

use crate::parameters::{Short, cut_to_three_digits};
use std::fmt;

/// Smallest and largest of some numbers, as `0.01 .. 10` or as one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Ends {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        Self { low, high }
    }

    /// Both cut to three digits.
    pub(super) fn cut(self) -> Self {
        Self { low: cut_to_three_digits(self.low), high: cut_to_three_digits(self.high) }
    }
}

impl fmt::Display for Ends {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.low == self.high {
            true => write!(f, "{}", Short(self.low)),
            false => write!(f, "{} .. {}", Short(self.low), Short(self.high)),
        }
    }
}

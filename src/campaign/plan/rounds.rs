//! The rounds of `until`: how seeds are added, and what all of them would cost.

use crate::campaign::durations::written_s;
use crate::campaign::file::{Block, Estimate, Until};
use crate::campaign::plan::Speed;
use crate::parameters::Short;
use std::fmt;

/// The rounds of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounds {
    /// When they end.
    pub until: Until,
    /// Runs a point in this round.
    pub runs: u64,
    /// CPU time of all seeds of all points, if every point needs all of them, in seconds.
    pub most_s: f64,
}

impl Rounds {
    /// Those of a block; `None` if it does not say `until`.
    pub(super) fn of(block: &Block, speed: &Speed) -> Option<Self> {
        let until = block.until?;
        let all: f64 = block.points.iter().map(|point| speed.expected_s(point)).sum();
        let runs = block.seeds.end - block.seeds.start;
        Some(Self { until, runs, most_s: all * until.max_runs.max(runs) as f64 })
    }
}

impl fmt::Display for Rounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { until: Until { estimate, relative_error, max_runs, .. }, runs, most_s } = self;
        let (of, most) = (if *estimate == Estimate::Lambda { "lambda" } else { "v_g" }, (*max_runs).max(*runs));
        let next = [2, 4].map(|times| times * runs).into_iter().filter(|next| *next < most);
        let runs: String = next.map(|next| format!("{next}, ")).fold(format!("{runs}, "), |runs, next| runs + &next);
        write!(
            f,
            "{runs}... up to {most} runs a point, until half of the interval of {of} is {}% of it; about {} of CPU if all points need all runs",
            Short(100.0 * relative_error),
            written_s(*most_s)
        )
    }
}

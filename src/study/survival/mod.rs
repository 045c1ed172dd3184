//! From finished runs to decay lengths and mean speeds: rows in, rows out; no SQL, no files, no clock.
//!
//! Every answer depends on its runs alone, not on their order nor on the number of threads: runs are sorted first, and
//! the bootstrap draws from ChaCha8 with a fixed seed.
//!
//! | question | answer |
//! |---|---|
//! | how far does a droplet get? | [`survival`]: `lambda` by maximum likelihood, with a profile-likelihood interval |
//! | what does the curve look like? | [`kaplan_meier`] |
//! | what would the paper have said? | [`least_squares`] |
//! | is it exponential at all? | [`goodness`] |
//! | how fast does it flow? | [`speed`] |

pub mod decay_length;
pub mod goodness;
pub mod kaplan_meier;
pub mod least_squares;

use crate::results::fits::{LambdaFit, PointRuns, SpeedAverage};
use crate::study::speed::speed_average;
use decay_length::{DecayLength, Lifetimes};
use rayon::prelude::*;

/// A grid point with everything fitted to its runs.
#[derive(Clone, Debug)]
pub struct FittedPoint<'a> {
    /// The point and its runs.
    pub point: &'a PointRuns,
    /// Decay length of its survival probability.
    pub lambda: LambdaFit,
    /// Mean speed of what flows.
    pub speed: SpeedAverage,
}

/// Fits every point, in parallel over points; answers come in the order of the points.
pub fn fit_all(points: &[PointRuns]) -> Vec<FittedPoint<'_>> {
    let fit = |point| FittedPoint { point, lambda: lambda_fit(point), speed: speed_average(point) };
    points.par_iter().map(fit).collect()
}

/// The decay length of one point, in sigma, by every estimator there is.
pub fn lambda_fit(point: &PointRuns) -> LambdaFit {
    let lifetimes = Lifetimes::of_runs(&point.runs);
    let (lambda, lambda_low, lambda_high) = match decay_length::maximum_likelihood(&lifetimes) {
        DecayLength::Measured { lambda, low, high } => (Some(lambda), Some(low), Some(high)),
        DecayLength::Above(low) => (None, Some(low), None),
        DecayLength::Unknown => (None, None, None),
    };
    LambdaFit {
        runs: count(lifetimes.len()),
        clogs: count(lifetimes.clogs()),
        lambda,
        lambda_low,
        lambda_high,
        lambda_least_squares: least_squares::lambda(&kaplan_meier::steps(&lifetimes)),
        p_exponential: goodness::p_exponential(&lifetimes),
        runs_for_ten_percent: decay_length::runs_for_ten_percent(lifetimes.len(), lifetimes.clogs()),
    }
}

/// A number of runs as a column holds it.
pub(super) fn count(runs: usize) -> u32 {
    u32::try_from(runs).unwrap_or(u32::MAX)
}

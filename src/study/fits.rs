//! Everything that is fitted to the runs of a grid point: its decay length and its mean speed.

use crate::campaign::parallel::in_parallel;
use crate::results::fits::{LambdaFit, PointRuns, SpeedAverage};
use crate::study::speed::speed_average;
use crate::study::survival::kaplan_meier::Step;
use crate::study::survival::survival_fit;
use rayon::prelude::*;

/// A grid point with everything fitted to its runs.
#[derive(Clone, Debug)]
pub struct FittedPoint<'a> {
    /// The point and its runs.
    pub point: &'a PointRuns,
    /// Decay length of its survival probability.
    pub lambda: LambdaFit,
    /// Its survival curve without a model.
    pub curve: Vec<Step>,
    /// Mean speed of the runs that did not clog.
    pub speed: SpeedAverage,
}

/// Fits every point, in parallel; the answers have the order of the points. Decay lengths and survival are those beyond
/// the displacement `from`.
pub fn fit_all(points: &[PointRuns], from: f64) -> Vec<FittedPoint<'_>> {
    let fit = |point| {
        let (lambda, curve) = survival_fit(point, from);
        FittedPoint { point, lambda, curve, speed: speed_average(point) }
    };
    in_parallel(|| points.par_iter().map(fit).collect())
}

//! How far a droplet gets before it clogs: the decay length `lambda` of the survival probability `P(r) =
//! exp(-r/lambda)`.
//!
//! | question | answer |
//! |---|---|
//! | what is lambda? | [`decay_length`]: by maximum likelihood, with a profile-likelihood interval |
//! | what does the curve look like? | [`kaplan_meier`] |
//! | what would the paper have said? | [`least_squares`] |
//! | is the survival exponential at all? | [`goodness`] |
//! | if not, does a droplet clog more easily the farther it has come? | [`weibull`] |
//!
//! Of three droplets two clog, after 1 and 3 sigma, and the third is cut off at 8. So lambda is (1 + 3 + 8)/2:
//!
//! ```
//! use meniscus::parameters::{Density, Model, ObstacleField, Point, Scene, Soft};
//! use meniscus::results::{fits::{FinishedRun, PointRuns}, trajectory::Outcome};
//! use meniscus::study::survival::lambda_fit;
//!
//! let run = |seed, outcome, r_end| {
//!     FinishedRun { seed, outcome, r_end, t_end: 1.0, v_g_mean: None, mechanism: None, arrested: None }
//! };
//! let runs = vec![run(0, Outcome::Clogged, 1.0), run(1, Outcome::Clogged, 3.0), run(2, Outcome::Distance, 8.0)];
//! let array = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 60.0 };
//! let point = Point::new(Model::Soft(Soft { e_w: 10.0 }), Scene::Obstacles(array));
//! let fit = lambda_fit(&PointRuns { point_id: point.id(), point, runs }, 0.0);
//! assert_eq!((fit.runs, fit.clogs, fit.lambda), (3, 2, Some(6.0)));
//! ```

pub mod decay_length;
pub mod goodness;
pub mod kaplan_meier;
pub mod least_squares;
pub mod monotonic;
pub mod weibull;

use crate::parameters::Scene;
use crate::results::fits::{FinishedRun, LambdaFit, PointRuns};
use crate::results::trajectory::Outcome;
use crate::study::survival::decay_length::{DecayLength, Lifetime, Lifetimes};
use crate::study::survival::kaplan_meier::Step;

/// The decay length of one point, in sigma, by every estimator, from what lies beyond the displacement `from`. Elsewhere
/// than in an array of obstacles there is one place to clog at, and no decay length.
pub fn lambda_fit(point: &PointRuns, from: f64) -> LambdaFit {
    survival_fit(point, from).0
}

/// The decay length of one point, and the survival curve without a model, which has no steps where there is no decay length.
pub fn survival_fit(point: &PointRuns, from: f64) -> (LambdaFit, Vec<Step>) {
    let edge = edge(point);
    let lifetimes = Lifetimes::of_runs(&point.runs, edge).beyond(from);
    let counted = LambdaFit {
        runs: lifetimes.len() as u32,
        clogs: lifetimes.clogs() as u32,
        arrested: point.count(|run| run.arrested.is_some_and(|r| r > from && r <= edge)),
        by_distance: point.count(|run| run.outcome == Outcome::Distance && run.r_end > from),
        by_time: point.count(|run| run.is_cut_by_time() && run.r_end > from && run.r_end <= edge),
        beyond_box: point.count(|run| run.stays_at().unwrap_or(run.r_end) > edge),
        r_from: from,
        ..LambdaFit::default()
    };
    if !matches!(point.point.scene, Scene::Obstacles(_)) {
        return (counted, Vec::new());
    }
    let (lambda, lambda_low, lambda_high) = match decay_length::maximum_likelihood(&lifetimes) {
        DecayLength::Measured { lambda, low, high } => (Some(lambda), Some(low), Some(high)),
        DecayLength::Above(low) => (None, Some(low), None),
        DecayLength::Unknown => (None, None, None),
    };
    let stuck = (counted.by_time > 0).then(|| decay_length::if_stuck(&lifetimes, counted.by_time));
    let (curve, shape) = (kaplan_meier::steps(&lifetimes), weibull::shape(&lifetimes));
    let fit = LambdaFit {
        lambda,
        lambda_low,
        lambda_high,
        lambda_if_stuck: stuck.flatten(),
        lambda_least_squares: least_squares::lambda(&curve),
        p_exponential: goodness::p_exponential(&lifetimes),
        weibull_shape: shape.map(|shape| shape.k),
        weibull_low: shape.map(|shape| shape.low),
        weibull_high: shape.map(|shape| shape.high),
        runs_for_ten_percent: decay_length::runs_for_ten_percent(point.runs.len(), lifetimes.clogs()),
        ..counted
    };
    (fit, curve)
}

/// How far one run of a point got: at least 0, and at most one side of its periodic box.
pub(super) fn lifetime_of(point: &PointRuns, run: &FinishedRun) -> Lifetime {
    Lifetime::of(run, edge(point))
}

/// How far a droplet goes before it meets the same obstacles again, in sigma.
fn edge(point: &PointRuns) -> f64 {
    match &point.point.scene {
        Scene::Obstacles(field) => field.box_size,
        _ => f64::INFINITY,
    }
}

/// Lifetimes of runs that clogged at these displacements, and of others that were cut off at those.
#[cfg(test)]
fn lifetimes(clogged: &[f64], cut_off: &[f64]) -> Lifetimes {
    let life = |clogged| move |&r: &f64| Lifetime { r, clogged };
    Lifetimes::new(clogged.iter().map(life(true)).chain(cut_off.iter().map(life(false))).collect())
}

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
    let all = all_lifetimes(point);
    let lifetimes = all.beyond(from);
    let count = |which: &dyn Fn(&FinishedRun) -> bool| point.runs.iter().filter(|run| which(run)).count() as u32;
    let edge = edge(point);
    let counted = LambdaFit {
        runs: lifetimes.len() as u32,
        clogs: lifetimes.clogs() as u32,
        arrested: count(&|run| run.arrested.is_some_and(|r| r > from && r <= edge)),
        by_distance: count(&|run| run.outcome == Outcome::Distance && run.r_end > from),
        by_time: count(&|run| was_cut_by_time(run, edge) && run.r_end > from),
        beyond_box: count(&|run| run.stays_at().unwrap_or(run.r_end) > edge),
        r_from: from,
        ..LambdaFit::default()
    };
    if !matches!(point.point.scene, Scene::Obstacles(_)) {
        return counted;
    }
    let (lambda, lambda_low, lambda_high) = match decay_length::maximum_likelihood(&lifetimes) {
        DecayLength::Measured { lambda, low, high } => (Some(lambda), Some(low), Some(high)),
        DecayLength::Above(low) => (None, Some(low), None),
        DecayLength::Unknown => (None, None, None),
    };
    let stuck = (counted.by_time > 0).then(|| decay_length::if_stuck(&lifetimes, counted.by_time));
    let shape = weibull::shape(&lifetimes);
    LambdaFit {
        lambda,
        lambda_low,
        lambda_high,
        lambda_if_stuck: stuck.flatten(),
        lambda_least_squares: least_squares::lambda(&kaplan_meier::steps(&lifetimes)),
        p_exponential: goodness::p_exponential(&lifetimes),
        weibull_shape: shape.map(|shape| shape.k),
        weibull_low: shape.map(|shape| shape.low),
        weibull_high: shape.map(|shape| shape.high),
        runs_for_ten_percent: decay_length::runs_for_ten_percent(point.runs.len(), lifetimes.clogs()),
        ..counted
    }
}

/// The survival curve of one point beyond `from`, without a model; nothing elsewhere than in an array of obstacles.
pub fn survival_curve(point: &PointRuns, from: f64) -> Vec<Step> {
    match point.point.scene {
        Scene::Obstacles(_) => kaplan_meier::steps(&all_lifetimes(point).beyond(from)),
        _ => Vec::new(),
    }
}

/// The lifetimes of all runs of a point.
fn all_lifetimes(point: &PointRuns) -> Lifetimes {
    Lifetimes::of_runs(&point.runs, edge(point))
}

/// How far one run of a point got: at least 0, and at most one side of its periodic box.
pub(super) fn lifetime_of(point: &PointRuns, run: &FinishedRun) -> Lifetime {
    let life = Lifetime::of(run, edge(point));
    Lifetime { r: if life.r < 0.0 { 0.0 } else { life.r }, ..life }
}

/// How far a droplet goes before it meets the same obstacles again, in sigma.
fn edge(point: &PointRuns) -> f64 {
    match &point.point.scene {
        Scene::Obstacles(field) => field.box_size,
        _ => f64::INFINITY,
    }
}

/// Whether time ran out on a droplet that was not at rest.
fn was_cut_by_time(run: &FinishedRun, edge: f64) -> bool {
    run.outcome == Outcome::TimeLimit && run.arrested.is_none() && run.r_end <= edge
}

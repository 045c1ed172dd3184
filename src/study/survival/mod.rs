//! How far a droplet gets before it clogs: the decay length `lambda` of the survival probability `P(r) =
//! exp(-r/lambda)`.
//!
//! | question | answer |
//! |---|---|
//! | what is lambda? | [`decay_length`]: by maximum likelihood, with a profile-likelihood interval |
//! | what does the curve look like? | [`kaplan_meier`] |
//! | what would the paper have said? | [`least_squares`] |
//! | is the survival exponential at all? | [`goodness`] |
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
//! let fit = lambda_fit(&PointRuns { point_id: point.id(), point, runs });
//! assert_eq!((fit.runs, fit.clogs, fit.lambda), (3, 2, Some(6.0)));
//! ```

pub mod decay_length;
pub mod goodness;
pub mod kaplan_meier;
pub mod least_squares;

use crate::parameters::Scene;
use crate::results::fits::{LambdaFit, PointRuns};
use crate::study::survival::decay_length::{DecayLength, Lifetimes};

/// The decay length of one point, in sigma, by every estimator. Elsewhere than in an array of obstacles there is one
/// place to clog at, and no decay length.
pub fn lambda_fit(point: &PointRuns) -> LambdaFit {
    let lifetimes = Lifetimes::of_runs(&point.runs);
    let arrested = point.runs.iter().filter(|run| run.arrested.is_some()).count() as u32;
    if !matches!(point.point.scene, Scene::Obstacles(_)) {
        return LambdaFit {
            runs: lifetimes.len() as u32,
            clogs: lifetimes.clogs() as u32,
            arrested,
            lambda: None,
            lambda_low: None,
            lambda_high: None,
            lambda_least_squares: None,
            p_exponential: None,
            runs_for_ten_percent: None,
        };
    }
    let (lambda, lambda_low, lambda_high) = match decay_length::maximum_likelihood(&lifetimes) {
        DecayLength::Measured { lambda, low, high } => (Some(lambda), Some(low), Some(high)),
        DecayLength::Above(low) => (None, Some(low), None),
        DecayLength::Unknown => (None, None, None),
    };
    LambdaFit {
        runs: lifetimes.len() as u32,
        clogs: lifetimes.clogs() as u32,
        arrested,
        lambda,
        lambda_low,
        lambda_high,
        lambda_least_squares: least_squares::lambda(&kaplan_meier::steps(&lifetimes)),
        p_exponential: goodness::p_exponential(&lifetimes),
        runs_for_ten_percent: decay_length::runs_for_ten_percent(lifetimes.len(), lifetimes.clogs()),
    }
}

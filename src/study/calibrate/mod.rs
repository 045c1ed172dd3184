//! Gamma and b0 of a droplet that was filmed in a constriction ([C24] 3.1, eqs 13, 14).
//!
//! [`frames`] hold the speed and the shape of the droplet against its position. A [`profile`] is the same for a
//! simulated passage, and the [`deviation`] compares the two. The `search` finds the parameters of least deviation.

pub mod deviation;
pub mod frames;
pub mod profile;
pub(crate) mod search;

use crate::parameters::Point;
use crate::study::calibrate::deviation::{Deviation, curvature_errors};
use crate::study::calibrate::frames::Trial;
use crate::study::calibrate::profile::{Laboratory, Parameters, Profile};
use crate::study::calibrate::search::{Ranges, SearchGrid};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};
use std::sync::Arc;

/// For the errors of a fit: relative steps in Gamma and in b0 to neighbouring profiles, and the smallest step in b0.
const STEPS: [f64; 3] = [0.02, 0.1, 2e-3];

/// Probability outside a 95% interval on each side.
const TAIL: f64 = 0.025;

#[derive(Clone, Debug)]
pub(crate) struct TrialFit {
    /// The fitted Gamma* and b0*.
    pub parameters: Parameters,
    /// Delta_v and Delta_A there.
    pub deviation: Deviation,
    /// The simulated passage.
    pub profile: Arc<Profile>,
}

/// Gamma* or b0* from the fits of all trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FittedParameter {
    /// Mean over the trials.
    pub value: f64,
    /// Standard deviation over the trials; for a single trial the standard error of its fit, if that is known.
    pub spread: Option<f64>,
    /// 95% interval, if there is a spread.
    pub interval: Option<[f64; 2]>,
}

#[derive(Clone, Debug)]
pub(crate) struct Calibration {
    pub fits: Vec<TrialFit>,
    /// Gamma*.
    pub gamma: FittedParameter,
    /// b0*.
    pub b0: FittedParameter,
    /// Where the simulated droplets started and ended, in sigma.
    pub window: [f64; 2],
    /// Number of simulations, and how many of them failed.
    pub simulations: [usize; 2],
    /// Names of the parameters that lie at an end of their range in some fit.
    pub at_the_end: Vec<&'static str>,
}

#[derive(Debug, thiserror::Error)]
pub(crate) enum CalibrateError {
    /// No droplet of the grid could be simulated.
    #[error(
        "none of the {0} simulations came to an end, so there is nothing to compare; \
         try other values of --gamma, or a larger --kappa"
    )]
    NothingRuns(usize),
    /// The optimiser gave up.
    #[error("the search failed: {0}; try a narrower --gamma or --b0")]
    Search(String),
}

/// Fits Gamma and b0 to every trial by least Delta_v, on the threads of the current rayon pool.
///
/// `template` is the channel and the droplet; its gamma, b0, dt, ends and limits are replaced. `watch` is called with the
/// number of simulations so far, whenever one ends. The answer does not depend on the number of threads.
///
/// # Errors
/// [`CalibrateError`].
pub(crate) fn calibrate(
    trials: &[Trial],
    template: &Point,
    ranges: &Ranges,
    watch: &(dyn Fn(usize) + Sync),
) -> Result<Calibration, CalibrateError> {
    let laboratory = Laboratory::new(template.clone(), trials, watch);
    let grid = SearchGrid::simulate(ranges, &laboratory, trials);
    let fits: Vec<TrialFit> =
        trials.par_iter().map(|trial| fit(trial, &grid, &laboratory, ranges)).collect::<Result<_, _>>()?;
    let errors = match (trials, fits.as_slice()) {
        ([trial], [only]) => single_errors(trial, only, &laboratory),
        _ => None,
    };
    let estimate = |k: usize| {
        let values: Vec<f64> = fits.iter().map(|fit| [fit.parameters.gamma, fit.parameters.b0][k]).collect();
        match errors {
            Some(errors) => of_one(values[0], errors[k], trials[0].frames.len()),
            None => of_many(&values),
        }
    };
    let (gamma, b0) = (estimate(0), estimate(1));
    let at_the_end = at_the_end(&fits, ranges);
    let (window, simulations) = (laboratory.window(), laboratory.count());
    Ok(Calibration { gamma, b0, window, simulations, at_the_end, fits })
}

fn fit(
    trial: &Trial,
    grid: &SearchGrid,
    laboratory: &Laboratory<'_>,
    ranges: &Ranges,
) -> Result<TrialFit, CalibrateError> {
    let found = search::minimise(grid, laboratory, trial, ranges);
    let found = found.map_err(|error| CalibrateError::Search(error.to_string()))?;
    let nothing = || CalibrateError::NothingRuns(laboratory.count()[0]);
    let parameters = found.ok_or_else(nothing)?;
    let profile = laboratory.profile(parameters).map_err(|_| nothing())?;
    Ok(TrialFit { parameters, deviation: Deviation::between(&profile, trial), profile })
}

/// Standard errors of the fit of a single trial, from four more profiles around it. Instead of a droplet that stays
/// stuck, the fit itself is used.
fn single_errors(trial: &Trial, fit: &TrialFit, laboratory: &Laboratory<'_>) -> Option<[f64; 2]> {
    let Parameters { gamma, b0 } = fit.parameters;
    let (dg, db) = (STEPS[0] * gamma, (STEPS[1] * b0).max(STEPS[2]));
    let around = [(gamma - dg, b0), (gamma + dg, b0), (gamma, (b0 - db).max(0.0)), (gamma, b0 + db)];
    let sides: Vec<(Parameters, Arc<Profile>)> = around
        .into_par_iter()
        .map(|(gamma, b0)| {
            let side = Parameters { gamma, b0 };
            let passes = |profile: &Arc<Profile>| !(Deviation::between(profile, trial).missed > 0.0);
            match laboratory.profile(side).ok().filter(passes) {
                Some(profile) => (side, profile),
                None => (fit.parameters, fit.profile.clone()),
            }
        })
        .collect();
    let [g0, g1, b0, b1] = [0, 1, 2, 3].map(|k| (sides[k].0, sides[k].1.as_ref()));
    curvature_errors(trial, &fit.profile, [[g0, g1], [b0, b1]])
}

/// From one trial of `n` frames, with Student's t of n - 2 degrees of freedom.
fn of_one(value: f64, error: f64, n: usize) -> FittedParameter {
    FittedParameter {
        value,
        spread: Some(error),
        interval: interval(value, student((n - 2) as f64).map(|t| t * error)),
    }
}

/// From n trials: mean and standard deviation, and the interval of the mean with Student's t of n - 1 degrees of
/// freedom.
fn of_many(values: &[f64]) -> FittedParameter {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n;
    if values.len() < 2 {
        return FittedParameter { value, spread: None, interval: None };
    }
    let spread = (values.iter().map(|x| (x - value) * (x - value)).sum::<f64>() / (n - 1.0)).sqrt();
    let reach = student(n - 1.0).map(|t| t * spread / n.sqrt());
    FittedParameter { value, spread: Some(spread), interval: interval(value, reach) }
}

/// The interval of a parameter that is not negative.
fn interval(value: f64, reach: Option<f64>) -> Option<[f64; 2]> {
    reach.map(|reach| [(value - reach).max(0.0), value + reach])
}

/// The quantile of Student's t that bounds a 95% interval.
fn student(freedom: f64) -> Option<f64> {
    StudentsT::new(0.0, 1.0, freedom).ok().map(|t| t.inverse_cdf(1.0 - TAIL))
}

/// Which parameters lie within 1% of an end of their range in some fit. The end b0 = 0 does not count, because b0
/// cannot be negative.
fn at_the_end(fits: &[TrialFit], ranges: &Ranges) -> Vec<&'static str> {
    let near = |value: f64, end: f64| (value - end).abs() <= 0.01 * end;
    let gamma = |fit: &TrialFit| {
        near(fit.parameters.gamma, *ranges.gamma.start()) || near(fit.parameters.gamma, *ranges.gamma.end())
    };
    let b0 = |fit: &TrialFit| {
        let start = *ranges.b0.start();
        (start > 0.0 && near(fit.parameters.b0, start)) || near(fit.parameters.b0, *ranges.b0.end())
    };
    let mut names = Vec::new();
    names.extend(fits.iter().any(gamma).then_some("gamma"));
    names.extend(fits.iter().any(b0).then_some("b0"));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_over_trials_is_that_of_the_textbooks() {
        let estimate = of_many(&[1.0, 2.0, 3.0]);
        assert_eq!((estimate.value, estimate.spread), (2.0, Some(1.0)));
        // t(2, 97.5%) = 4.3027.
        let [low, high] = estimate.interval.unwrap();
        assert!(low == 0.0 && (high - (2.0 + 4.3027 / 3.0_f64.sqrt())).abs() < 1e-3, "{high}");
        assert_eq!(of_many(&[1.5]).spread, None);
    }
}

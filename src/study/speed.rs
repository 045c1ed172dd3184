//! Mean speed of a grid point: the mean over its runs that neither clogged nor were arrested at their time limit. The
//! speed of a run is the slope of its r(t) after the start-up.
//!
//! **Interval.** Ten arrays per point are common, and the interval of a plain percentile bootstrap of ten values is too
//! narrow. Coverage of nominal 95% intervals for ten values (4000 sets each):
//!
//! | | normal | log-normal (0.5) | exponential |
//! |---|---|---|---|
//! | percentile | 90% | 88% | 86% |
//! | BCa | 90% | 89% | 88% |
//! | studentised (used) | 95% | 94% | 94% |
//!
//! Each resample gives `t* = (its mean - mean)/(its standard error)`. With the quantiles of t* and the standard error e
//! of the mean, the interval is `[mean - t*(97.5%) e, mean - t*(2.5%) e]`. A resample that repeats one value has no t*.
//! If that happens in more than 1% of the resamples, as with four values or fewer, there is no interval.

use crate::parameters::Model;
use crate::results::fits::{FinishedRun, PointRuns, SpeedAverage};
use crate::results::trajectory::Outcome;
use crate::study::studentised::Deviations;

/// An interval needs at least this many runs.
const FEWEST_RUNS: usize = 5;

/// Seed of the bootstrap.
const SEED: u64 = 0x0073_7065_6564;

/// Mean of v_g/V_t over the runs that neither clogged nor were arrested, and lasted long enough to have a speed, with a
/// 95% interval if there are five such runs. `Ca = (v_g/V_t) pi/(4 Gamma)` for a DP.
///
/// Two runs flow at 0.6 and 0.8 V_t, the third clogs:
///
/// ```
/// use meniscus::parameters::{Deformable, Model, Point, Scene};
/// use meniscus::results::{fits::{FinishedRun, PointRuns}, trajectory::Outcome};
/// use meniscus::study::speed::speed_average;
///
/// let run = |seed, outcome, speed| {
///     FinishedRun { seed, outcome, r_end: 60.0, t_end: 100.0, v_g_mean: Some(speed), mechanism: None, arrested: None }
/// };
/// let runs = vec![run(0, Outcome::Distance, 0.6), run(1, Outcome::TimeLimit, 0.8), run(2, Outcome::Clogged, 0.1)];
/// let point = Point::new(Model::Deformable(Deformable::of_tension(0.5)), Scene::Plate);
/// let average = speed_average(&PointRuns { point_id: point.id(), point, runs });
/// assert_eq!((average.flowing, average.runs), (2, 3));
/// assert!((average.v_g.unwrap() - 0.7).abs() < 1e-12);
/// assert!((average.ca.unwrap() - 0.7 * std::f64::consts::PI / 2.0).abs() < 1e-12);
/// ```
pub fn speed_average(point: &PointRuns) -> SpeedAverage {
    let mut speeds: Vec<f64> = point.runs.iter().filter_map(FinishedRun::flowing_speed).collect();
    // Sorted, so that neither the sum nor the resamples depend on the order of the runs.
    speeds.sort_by(f64::total_cmp);
    let v_g = (!speeds.is_empty()).then(|| mean(&speeds));
    let interval = studentised_interval(&speeds);
    let ca = match &point.point.model {
        Model::Deformable(ring) => v_g.map(|v_g| v_g * std::f64::consts::FRAC_PI_4 / ring.gamma),
        Model::Soft(_) => None,
    };
    SpeedAverage {
        runs: point.runs.len() as u32,
        flowing: speeds.len() as u32,
        by_distance: point.count(|run| run.outcome == Outcome::Distance),
        by_time: point.count(FinishedRun::is_cut_by_time),
        arrested: point.count(|run| run.arrested.is_some()),
        v_g,
        v_g_low: interval.map(|(low, _)| low),
        v_g_high: interval.map(|(_, high)| high),
        ca,
    }
}

/// The 95% interval of the mean by the studentised bootstrap; `None` for fewer than five values or too many equal ones.
fn studentised_interval(values: &[f64]) -> Option<(f64, f64)> {
    if values.len() < FEWEST_RUNS {
        return None;
    }
    let (centre, error) = mean_and_error(values);
    let mut resample = vec![0.0; values.len()];
    let deviations = Deviations::of(values.len(), SEED, |drawn| {
        resample.iter_mut().zip(drawn).for_each(|(value, &at)| *value = values[at]);
        let (mean, own_error) = mean_and_error(&resample);
        // If all values of a resample are equal, their standard error is round-off.
        (own_error > 1e-6 * error).then(|| (mean - centre) / own_error)
    });
    Some(deviations?.interval(centre, error))
}

/// Mean and its standard error, `sqrt(sum (x - mean)^2/(n (n - 1)))`, of at least two values.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let (n, mean) = (values.len() as f64, mean(values));
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_few_or_too_equal_values_have_no_interval() {
        let (low, high) = studentised_interval(&[0.1, 0.2, 0.3, 0.4, 0.5]).unwrap();
        assert!(low < 0.2 && 0.4 < high, "{low} {high}");
        assert_eq!(studentised_interval(&[0.1, 0.2, 0.3, 0.4]), None);
        assert_eq!(studentised_interval(&[0.75; 6]), None);
        assert_eq!(studentised_interval(&[0.5, 0.5, 0.5, 0.5, 0.9]), None);
    }
}

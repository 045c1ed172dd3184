//! The runs of a grid point, their observables, and the differences from those of another grid point.

use crate::campaign::choose::{stepping::candidates, tolerance::Knobs};
use crate::parameters::{Integrator, Model, Point, PointId};
use crate::physics::simulate::stability::StabilityLimit;
use crate::results::fits::RunRecord;
use crate::results::trajectory::Outcome;
use crate::study::accuracy::observable::Observable;
use std::sync::Arc;

/// A grid point and its runs.
#[derive(Clone, Debug)]
pub struct PointRecords {
    /// The point.
    pub point: Arc<Point>,
    /// Its identity.
    pub point_id: PointId,
    /// Its runs, by seed.
    pub runs: Vec<RunRecord>,
}

/// A difference of two estimates, and its standard error if there are several seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Its size, relative or in the unit of the observable.
    pub size: f64,
    /// Its standard error by the jackknife over seeds; 0 for a single run. For an observable that can jump and n runs
    /// it is at least `1.5/n`.
    pub spread: f64,
}

impl PointRecords {
    /// The observable from all runs; `None` if a run is missing or failed, or does not have it.
    pub(crate) fn value(&self, observable: &Observable) -> Option<f64> {
        self.estimate(observable, None)
    }

    /// The observable from all runs except run number `left_out`.
    fn estimate(&self, observable: &Observable, left_out: Option<usize>) -> Option<f64> {
        if self.runs.is_empty() || self.runs.iter().any(|run| run.outcome.is_none()) {
            return None;
        }
        let kept = self.runs.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).map(|(_, run)| run);
        (observable.estimate)(&self.point, &kept.collect::<Vec<_>>()).filter(|value| value.is_finite())
    }

    /// The difference of the observable from that of `other`, whose runs have the same seeds; `None` if either is
    /// missing.
    pub(crate) fn difference(&self, other: &Self, observable: &Observable) -> Option<Difference> {
        let difference = |left_out| {
            let (mine, theirs) = (self.estimate(observable, left_out)?, other.estimate(observable, left_out)?);
            Some((mine - theirs) / scale(observable, theirs))
        };
        let size = difference(None)?.abs();
        let paired = self.runs.len() == other.runs.len();
        let spread = if paired { self.jackknife(difference) } else { 0.0 };
        // What happens in none of n runs may still happen in 3 of n others (95%). Two standard errors of 1.5/n cover
        // it.
        let unseen =
            if observable.can_jump && self.point_id != other.point_id { 1.5 / self.runs.len() as f64 } else { 0.0 };
        Some(Difference { size, spread: spread.max(unseen) })
    }

    /// Standard error of the observable itself, relative if its errors are; `None` for a single run.
    pub fn statistical(&self, observable: &Observable) -> Option<f64> {
        let value = self.value(observable)?;
        let relative = |left_out| Some(self.estimate(observable, left_out)? / scale(observable, value));
        (self.runs.len() > 1).then(|| self.jackknife(relative))
    }

    /// `sqrt((n - 1)/n sum (x_k - mean)^2)`, where `x_k` is the estimate without the k-th of the n runs.
    fn jackknife(&self, estimate: impl Fn(Option<usize>) -> Option<f64>) -> f64 {
        let n = self.runs.len();
        let without: Vec<f64> = (0..n).filter_map(|k| estimate(Some(k))).collect();
        if n < 2 || without.len() < n {
            return 0.0;
        }
        let n = n as f64;
        let mean = without.iter().sum::<f64>() / n;
        ((n - 1.0) / n * without.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>()).sqrt()
    }

    /// Milliseconds of wall time per t0 on one thread, over all runs; `None` if nothing ran.
    pub(crate) fn ms_per_t0(&self) -> Option<f64> {
        let sum = |of: fn(&RunRecord) -> f64| self.runs.iter().map(of).sum::<f64>();
        let time = sum(|run| run.t_end);
        (time > 0.0).then(|| 1e3 * sum(|run| run.wall_s) / time)
    }

    /// Why there is no value, in a few words.
    pub(crate) fn excuse(&self) -> String {
        let failed = self.runs.iter().filter(|run| run.outcome.is_none()).count();
        match self.runs.first() {
            None => "not run".to_owned(),
            Some(_) if failed > 0 => format!("{failed} failed"),
            Some(run) => match run.outcome {
                Some(Outcome::Clogged) => "stuck".to_owned(),
                Some(Outcome::Exited) => "passes".to_owned(),
                _ => "no end".to_owned(),
            },
        }
    }

    /// The setting; `None` for a soft particle.
    pub(crate) fn setting(&self) -> Option<Knobs> {
        let Model::Deformable(ring) = &self.point.model else { return None };
        let stepping = &self.point.stepping;
        let automatic = stepping.integrator == Integrator::Adaptive
            || candidates(&self.point, &StabilityLimit::of(&self.point)).contains(stepping);
        Some((ring.n_vertices, stepping.integrator, (!automatic).then_some(stepping.dt)))
    }
}

/// The unit of a difference from `value`.
pub(super) fn scale(observable: &Observable, value: f64) -> f64 {
    if observable.relative { value.abs() } else { 1.0 }
}

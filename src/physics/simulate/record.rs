//! What is recorded of a trajectory: the columns of `samples`, extremes and means.
//!
//! | column | unit | value |
//! |---|---|---|
//! | t | t0 | time since gravity came on |
//! | r | sigma | displacement of the centroid along +x |
//! | h, y | sigma | centroid, unwrapped |
//! | v_g | V_t | velocity of the centroid along +x |
//! | ek_ratio | | E_k/E_t, `E_t = M V_t^2/2` |
//! | shape | | `A = perimeter^2/(4 pi a)` (DP) |
//! | area_error | | `a/a0 - 1` (DP) |

use crate::parameters::{MASS, Point};
use crate::physics::observation::Observation;
use crate::results::outline::Outline;
use crate::results::trajectory::Samples;
use serde::{Deserialize, Serialize};

/// The start-up is this share of the recorded time.
const START_UP: f64 = 0.1;

/// Fewest samples that a slope is taken from.
const FEWEST_SAMPLES: usize = 5;

/// The extremes of what was seen at the checks, and when an obstacle was first engulfed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Extremes {
    pub(super) shape_max: Option<f64>,
    pub(super) area_error_max: Option<f64>,
    pub(super) overlap_max: f64,
    pub(super) energy_rise_max: f64,
    pub(super) ek_ratio_min: f64,
    pub(super) engulfed_t: Option<f64>,
}

impl Extremes {
    /// Those of a droplet that nothing was seen of.
    const NONE: Self = Self {
        shape_max: None,
        area_error_max: None,
        overlap_max: 0.0,
        energy_rise_max: 0.0,
        ek_ratio_min: f64::INFINITY,
        engulfed_t: None,
    };
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Recorder {
    v_t: f64,
    start_x: f64,
    pub(super) samples: Samples,
    pub(super) outlines: Vec<Outline>,
    pub(super) extremes: Extremes,
}

/// How much had been recorded at some check, and the extremes until then.
#[derive(Clone, Copy, Debug)]
pub(super) struct Recorded {
    pub(super) samples: usize,
    pub(super) outlines: usize,
    extremes: Extremes,
}

impl Recorder {
    /// What has been recorded so far.
    pub(super) fn recorded(&self) -> Recorded {
        let (samples, outlines) = (self.samples.len(), self.outlines.len());
        Recorded { samples, outlines, extremes: self.extremes }
    }

    /// A record of the same droplet without its series and outlines, with the extremes of that time.
    pub(super) fn emptied(&self, to: Recorded) -> Self {
        let Self { v_t, start_x, .. } = *self;
        Self { v_t, start_x, samples: Samples::default(), outlines: Vec::new(), extremes: to.extremes }
    }

    /// The record as it was when this had been recorded.
    pub(super) fn rewind(mut self, to: Recorded) -> Self {
        self.samples.truncate(to.samples);
        self.outlines.truncate(to.outlines);
        Self { extremes: to.extremes, ..self }
    }

    /// A record that begins with the observation when gravity comes on.
    pub(super) fn new(point: &Point, begin: Observation) -> Self {
        let mut recorder = Self {
            v_t: point.v_t,
            start_x: begin.x,
            samples: Samples::default(),
            outlines: Vec::new(),
            extremes: Extremes::NONE,
        };
        recorder.watch(&begin, 0.0);
        recorder.extremes.ek_ratio_min = f64::INFINITY;
        recorder.record(0.0, &begin);
        recorder
    }

    /// Displacement along +x since the start, in sigma.
    pub(super) fn displacement(&self, seen: &Observation) -> f64 {
        seen.x - self.start_x
    }

    pub(super) fn ek_ratio(&self, seen: &Observation) -> f64 {
        seen.kinetic / (0.5 * MASS * self.v_t * self.v_t)
    }

    pub(super) fn watch(&mut self, seen: &Observation, energy_rise: f64) {
        let larger = |old: Option<f64>, new: Option<f64>| new.map(|n| old.map_or(n, |o| o.max(n)));
        let ek_ratio = self.ek_ratio(seen);
        let extremes = &mut self.extremes;
        extremes.shape_max = larger(extremes.shape_max, seen.shape);
        extremes.area_error_max = larger(extremes.area_error_max, seen.area_error.map(f64::abs));
        extremes.overlap_max = extremes.overlap_max.max(seen.overlap);
        extremes.energy_rise_max = extremes.energy_rise_max.max(energy_rise);
        extremes.ek_ratio_min = extremes.ek_ratio_min.min(ek_ratio);
    }

    pub(super) fn record(&mut self, t: f64, seen: &Observation) {
        let (r, ek_ratio) = (self.displacement(seen), self.ek_ratio(seen));
        let samples = &mut self.samples;
        samples.t.push(t);
        samples.r.push(r);
        samples.h.push(seen.x);
        samples.y.push(seen.y);
        samples.v_g.push(seen.velocity / self.v_t);
        samples.ek_ratio.push(ek_ratio);
        samples.shape.extend(seen.shape);
        samples.area_error.extend(seen.area_error);
    }

    /// Mean speed after the start-up, in V_t.
    pub(super) fn mean_speed(&self) -> Option<f64> {
        slope_after_start_up(&self.samples.t, &self.samples.r).map(|slope| slope / self.v_t)
    }
}

/// Least-squares slope of r(t) once the first tenth of the recorded time has passed, in units of r over units of t.
///
/// `t` increases and is as long as `r`. `None` if fewer than five samples are left, or all at the same time.
fn slope_after_start_up(t: &[f64], r: &[f64]) -> Option<f64> {
    let (first, last) = (*t.first()?, *t.last()?);
    let started = t.partition_point(|&time| time < first + START_UP * (last - first));
    let (t, r) = (&t[started..], &r[started..]);
    if t.len() < FEWEST_SAMPLES {
        return None;
    }
    // Relative to the means, because r and t are large compared with their differences.
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (t_mean, r_mean) = (mean(t), mean(r));
    let covariance: f64 = t.iter().zip(r).map(|(t, r)| (t - t_mean) * (r - r_mean)).sum();
    let variance: f64 = t.iter().map(|t| (t - t_mean) * (t - t_mean)).sum();
    (variance > 0.0).then(|| covariance / variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_keeps_its_digits_far_from_the_origin() {
        let t: Vec<f64> = (0..200).map(|i| 1e6 + f64::from(i)).collect();
        let r: Vec<f64> = (0..200).map(|i| 4096.0 + 0.25 * f64::from(i)).collect();
        assert_eq!(slope_after_start_up(&t, &r), Some(0.25));
    }

    #[test]
    fn a_slope_needs_five_samples_after_the_start_up() {
        let t: Vec<f64> = (0..6).map(f64::from).collect();
        assert_eq!(slope_after_start_up(&t, &t), Some(1.0));
        assert_eq!(slope_after_start_up(&t[..5], &t[..5]), None);
        assert_eq!(slope_after_start_up(&[], &[]), None);
        assert_eq!(slope_after_start_up(&[2.0; 9], &[3.0; 9]), None);
    }

    #[test]
    fn the_start_up_is_a_tenth_of_the_time_not_of_the_samples() {
        // Nine hasty samples within the first tenth of the time, then a steady slope of 2.
        let t: Vec<f64> = (0..9).map(|i| 0.1 * f64::from(i)).chain((1..=10).map(f64::from)).collect();
        let r: Vec<f64> = t.iter().map(|&t| if t < 1.0 { 50.0 } else { 2.0 * t }).collect();
        assert_eq!(slope_after_start_up(&t, &r), Some(2.0));
    }
}

//! How far a simulated profile lies from the frames of an experiment ([C24] eqs 13, 14).
//!
//! `Delta_v = sqrt(1/n sum_i ((v_sim(h_i) - v_i)/e_i)^2)` over the n frames, and Delta_A is the same for the shape
//! parameter. v is in V_t. The e_i are the standard errors of the frames; if the file has none, they are 1, and the
//! deviations are absolute.
//!
//! **A droplet that stays stuck** never reaches the frames beyond its place of rest. At these frames its speed counts
//! as 0 and its shape as the last one. The search minimises `Delta_v (1 + missed)`, where `missed` is the distance from
//! the place of rest to the last frame. Stiffer droplets rest earlier, so this cost falls towards droplets that pass.

use crate::study::calibrate::frames::Trial;
use crate::study::calibrate::profile::{Parameters, Profile};
use nalgebra::{Matrix2, Vector2};

/// Deviations of a profile from a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Delta_v, in V_t, or in standard errors if the frames have these.
    pub v_g: f64,
    /// Delta_A, absolute, or in standard errors if the frames have these.
    pub shape: f64,
    /// How far before the last frame the droplet came to rest, in sigma; zero if it reached that frame.
    pub missed: f64,
}

impl Deviation {
    /// Deviations of `profile` from the frames of `trial`, by linear interpolation in h.
    ///
    /// ```
    /// use meniscus::study::calibrate::{deviation::Deviation, frames, profile::Profile};
    /// let trial = &frames::parse("f.csv", "h,v_g,shape\n0,1,1\n0.5,1,1\n1,1,1\n").unwrap()[0];
    /// let profile = Profile { h: vec![0.0, 1.0], v_g: vec![1.0, 1.0], shape: vec![1.0, 1.3] };
    /// let deviation = Deviation::between(&profile, trial);
    /// assert_eq!(deviation.v_g, 0.0);
    /// assert!((deviation.shape - (0.15_f64.powi(2) + 0.3_f64.powi(2)).sqrt() / 3.0_f64.sqrt()).abs() < 1e-12);
    /// ```
    pub fn between(profile: &Profile, trial: &Trial) -> Self {
        let at_rest = [0.0, profile.shape.last().copied().unwrap_or(1.0)];
        let mut squares = [0.0; 2];
        for frame in &trial.frames {
            let [v_g, shape] = profile.at(frame.h).unwrap_or(at_rest);
            let deviations = [(v_g - frame.v_g) / frame.v_g_error, (shape - frame.shape) / frame.shape_error];
            squares = [0, 1].map(|k| squares[k] + deviations[k] * deviations[k]);
        }
        let [v_g, shape] = squares.map(|sum| (sum / trial.frames.len() as f64).sqrt());
        Self { v_g, shape, missed: (trial.range()[1] - profile.reach()).max(0.0) }
    }

    /// What the search minimises, `Delta_v (1 + missed)`.
    pub(super) fn cost(&self) -> f64 {
        self.v_g * (1.0 + self.missed)
    }
}

/// Standard errors of Gamma and b0 from the curvature of Delta_v^2 at its minimum, for any noise of the frames.
///
/// Let `r_i = (v_sim(h_i) - v_i)/e_i` be the deviations and `g_i = (dv/dGamma, dv/db0)/e_i` the derivatives of the
/// simulated speeds, from the difference of two profiles `[lower, upper]` in each parameter. The covariance is
///
/// ```text
/// n/(n - 2) H^-1 (sum_i r_i^2 g_i g_i^T) H^-1,   H = sum_i g_i g_i^T   (White, Econometrica 48, 817 (1980)).
/// ```
///
/// The usual `s^2 H^-1` would be too small for noise that grows with the speed. `None` if a profile does not reach all
/// frames, or if the frames cannot distinguish the two parameters.
pub(super) fn curvature_errors(
    trial: &Trial,
    best: &Profile,
    neighbours: [[(Parameters, &Profile); 2]; 2],
) -> Option<[f64; 2]> {
    let widths = [neighbours[0][1].0.gamma - neighbours[0][0].0.gamma, neighbours[1][1].0.b0 - neighbours[1][0].0.b0];
    let (mut curvature, mut noise) = (Matrix2::zeros(), Matrix2::zeros());
    for frame in &trial.frames {
        let mut slopes = Vector2::zeros();
        for k in 0..2 {
            let [[low, _], [high, _]] = [neighbours[k][0].1.at(frame.h)?, neighbours[k][1].1.at(frame.h)?];
            slopes[k] = (high - low) / widths[k] / frame.v_g_error;
        }
        let deviation = (best.at(frame.h)?[0] - frame.v_g) / frame.v_g_error;
        let square = slopes * slopes.transpose();
        curvature += square;
        noise += square * (deviation * deviation);
    }
    // Slopes that are proportional to each other make the determinant vanish.
    let told_apart = curvature.determinant() > 1e-12 * curvature[(0, 0)] * curvature[(1, 1)];
    let inverse = curvature.try_inverse().filter(|_| told_apart)?;
    let n = trial.frames.len() as f64;
    let covariance = inverse * noise * inverse * (n / (n - 2.0));
    let errors = [0, 1].map(|k| covariance[(k, k)].sqrt());
    errors.iter().all(|error| error.is_finite()).then_some(errors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::calibrate::frames::Frame;

    fn trial(points: &[(f64, f64)]) -> Trial {
        let frame = |&(h, v_g): &(f64, f64)| Frame { h, v_g, shape: 1.0, v_g_error: 1.0, shape_error: 1.0 };
        Trial { name: None, frames: points.iter().map(frame).collect() }
    }

    fn flat(v_g: f64, reach: f64) -> Profile {
        Profile { h: vec![-1.0, reach], v_g: vec![v_g; 2], shape: vec![1.0; 2] }
    }

    #[test]
    fn a_droplet_that_stays_behind_costs_more_the_sooner_it_rests() {
        let trial = trial(&[(-0.5, 1.0), (0.0, 1.0), (0.5, 1.0)]);
        let cost = |reach| Deviation::between(&flat(1.0, reach), &trial).cost();
        assert_eq!(cost(0.6), 0.0);
        assert!(0.0 < cost(0.2) && cost(0.2) < cost(0.1) && cost(0.1) < cost(-0.3));
    }

    #[test]
    fn errors_of_a_frame_are_its_unit() {
        let mut trial = trial(&[(-0.5, 1.0), (0.0, 1.0), (0.5, 1.0)]);
        trial.frames.iter_mut().for_each(|frame| frame.v_g_error = 0.1);
        assert!((Deviation::between(&flat(1.2, 1.0), &trial).v_g - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_curvature_of_a_straight_line_gives_the_errors_of_its_formula() {
        // v = gamma + b0 h, at h = -1, 0, 1 with deviations 0.1, -0.2, 0.1 from it.
        let trial = trial(&[(-1.0, 0.1), (0.0, -0.2), (1.0, 0.1)]);
        let line = |gamma: f64, b0: f64| {
            let h = vec![-1.5, 1.5];
            let v_g = h.iter().map(|h| gamma + b0 * h).collect();
            (Parameters { gamma, b0 }, Profile { h, v_g, shape: vec![1.0; 2] })
        };
        let [g0, g1, b0, b1] = [line(-0.5, 0.0), line(0.5, 0.0), line(0.0, -0.5), line(0.0, 0.5)];
        let best = line(0.0, 0.0).1;
        let neighbours = [[(g0.0, &g0.1), (g1.0, &g1.1)], [(b0.0, &b0.1), (b1.0, &b1.1)]];
        let [gamma, slope] = curvature_errors(&trial, &best, neighbours).unwrap();
        assert!((gamma - 0.02_f64.sqrt()).abs() < 1e-12 && (slope - 0.015_f64.sqrt()).abs() < 1e-12);
        let same = [neighbours[0], neighbours[0]];
        assert_eq!(curvature_errors(&trial, &best, same), None);
    }
}

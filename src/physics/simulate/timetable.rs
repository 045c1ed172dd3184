//! When a droplet is checked and recorded, in time steps.

use crate::parameters::Point;

/// Longest simulated time between two checks of a droplet, in t0.
const CHECK_EVERY: f64 = 1.0;

/// The times of checks, samples and outlines, which depend only on the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Timetable {
    /// Steps between two checks.
    check: u64,
    checks_per_sample: u64,
    checks_per_outline: Option<u64>,
    /// Steps until the time limit.
    pub(super) end: u64,
}

impl Timetable {
    pub(super) fn of(point: &Point) -> Self {
        let dt = point.stepping.dt;
        // As few checks per sample as the limit allows, or up to twice as many if they then fall on whole steps.
        let (fewest, steps) = ((point.sample_every / CHECK_EVERY).ceil().max(1.0) as u64, point.sample_every / dt);
        let whole = |checks: &u64| ((steps / *checks as f64).round() * *checks as f64 - steps).abs() < 1e-6 * steps;
        let checks_per_sample = (fewest..=2 * fewest).find(whole).unwrap_or(fewest);
        let check = (steps / checks_per_sample as f64).round().max(1.0) as u64;
        let end = (point.limits.t_max / dt - 1e-6).ceil().max(1.0) as u64;
        let in_checks = |time: f64| (time / (check as f64 * dt)).round().max(1.0) as u64;
        let checks_per_outline = point.shapes_every.map(in_checks);
        Self { check, checks_per_sample, checks_per_outline, end }
    }

    /// The step of the check after `step`.
    pub(super) fn next(self, step: u64) -> u64 {
        (step + self.check).min(self.end)
    }

    /// Whether a sample is due after this many checks.
    pub(super) fn is_sample(self, checks: u64) -> bool {
        checks.is_multiple_of(self.checks_per_sample)
    }

    /// Whether an outline is due after this many checks.
    pub(super) fn is_outline(self, checks: u64) -> bool {
        self.checks_per_outline.is_some_and(|every| checks.is_multiple_of(every))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, Integrator, Limits, Model, ObstacleField, Scene, Soft, Stepping};

    fn point(sample_every: f64, dt: f64) -> Point {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Saturated, box_size: 30.0 };
        let point = Point::new(Model::Soft(Soft { e_w: 1.0 }), Scene::Obstacles(field));
        let limits = Limits { t_max: 25.0, ..point.limits };
        Point { sample_every, limits, stepping: Stepping { integrator: Integrator::Verlet, dt }, ..point }
    }

    #[test]
    fn checks_come_at_least_every_t0_and_divide_the_sampling_interval() {
        let timetable = Timetable::of(&point(10.0, 1e-3));
        assert_eq!(timetable, Timetable { check: 1000, checks_per_sample: 10, checks_per_outline: None, end: 25_000 });
        let outlines = Timetable::of(&Point { shapes_every: Some(3.0), ..point(0.25, 1e-3) });
        assert_eq!(outlines, Timetable { check: 250, checks_per_sample: 1, checks_per_outline: Some(12), end: 25_000 });
        let coarse = Timetable::of(&point(2.5, 0.0625));
        assert_eq!((coarse.check, coarse.checks_per_sample), (10, 4), "forty steps, a quarter of them at a time");
        let odd = Timetable::of(&point(2.5, 3e-4));
        assert!((odd.check as f64 * odd.checks_per_sample as f64 * 3e-4 - 2.5).abs() < 3e-3);
    }
}

//! From a job to its trajectory: picks the concrete types once, then drives the motion from check to check.

mod start;

pub use start::is_linear;

use crate::droplet::Observation;
use crate::droplet::deformable::Ring;
use crate::droplet::soft::SoftMotion;
use crate::effects::self_contact;
use crate::effects::self_contact::apart::Apart;
use crate::effects::{Drag, EdgeForce};
use crate::integrator::guard::GuardedMotion;
use crate::integrator::implicit::ImplicitMotion;
use crate::job::{Engulfed, Job, Model, Point, Scene};
use crate::mechanism;
use crate::observe::{Effort, Recorder};
use crate::scene::library::ArrayLibrary;
use crate::scene::wall::Walls;
use crate::shape::ShapeRecord;
use crate::trajectory::{Clog, Failure, FailureClass, Outcome, Trajectory};
use fearless_simd::Level;
use std::sync::atomic::{AtomicBool, Ordering};

/// Longest simulated time between two looks at a droplet, in t0.
const CHECK_EVERY: f64 = 1.0;

/// Rise of the total energy over its lowest value so far that only an instability can cause.
const ENERGY_RISE_LIMIT: f64 = 0.05;

/// What a simulation needs besides its job.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The shared obstacle arrays.
    pub arrays: &'a ArrayLibrary,
    /// The instruction set.
    pub level: Level,
    /// Set to end all simulations at their next check.
    pub stop: &'a AtomicBool,
}

/// A droplet in motion, whatever its model.
pub(crate) trait Motion {
    /// Takes time steps; fails where one cannot be taken, the droplet then being where that step began.
    fn advance(&mut self, steps: u64) -> Result<(), Failure>;
    /// Moves the local origin next to the droplet.
    fn follow(&mut self);
    /// Reads off everything recorded.
    fn observe(&mut self) -> Observation;
    /// The shape and its loads.
    fn shape(&self, t: f64) -> ShapeRecord;
    /// Where a wall lies inside the droplet.
    fn engulfed(&self) -> Option<[f64; 2]>;
    /// The droplet's outline, if it has one.
    fn ring(&self) -> Option<&Ring>;
    /// Stretches or sub-steps of time refused so far.
    fn refused(&self) -> u64;
}

impl<E: EdgeForce, D: Drag> Motion for GuardedMotion<E, D> {
    fn advance(&mut self, steps: u64) -> Result<(), Failure> {
        GuardedMotion::advance(self, steps)
    }
    fn follow(&mut self) {
        self.motion.follow();
    }
    fn observe(&mut self) -> Observation {
        self.motion.observe()
    }
    fn shape(&self, t: f64) -> ShapeRecord {
        self.motion.effects.shape(&self.motion.ring, t)
    }
    fn engulfed(&self) -> Option<[f64; 2]> {
        self.motion.engulfed()
    }
    fn ring(&self) -> Option<&Ring> {
        Some(&self.motion.ring)
    }
    fn refused(&self) -> u64 {
        self.refused
    }
}

impl<E: EdgeForce, D: Drag> Motion for ImplicitMotion<E, D> {
    fn advance(&mut self, steps: u64) -> Result<(), Failure> {
        ImplicitMotion::advance(self, steps)
    }
    fn follow(&mut self) {
        ImplicitMotion::follow(self);
    }
    fn observe(&mut self) -> Observation {
        ImplicitMotion::observe(self)
    }
    fn shape(&self, t: f64) -> ShapeRecord {
        self.effects.shape(&self.ring, t)
    }
    fn engulfed(&self) -> Option<[f64; 2]> {
        ImplicitMotion::engulfed(self)
    }
    fn ring(&self) -> Option<&Ring> {
        Some(&self.ring)
    }
    fn refused(&self) -> u64 {
        self.work.refused
    }
}

impl<W: Walls> Motion for SoftMotion<W> {
    fn advance(&mut self, steps: u64) -> Result<(), Failure> {
        SoftMotion::advance(self, steps);
        Ok(())
    }
    fn follow(&mut self) {
        SoftMotion::follow(self);
    }
    fn observe(&mut self) -> Observation {
        SoftMotion::observe(self)
    }
    fn shape(&self, t: f64) -> ShapeRecord {
        SoftMotion::shape(self, t)
    }
    fn engulfed(&self) -> Option<[f64; 2]> {
        None
    }
    fn ring(&self) -> Option<&Ring> {
        None
    }
    fn refused(&self) -> u64 {
        0
    }
}

/// Computes the trajectory of a job; `None` if it was told to stop before the end.
///
/// # Errors
/// A [`Failure`] when the job cannot start, or its numbers leave the range that physics allows.
pub fn simulate(job: &Job, context: Context<'_>) -> Result<Option<Trajectory>, Failure> {
    let mut motion = start::start(job, context.arrays, context.level)?;
    drive(motion.as_mut(), &job.point, context.stop)
}

/// The times at which a run is looked at, in steps; they depend on the point alone.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Timetable {
    check: u64,
    checks_per_sample: u64,
    checks_per_shape: Option<u64>,
    end: u64,
}

impl Timetable {
    fn of(point: &Point) -> Self {
        let dt = point.stepping.dt;
        let checks_per_sample = (point.sample_every / CHECK_EVERY).ceil().max(1.0);
        let check = (point.sample_every / checks_per_sample / dt).round().max(1.0) as u64;
        let end = (point.limits.t_max / dt - 1e-6).ceil().max(1.0) as u64;
        let in_checks = |time: f64| (time / (check as f64 * dt)).round().max(1.0) as u64;
        let checks_per_shape = point.shapes_every.map(in_checks);
        Self { check, checks_per_sample: checks_per_sample as u64, checks_per_shape, end }
    }
}

/// Advances from check to check until the run ends.
fn drive(motion: &mut dyn Motion, point: &Point, stop: &AtomicBool) -> Result<Option<Trajectory>, Failure> {
    let timetable = Timetable::of(point);
    let dt = point.stepping.dt;
    let begin = motion.observe();
    let mut recorder = Recorder::new(point, begin);
    let mut shape = motion.shape(0.0);
    if point.shapes_every.is_some() {
        recorder.keep(shape.clone());
    }
    let distance = point.limits.distance.unwrap_or(f64::INFINITY);
    let threshold = point.limits.ek_threshold;
    let (delta, apart, fail_engulfed) = match &point.model {
        Model::Deformable(ring) => (ring.delta, Apart::of(ring), ring.engulfed == Engulfed::Fail),
        Model::Soft(_) => (0.0, Apart::Way, false),
    };
    // Where a droplet counts as through, and what coming to rest is called.
    let (h_end, at_rest) = match &point.scene {
        Scene::Obstacles(_) => (f64::INFINITY, Outcome::Clogged),
        Scene::Channel(channel) => (channel.h_end, Outcome::Clogged),
        Scene::Disc(disc) => (disc.h_end, Outcome::Clogged),
        Scene::Plate => (f64::INFINITY, Outcome::Settled),
    };
    // A clog must show at two checks in a row: a turning point is at rest for an instant only.
    let (mut has_moved, mut was_below) = (false, false);
    let (mut lowest_energy, mut checks, mut step) = (begin.kinetic + begin.potential, 0_u64, 0_u64);
    loop {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let next = (step + timetable.check).min(timetable.end);
        if let Err(failure) = motion.advance(next - step) {
            let shape = motion.shape(failure.step as f64 * dt);
            return Err(Failure { shape: Some(Box::new(shape)), ..failure });
        }
        motion.follow();
        step = next;
        checks += 1;
        let t = step as f64 * dt;
        let seen = motion.observe();
        let fail = |class, reason, shape| Failure { class, reason, step, shape: Some(Box::new(shape)) };
        let energy = seen.kinetic + seen.potential;
        let rise = energy - lowest_energy;
        if !(rise < ENERGY_RISE_LIMIT) {
            let reason =
                format!("the total energy rose by {rise:.3e} at t = {t}; lower dt, or see it with `meniscus render`");
            // Nothing sound is left of the droplet, so the shape of the check before is kept.
            return Err(fail(FailureClass::Unstable, reason, shape));
        }
        shape = motion.shape(t);
        if let Some([x, y]) = motion.engulfed() {
            if fail_engulfed {
                let reason = format!(
                    "the obstacle at ({x:.3}, {y:.3}) lies inside the droplet at t = {t}; raise e_w, or see it with `meniscus render`"
                );
                return Err(fail(FailureClass::Engulfed, reason, shape));
            }
            recorder.mark_engulfed(t);
        }
        if motion.ring().is_some_and(|ring| self_contact::crosses(ring, delta, apart)) {
            let reason = format!("the droplet's outline crosses itself at t = {t}");
            return Err(fail(FailureClass::Crossed, reason, shape));
        }
        lowest_energy = lowest_energy.min(energy);
        recorder.watch(&seen, rise);
        let ek_ratio = recorder.ek_ratio(&seen);
        let is_below = ek_ratio < threshold;
        has_moved |= !is_below;
        let clogged = has_moved && is_below && was_below;
        was_below = is_below;
        let outcome = if clogged {
            Some(at_rest)
        } else if seen.x >= h_end {
            Some(Outcome::Exited)
        } else if recorder.displacement(&seen) >= distance {
            Some(Outcome::Distance)
        } else if step == timetable.end {
            Some(Outcome::TimeLimit)
        } else {
            None
        };
        if outcome.is_some() || checks % timetable.checks_per_sample == 0 {
            recorder.record(t, &seen);
        }
        if outcome.is_some() || timetable.checks_per_shape.is_some_and(|every| checks % every == 0) {
            recorder.keep(shape.clone());
        }
        if let Some(outcome) = outcome {
            let clog = (outcome == Outcome::Clogged).then(|| Clog {
                t,
                r: recorder.displacement(&seen),
                x: seen.x,
                y: seen.y,
                ek_ratio,
                shape: seen.shape,
                contacts: seen.contacts,
                mechanism: mechanism::of(&shape),
            });
            return Ok(Some(recorder.finish(
                outcome,
                t,
                Effort { steps: step, refused: motion.refused() },
                &seen,
                clog,
            )));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{Density, Integrator, Limits, ObstacleField, Soft, Stepping};

    fn point(sample_every: f64, dt: f64) -> Point {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Saturated, box_size: 30.0 };
        let point = Point::new(Model::Soft(Soft { e_w: 1.0 }), Scene::Obstacles(field));
        let limits = Limits { t_max: 25.0, ..point.limits };
        Point { sample_every, limits, stepping: Stepping { integrator: Integrator::Verlet, dt }, ..point }
    }

    #[test]
    fn checks_come_at_least_every_t0_and_divide_the_sampling_interval() {
        let timetable = Timetable::of(&point(10.0, 1e-3));
        assert_eq!(timetable, Timetable { check: 1000, checks_per_sample: 10, checks_per_shape: None, end: 25_000 });
        let shapes = Timetable::of(&Point { shapes_every: Some(3.0), ..point(0.25, 1e-3) });
        assert_eq!(shapes, Timetable { check: 250, checks_per_sample: 1, checks_per_shape: Some(12), end: 25_000 });
        let odd = Timetable::of(&point(2.5, 3e-4));
        assert!((odd.check as f64 * odd.checks_per_sample as f64 * 3e-4 - 2.5).abs() < 3e-3);
    }
}

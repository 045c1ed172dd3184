//! From a job to its trajectory: picks the concrete types once, then drives the motion from check to check.

pub mod mechanism;
pub mod record;
mod snapshot;
pub mod stability;
mod start;

pub use snapshot::{Keeper, MotionState, NoKeeper, Snapshot};
pub use start::is_linear;

use crate::parameters::{Engulfed, Job, Model, Point, Scene};
use crate::physics::motion::guard::GuardedMotion;
use crate::physics::motion::implicit::ImplicitMotion;
use crate::physics::observation::Observation;
use crate::physics::point::SoftMotion;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::self_contact;
use crate::physics::ring::forces::self_contact::apart::Apart;
use crate::physics::ring::forces::{Drag, EdgeForce};
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::record::{Effort, Recorder};
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::physics::walls::wall::Walls;
use crate::results::outline::Outline;
use crate::results::trajectory::{Clog, Failure, FailureClass, Outcome, Trajectory};
use snapshot::Course;
use start::NotStarted;
use std::sync::atomic::AtomicBool;

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
    pub instruction_set: InstructionSet,
    /// Set to end all simulations within some ten milliseconds.
    pub stop: &'a AtomicBool,
}

/// A droplet in motion, whatever its model.
pub(crate) trait Motion {
    /// Takes time steps; fails where one cannot be taken, the droplet then being where that step began. False once `stop` is
    /// set, the droplet then being somewhere on the way.
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<bool, Failure>;
    /// What decides how it goes on.
    fn state(&self) -> MotionState;
    /// Moves the local origin next to the droplet.
    fn follow(&mut self);
    /// Reads off everything recorded.
    fn observe(&mut self) -> Observation;
    /// The outline and its loads.
    fn outline(&self, t: f64) -> Outline;
    /// Where a wall lies inside the droplet.
    fn engulfed(&self) -> Option<[f64; 2]>;
    /// The droplet's outline, if it has one.
    fn ring(&self) -> Option<&Ring>;
    /// Stretches or sub-steps of time refused so far.
    fn refused(&self) -> u64;
}

impl<E: EdgeForce, D: Drag> Motion for GuardedMotion<E, D> {
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<bool, Failure> {
        self.advance_unless(stop, steps)
    }
    fn state(&self) -> MotionState {
        MotionState::Verlet(GuardedMotion::state(self))
    }
    fn follow(&mut self) {
        self.motion.follow();
    }
    fn observe(&mut self) -> Observation {
        GuardedMotion::observe(self)
    }
    fn outline(&self, t: f64) -> Outline {
        self.motion.effects.outline(&self.motion.ring, t)
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
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<bool, Failure> {
        self.advance_unless(stop, steps)
    }
    fn state(&self) -> MotionState {
        MotionState::Implicit(Box::new(ImplicitMotion::state(self)))
    }
    fn follow(&mut self) {
        ImplicitMotion::follow(self);
    }
    fn observe(&mut self) -> Observation {
        ImplicitMotion::observe(self)
    }
    fn outline(&self, t: f64) -> Outline {
        self.effects.outline(&self.ring, t)
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
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<bool, Failure> {
        Ok(self.advance_unless(stop, steps))
    }
    fn state(&self) -> MotionState {
        MotionState::Soft(SoftMotion::state(self))
    }
    fn follow(&mut self) {
        SoftMotion::follow(self);
    }
    fn observe(&mut self) -> Observation {
        SoftMotion::observe(self)
    }
    fn outline(&self, t: f64) -> Outline {
        SoftMotion::outline(self, t)
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
    match go_on(job, context, None, &mut NoKeeper)? {
        Ended::Finished(trajectory) => Ok(Some(*trajectory)),
        Ended::Stopped(_) | Ended::WrongSnapshot => Ok(None),
    }
}

/// How a computation of a trajectory ended, if not in a failure.
#[derive(Debug)]
pub enum Ended {
    /// The trajectory came to its end.
    Finished(Box<Trajectory>),
    /// It was told to stop, and can go on from here; from its beginning if it had not begun to move.
    Stopped(Option<Box<Snapshot>>),
    /// The snapshot is not one of this job; nothing was done.
    WrongSnapshot,
}

/// Computes the trajectory of a job, from a snapshot on if there is one: with the same bits as without a break.
///
/// # Errors
/// As [`simulate`].
pub fn go_on(
    job: &Job,
    context: Context<'_>,
    from: Option<&Snapshot>,
    keeper: &mut dyn Keeper,
) -> Result<Ended, Failure> {
    let mut motion = match start::start(job, context, from.map(|snapshot| &snapshot.motion)) {
        Ok(motion) => motion,
        Err(NotStarted::Failed(failure)) => return Err(failure),
        Err(NotStarted::Stopped) => return Ok(Ended::Stopped(None)),
        Err(NotStarted::WrongState(_)) => return Ok(Ended::WrongSnapshot),
    };
    let course = match from {
        Some(snapshot) if snapshot.course.step >= Timetable::of(&job.point).end => return Ok(Ended::WrongSnapshot),
        Some(snapshot) => snapshot.course.clone(),
        None => begin(motion.as_mut(), &job.point),
    };
    drive(motion.as_mut(), &job.point, course, context.stop, keeper)
}

/// The times at which a run is looked at, in steps; they depend on the point alone.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Timetable {
    check: u64,
    checks_per_sample: u64,
    checks_per_outline: Option<u64>,
    end: u64,
}

impl Timetable {
    fn of(point: &Point) -> Self {
        let dt = point.stepping.dt;
        // As few checks a sample as hold the limit, or up to twice as many if they then fall on whole steps.
        let (fewest, steps) = ((point.sample_every / CHECK_EVERY).ceil().max(1.0) as u64, point.sample_every / dt);
        let whole = |checks: &u64| ((steps / *checks as f64).round() * *checks as f64 - steps).abs() < 1e-6 * steps;
        let checks_per_sample = (fewest..=2 * fewest).find(whole).unwrap_or(fewest);
        let check = (steps / checks_per_sample as f64).round().max(1.0) as u64;
        let end = (point.limits.t_max / dt - 1e-6).ceil().max(1.0) as u64;
        let in_checks = |time: f64| (time / (check as f64 * dt)).round().max(1.0) as u64;
        let checks_per_outline = point.shapes_every.map(in_checks);
        Self { check, checks_per_sample, checks_per_outline, end }
    }
}

/// A run before its first step.
fn begin(motion: &mut dyn Motion, point: &Point) -> Course {
    let begin = motion.observe();
    let mut recorder = Recorder::new(point, begin);
    let outline = motion.outline(0.0);
    if point.shapes_every.is_some() {
        recorder.keep(outline.clone());
    }
    let lowest_energy = begin.energy();
    Course { step: 0, checks: 0, has_moved: false, was_below: false, lowest_energy, outline, recorder }
}

/// Advances from check to check until the run ends.
fn drive(
    motion: &mut dyn Motion,
    point: &Point,
    mut course: Course,
    stop: &AtomicBool,
    keeper: &mut dyn Keeper,
) -> Result<Ended, Failure> {
    let timetable = Timetable::of(point);
    let dt = point.stepping.dt;
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
    loop {
        let here = motion.state();
        if keeper.wants() {
            keeper.keep(Snapshot { course: course.clone(), motion: here.clone() });
        }
        let next = (course.step + timetable.check).min(timetable.end);
        match motion.advance(next - course.step, stop) {
            Ok(true) => {}
            // Of the way since the check nothing is kept.
            Ok(false) => return Ok(Ended::Stopped(Some(Box::new(Snapshot { course, motion: here })))),
            Err(failure) => {
                let outline = motion.outline(failure.step as f64 * dt);
                return Err(Failure { outline: Some(Box::new(outline)), ..failure });
            }
        }
        motion.follow();
        course.step = next;
        course.checks += 1;
        let (step, checks, recorder) = (course.step, course.checks, &mut course.recorder);
        let t = step as f64 * dt;
        let seen = motion.observe();
        let fail = |class, reason, outline| Failure { class, reason, step, outline: Some(Box::new(outline)) };
        let energy = seen.energy();
        let rise = energy - course.lowest_energy;
        if !(rise < ENERGY_RISE_LIMIT) {
            let reason =
                format!("the total energy rose by {rise:.3e} at t = {t}; lower dt, or see it with `meniscus render`");
            // Nothing sound is left of the droplet, so the outline of the check before is kept.
            return Err(fail(FailureClass::Unstable, reason, course.outline));
        }
        course.outline = motion.outline(t);
        if let Some([x, y]) = motion.engulfed() {
            if fail_engulfed {
                let reason = format!(
                    "the obstacle at ({x:.3}, {y:.3}) lies inside the droplet at t = {t}; raise e_w, or see it with `meniscus render`"
                );
                return Err(fail(FailureClass::Engulfed, reason, course.outline));
            }
            recorder.mark_engulfed(t);
        }
        if motion.ring().is_some_and(|ring| self_contact::crosses(ring, delta, apart)) {
            let reason = format!("the droplet's outline crosses itself at t = {t}");
            return Err(fail(FailureClass::Crossed, reason, course.outline));
        }
        course.lowest_energy = course.lowest_energy.min(energy);
        recorder.watch(&seen, rise);
        let ek_ratio = recorder.ek_ratio(&seen);
        let is_below = ek_ratio < threshold;
        course.has_moved |= !is_below;
        // At two checks in a row: a turning point is at rest for an instant only.
        let clogged = course.has_moved && is_below && course.was_below;
        course.was_below = is_below;
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
        if outcome.is_some() || timetable.checks_per_outline.is_some_and(|every| checks % every == 0) {
            recorder.keep(course.outline.clone());
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
                mechanism: mechanism::of(&course.outline),
            });
            let effort = Effort { steps: step, refused: motion.refused() };
            return Ok(Ended::Finished(Box::new(course.recorder.finish(outcome, t, effort, &seen, clog))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, Integrator, Limits, ObstacleField, Soft, Stepping};

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

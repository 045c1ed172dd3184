//! From a job to its trajectory: `start` the droplet, `drive` it from check to check by the `timetable`, `judge` and
//! `record` it at each check. A droplet that its time limit cuts off may be at rest already: `arrest` finds out.
//!
//! A caller needs only [`simulate`], or [`go_on`] with [`Snapshot`] and [`Keeper`] for a trajectory that may be stopped
//! and taken up again. [`stability`] tells the largest stable step before a job starts, [`mechanism`] how a clog holds.

mod arrest;
mod drive;
mod judge;
pub mod mechanism;
mod record;
mod snapshot;
pub mod stability;
mod start;
mod timetable;

pub use snapshot::{EndState, Keeper, NoKeeper, Sighting, Snapshot};

use crate::parameters::{Job, Point};
use crate::physics::motion::Interruption;
use crate::physics::simd::InstructionSet;
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::results::trajectory::{Failure, Trajectory};
use std::sync::atomic::AtomicBool;
use timetable::Timetable;

/// What a simulation needs besides its job.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// The shared obstacle arrays.
    pub arrays: &'a ArrayLibrary,
    /// The instruction set.
    pub instruction_set: InstructionSet,
    /// Simulations stop within some ten milliseconds after this is set.
    pub stop: &'a AtomicBool,
}

/// How the computation of a trajectory ended, if it did not fail.
#[derive(Debug)]
pub enum RunEnded {
    /// The trajectory came to its end.
    Finished(Box<Trajectory>),
    /// It was told to stop, and can go on from this snapshot; without one, from its beginning.
    Stopped(Option<Box<Snapshot>>),
    /// The snapshot does not belong to this job; nothing was done.
    WrongSnapshot,
}

/// Computes the trajectory of a job; `None` if it was told to stop before the end.
///
/// ```
/// use meniscus::parameters::{Job, Model, Point, Scene, Soft};
/// use meniscus::physics::simd::best_instruction_set;
/// use meniscus::physics::simulate::{Context, simulate};
/// use meniscus::physics::walls::arrays::library::ArrayLibrary;
/// use std::sync::{Arc, atomic::AtomicBool};
///
/// let point = Point::new(Model::Soft(Soft { e_w: 5.0 }), Scene::Plate);
/// let job = Job { point_id: point.id(), point: Arc::new(point), seed: 0 };
/// let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
/// let context = Context { arrays: &arrays, instruction_set: best_instruction_set(), stop: &stop };
/// let trajectory = simulate(&job, context).expect("it can be computed").expect("nobody stops it");
/// // On a plate a soft particle sinks by pi/(16 E_w).
/// assert!((trajectory.delta_s.unwrap() - std::f64::consts::PI / 80.0).abs() < 1e-9);
/// ```
///
/// # Errors
/// A [`Failure`] when the job cannot start, or its numbers leave the range that physics allows.
pub fn simulate(job: &Job, context: Context<'_>) -> Result<Option<Trajectory>, Failure> {
    match go_on(job, context, None, &mut NoKeeper)? {
        RunEnded::Finished(trajectory) => Ok(Some(*trajectory)),
        RunEnded::Stopped(_) | RunEnded::WrongSnapshot => Ok(None),
    }
}

/// The time step at which the time limit of a point ends a trajectory.
pub fn last_step(point: &Point) -> u64 {
    Timetable::of(point).end
}

/// Computes the trajectory of a job, from a snapshot on if there is one. A break changes no bit.
///
/// # Errors
/// As [`simulate`].
pub fn go_on(
    job: &Job,
    context: Context<'_>,
    from: Option<&Snapshot>,
    keeper: &mut dyn Keeper,
) -> Result<RunEnded, Failure> {
    if from.is_some_and(|snapshot| !snapshot.is_before_the_end_of(&job.point)) {
        return Ok(RunEnded::WrongSnapshot);
    }
    let mut motion = match start::start(job, context, from.map(|snapshot| &snapshot.motion)) {
        Ok(Some(motion)) => motion,
        Ok(None) => return Ok(RunEnded::WrongSnapshot),
        Err(Interruption::Stopped) => return Ok(RunEnded::Stopped(None)),
        Err(Interruption::Failed(failure)) => return Err(failure),
    };
    let course = match from {
        Some(snapshot) => snapshot.course.clone(),
        None => drive::begin(motion.as_mut(), &job.point),
    };
    drive::drive(motion.as_mut(), &job.point, course, context.stop, keeper)
}

//! A trajectory at one of its checks: everything that decides how it goes on, bit for bit.

use crate::parameters::Point;
use crate::physics::motion::MotionState;
use crate::physics::motion::implicit::StepCounts;
use crate::physics::simulate::record::{Recorded, Recorder};
use crate::physics::simulate::timetable::Timetable;
use crate::results::outline::Outline;
use crate::results::trajectory::Samples;
use serde::{Deserialize, Serialize};

/// How far a trajectory has come, at a check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    pub(super) step: u64,
    pub(super) checks: u64,
    pub(super) has_moved: bool,
    /// Whether it was at rest at this check; a clog needs two such checks in a row.
    pub(super) was_below: bool,
    /// Lowest total energy at any check so far.
    pub(super) lowest_energy: f64,
    pub(super) outline: Outline,
    pub(super) recorder: Recorder,
}

/// How far a trajectory had come at a check, without what was recorded until then.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    step: u64,
    checks: u64,
    has_moved: bool,
    was_below: bool,
    lowest_energy: f64,
    recorded: Recorded,
}

impl Course {
    pub(super) fn mark(&self) -> Mark {
        let Self { step, checks, has_moved, was_below, lowest_energy, .. } = *self;
        Mark { step, checks, has_moved, was_below, lowest_energy, recorded: self.recorder.recorded() }
    }

    /// Puts the course back to the check at which it had this mark and this outline.
    pub(super) fn rewind(self, mark: Mark, outline: Outline) -> Self {
        let Mark { step, checks, has_moved, was_below, lowest_energy, recorded } = mark;
        let recorder = self.recorder.rewind(recorded);
        Self { step, checks, has_moved, was_below, lowest_energy, outline, recorder }
    }
}

/// A trajectory at one of its checks, ready to be saved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    pub(super) course: Course,
    pub(super) motion: MotionState,
}

/// What had happened until a check, and what it took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Obstacles that carry load.
    pub contacts: usize,
    /// E_k/E_t at the last sample.
    pub ek_ratio: f64,
    /// Steps so far; explicit schemes count theirs as accepted.
    pub counts: StepCounts,
}

impl Snapshot {
    /// Time steps taken so far.
    pub fn step(&self) -> u64 {
        self.course.step
    }

    /// What had happened until this check.
    pub fn sighting(&self) -> Sighting {
        let explicit = StepCounts { accepted: self.step(), ..StepCounts::default() };
        Sighting {
            contacts: self.course.outline.loads.len(),
            ek_ratio: self.course.recorder.samples.ek_ratio.last().copied().unwrap_or(1.0),
            counts: self.motion.counts().unwrap_or(explicit),
        }
    }

    /// Whether a trajectory of `point` has steps left from here.
    pub(super) fn is_before_the_end_of(&self, point: &Point) -> bool {
        self.course.step < Timetable::of(point).end
    }
}

/// A trajectory at the check before its last one, from which it goes on under a larger time limit or distance.
///
/// The last check may come early, because a limit falls between two regular checks; all checks before it are those of a
/// trajectory without limits. Series and outlines are left out, because the result of the trajectory has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndState {
    course: Course,
    motion: MotionState,
    /// How many samples and outlines there were.
    samples: usize,
    outlines: usize,
}

impl EndState {
    /// The state of a trajectory that has come to its end, at the check that had this mark, outline and motion.
    pub(super) fn of(course: &Course, mark: Mark, outline: Outline, motion: MotionState) -> Self {
        let Mark { step, checks, has_moved, was_below, lowest_energy, recorded } = mark;
        let recorder = course.recorder.emptied(recorded);
        Self {
            course: Course { step, checks, has_moved, was_below, lowest_energy, outline, recorder },
            motion,
            samples: recorded.samples,
            outlines: recorded.outlines,
        }
    }

    /// Time steps taken so far.
    pub fn step(&self) -> u64 {
        self.course.step
    }

    /// The snapshot, with the series and outlines that the trajectory ended with. `None` if they are too short.
    pub fn snapshot(self, mut samples: Samples, mut outlines: Vec<Outline>) -> Option<Snapshot> {
        let Self { mut course, motion, samples: some, outlines: few } = self;
        if samples.len() < some || outlines.len() < few {
            return None;
        }
        samples.truncate(some);
        outlines.truncate(few);
        (course.recorder.samples, course.recorder.outlines) = (samples, outlines);
        Some(Snapshot { course, motion })
    }
}

/// Takes snapshots of a trajectory, which it cannot change.
pub trait Keeper {
    /// Whether a snapshot is wanted now; asked at every check.
    fn wants(&mut self) -> bool;
    /// Takes a snapshot.
    fn keep(&mut self, snapshot: Snapshot);
    /// Whether the end state is wanted; asked when the trajectory has come to its end.
    fn wants_end(&self) -> bool {
        false
    }
    /// Takes the end state.
    fn keep_end(&mut self, _: EndState) {}
}

/// Keeps nothing.
#[derive(Clone, Copy, Debug)]
pub struct NoKeeper;

impl Keeper for NoKeeper {
    fn wants(&mut self) -> bool {
        false
    }
    fn keep(&mut self, _: Snapshot) {}
}

//! A trajectory at one of its checks: everything that decides how it goes on, bit for bit.

use crate::parameters::Point;
use crate::physics::motion::MotionState;
use crate::physics::simulate::record::{Recorded, Recorder};
use crate::physics::simulate::timetable::Timetable;
use crate::results::outline::Outline;
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

impl Snapshot {
    /// Time steps taken so far.
    pub fn step(&self) -> u64 {
        self.course.step
    }

    /// Whether a trajectory of `point` has steps left from here.
    pub(super) fn is_before_the_end_of(&self, point: &Point) -> bool {
        self.course.step < Timetable::of(point).end
    }
}

/// Takes snapshots of a trajectory, which it cannot change.
pub trait Keeper {
    /// Whether a snapshot is wanted now; asked at every check.
    fn wants(&mut self) -> bool;
    /// Takes a snapshot.
    fn keep(&mut self, snapshot: Snapshot);
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

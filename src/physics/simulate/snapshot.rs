//! A trajectory on its way: everything that decides how it goes on, so that it goes on with the same bits.

use crate::physics::motion::guard::GuardState;
use crate::physics::motion::implicit::ImplicitState;
use crate::physics::point::SoftState;
use crate::physics::simulate::record::Recorder;
use crate::results::outline::Outline;
use serde::{Deserialize, Serialize};

/// The state of a droplet in motion, by its integrator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MotionState {
    /// Guarded Verlet steps of a ring.
    Verlet(GuardState),
    /// Implicit steps of a ring.
    Implicit(Box<ImplicitState>),
    /// A soft particle.
    Soft(SoftState),
}

/// How far the driving has come, at a check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    /// Time steps taken.
    pub step: u64,
    /// Checks made.
    pub checks: u64,
    /// Whether the droplet was ever seen to move.
    pub has_moved: bool,
    /// Whether it was at rest at this check: a clog must show twice in a row.
    pub was_below: bool,
    /// Lowest total energy so far.
    pub lowest_energy: f64,
    /// The outline at this check.
    pub outline: Outline,
    /// All that is recorded.
    pub recorder: Recorder,
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
}

/// Takes snapshots of a trajectory on its way; what it does with them cannot change the trajectory.
pub trait Keeper {
    /// Whether one is wanted now; asked at every check.
    fn wants(&mut self) -> bool;
    /// Takes one.
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

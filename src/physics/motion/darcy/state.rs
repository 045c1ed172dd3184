//! What decides how the motion goes on.

use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::Potential;
use crate::physics::motion::{darcy::RESPACING, implicit::StepCounts, reading::Reading};
use crate::physics::ring::ORIGIN_STEP;
use crate::physics::walls::wall::Walls;
use serde::{Deserialize, Serialize};

/// The last shapes of a droplet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Shapes {
    /// The latest shape and the two before it.
    pub(super) last: [Polygon; 3],
    /// Lengths of the last two steps.
    pub(super) steps: [f64; 2],
    pub(super) origin: [f64; 2],
}

/// How far the motion has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Course {
    /// Length of the next step.
    pub(super) next: f64,
    /// How many earlier shapes the next step builds on: 0, 1, or 2.
    pub(super) known: u32,
    /// Whether the next step may space the vertices.
    pub(super) spaces: bool,
    /// World position of a film that has closed. No step follows.
    pub(super) pinched: Option<[f64; 2]>,
    /// Nominal steps taken.
    pub(super) steps: u64,
    pub(super) counts: StepCounts,
}

/// Everything that decides how the motion of a liquid droplet goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DarcyState {
    pub(super) shapes: Shapes,
    pub(super) course: Course,
    pub(super) readings: [Reading; 2],
}

impl DarcyState {
    /// The steps so far.
    pub(in crate::physics) const fn counts(&self) -> StepCounts {
        self.course.counts
    }

    /// Whether it is the state of a ring of `n` vertices.
    pub(super) fn is_of(&self, n: usize) -> bool {
        self.shapes.last.iter().all(|shape| shape.x.len() == n && shape.y.len() == n)
    }
}

impl Shapes {
    /// A droplet that has always had this shape.
    pub(super) fn of(shape: Polygon, origin: [f64; 2]) -> Self {
        Self { last: [shape.clone(), shape.clone(), shape], steps: [0.0; 2], origin }
    }

    pub(super) const fn latest(&self) -> &Polygon {
        &self.last[0]
    }

    /// Notes a new shape after a step of length `h`.
    pub(super) fn push(&mut self, shape: &Polygon, h: f64) {
        self.last.rotate_right(1);
        self.last[0].clone_from(shape);
        self.steps = [h, self.steps[0]];
    }

    /// Moves the origin next to the droplet.
    pub(super) fn follow(&mut self) {
        let shift = self.last[0].at(0).map(|c| (c / ORIGIN_STEP).trunc() * ORIGIN_STEP);
        if shift == [0.0, 0.0] {
            return;
        }
        for shape in &mut self.last {
            shape.x.iter_mut().for_each(|x| *x -= shift[0]);
            shape.y.iter_mut().for_each(|y| *y -= shift[1]);
        }
        self.origin = [self.origin[0] + shift[0], self.origin[1] + shift[1]];
    }
}

impl Course {
    /// The share of unevenness that the next step takes away. It falls with the motion, so that a droplet comes to
    /// rest.
    pub(super) fn respacing(&self, now: &Polygon, before: &Polygon, perimeter: f64) -> f64 {
        if !self.spaces {
            return 0.0;
        }
        let edge = perimeter / now.len() as f64;
        (now.largest_distance(before) / (RESPACING * edge)).min(1.0)
    }

    /// The energy of the latest shape, relative to the present origin.
    pub(super) fn energy<W: Walls>(&self, potential: &Potential<W>, shapes: &Shapes, latest: Reading) -> f64 {
        latest.potential + potential.weight * shapes.origin[0]
    }
}

//! Steps of a soft particle whose length follows their error.
//!
//! A step ([`crate::physics::point::radau`]) is taken again, shorter, if its error is more than twice what is allowed:
//!
//! ```text
//! allowed = min(1e-6 sigma, 0.01 t0 x the speed)
//! ```
//!
//! The force has a kink where the point comes within reach of a wall. The error tells when a step has met one. A step
//! must not leap over a wall. So the point moves at most as far as the nearest wall that does not push yet, or 0.0125 sigma
//! where that wall is nearer.
//!
//! Steps depend on the trajectory only: the point is ahead of the present by part of a step, and what is asked of the
//! present is read off in between ([`crate::physics::motion::reading`]).

use crate::physics::motion::reading::{Reading, between, place_between};
use crate::physics::motion::step_length::{self, FIRST, SHORTEST};
use crate::physics::observation::Observation;
use crate::physics::point::radau::Phase;
use crate::physics::point::{SKIN, SoftEffects, SoftMotion, SoftState};
use crate::physics::simd::InstructionSet;
use crate::physics::walls::wall::Walls;
use crate::results::outline::Outline;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The error allowed in a step, in sigma.
const STEP_ERROR: f64 = 1e-6;

/// The error allowed in a step over the speed, in t0.
const OF_SPEED: f64 = 0.01;

/// A point that is slower counts as this fast, in sigma/t0.
const SLOWEST: f64 = 1e-12;

/// Newton's method ends with a correction below this share of the error allowed, or below rounding.
const PRECISION: f64 = 1e-3;
const FINEST: f64 = 1e-14;

/// The farthest and the least that a point may move in a step, in sigma. Between two nodes of the shorter one a wall can
/// push no deeper than 1e-5 sigma.
const WAYS: [f64; 2] = [0.5 * SKIN, 0.0125];

/// A soft particle whose steps follow their error.
#[derive(Clone, Debug)]
pub(crate) struct AdaptivePoint<W: Walls> {
    /// The point at the end of the last step, where its velocity is that of the same time.
    point: SoftMotion<W>,
    /// Time between two looks.
    dt: f64,
    course: Course,
}

/// How far the steps have come.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Course {
    /// How many times the point was looked at.
    looks: u64,
    /// Length of the next step.
    next: f64,
    /// Readings at the last two ends of steps.
    readings: [Reading; 2],
    refused: u64,
}

/// Everything that decides how such a point goes on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdaptivePointState {
    point: SoftState,
    course: Course,
}

/// No step could be taken at this time, in t0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stuck(pub(crate) f64);

impl<W: Walls> AdaptivePoint<W> {
    /// A point at rest at `position` in world coordinates.
    pub(crate) fn start(
        position: [f64; 2],
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        let mut point = SoftMotion::start(position, effects, dt, walls, instruction_set);
        point.halt();
        let reading = reading(&point, 0.0);
        Self { point, dt, course: Course { looks: 0, next: FIRST, readings: [reading; 2], refused: 0 } }
    }

    pub(crate) fn state(&self) -> AdaptivePointState {
        AdaptivePointState { point: self.point.state(), course: self.course }
    }

    /// Goes on from `state`.
    pub(crate) fn resume(
        state: AdaptivePointState,
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        Self { point: SoftMotion::resume(state.point, effects, dt, walls, instruction_set), dt, course: state.course }
    }

    pub(crate) fn refused(&self) -> u64 {
        self.course.refused
    }

    /// How many times the point was looked at.
    pub(crate) fn looks(&self) -> u64 {
        self.course.looks
    }

    fn now(&self) -> f64 {
        self.course.looks as f64 * self.dt
    }

    /// Goes on until the point is ahead of the next look.
    ///
    /// # Errors
    /// [`Stuck`], if no step can be taken.
    pub(crate) fn look(&mut self) -> Result<(), Stuck> {
        let until = (self.course.looks + 1) as f64 * self.dt;
        while self.course.readings[1].t < until {
            self.step()?;
        }
        self.course.looks += 1;
        Ok(())
    }

    /// Takes one step of whatever length can be taken.
    fn step(&mut self) -> Result<(), Stuck> {
        self.point.follow();
        self.point.list_within(2.0 * WAYS[0]);
        let from = self.point.phase();
        let speed = libm::hypot(from[1][0], from[1][1]);
        let farthest = self.point.gap().clamp(WAYS[1], WAYS[0]);
        let mut h = if speed * self.course.next > farthest { farthest / speed } else { self.course.next };
        loop {
            let precision = (PRECISION * STEP_ERROR.min(OF_SPEED * speed)).max(FINEST);
            let solved = self.point.step(h, precision);
            let taken = solved.map(|(end, error)| {
                let reached = libm::hypot(end[1][0], end[1][1]);
                let moved = libm::hypot(end[0][0] - from[0][0], end[0][1] - from[0][1]);
                let allowed = STEP_ERROR.min(OF_SPEED * speed.max(reached).max(SLOWEST));
                // A point that starts has no speed yet, and may go further than was foreseen.
                let too_far = if moved > 1.5 * farthest { f64::INFINITY } else { 0.0 };
                (end, moved, (error / allowed).max(too_far))
            });
            match taken {
                Some((end, moved, error)) if error <= 2.0 => {
                    self.accept(end, moved, h);
                    self.course.next = step_length::after(h, root(error));
                    return Ok(());
                }
                Some((_, _, error)) => h = step_length::instead(h, root(error)),
                None => h *= 0.4,
            }
            self.course.refused += 1;
            if h < SHORTEST {
                return Err(Stuck(self.course.readings[1].t));
            }
        }
    }

    fn accept(&mut self, end: Phase, moved: f64, h: f64) {
        self.point.go_to(end, moved);
        let last = self.course.readings[1];
        self.course.readings = [last, reading(&self.point, last.t + h)];
    }

    pub(crate) fn observe(&self) -> Observation {
        let [before, after] = &self.course.readings;
        Observation { shape: None, area_error: None, ..between(before, after, self.now()) }
    }

    pub(crate) fn outline(&self, t: f64) -> Outline {
        let [before, after] = &self.course.readings;
        self.point.outline_at(place_between(before, after, t), t)
    }

    /// The point at the end of the last step, ahead of the present by part of it.
    pub(crate) fn ahead(&mut self) -> &mut SoftMotion<W> {
        &mut self.point
    }
}

/// The error goes with the fourth power of the step.
fn root(error: f64) -> f64 {
    (1.0 / error.max(1e-30)).sqrt().sqrt()
}

/// The reading of a point at time `t`.
fn reading<W: Walls>(point: &SoftMotion<W>, t: f64) -> Reading {
    let [_, velocity] = point.phase();
    let seen = point.measure(velocity);
    let Observation { x, y, kinetic, potential, overlap, contacts, .. } = seen;
    Reading { t, place: [x, y], velocity, kinetic, potential, shape: 1.0, area_error: 0.0, overlap, contacts }
}

//! What is measured at the ends of steps, and between them.
//!
//! Steps that follow their error are as long as the motion allows. Checks and samples come at times of their own, so they
//! are read off between the ends of a step: the place by the cubic through places and velocities, energies and the rest in
//! between.

use crate::physics::observation::Observation;
use crate::physics::ring::effects::Measured;
use serde::{Deserialize, Serialize};

/// Everything that is recorded of a droplet, at the end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Reading {
    pub(super) t: f64,
    /// World coordinates of the centroid.
    pub(super) place: [f64; 2],
    pub(super) velocity: [f64; 2],
    pub(super) kinetic: f64,
    pub(super) potential: f64,
    pub(super) shape: f64,
    pub(super) area_error: f64,
    pub(super) overlap: f64,
    pub(super) contacts: u32,
}

impl Reading {
    /// The reading of a ring at time `t`.
    pub(super) fn of(ring: &Measured, t: f64) -> Self {
        let velocity = ring.velocity;
        let Observation { x, y, kinetic, potential, shape, area_error, overlap, contacts, .. } = ring.seen;
        let (shape, area_error) = (shape.unwrap_or(1.0), area_error.unwrap_or(0.0));
        Self { t, place: [x, y], velocity, kinetic, potential, shape, area_error, overlap, contacts }
    }

    /// Total energy.
    pub(super) fn energy(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Place at time `t` between two readings: Hermite's cubic through places and velocities.
pub(super) fn place_between(before: &Reading, after: &Reading, t: f64) -> [f64; 2] {
    let h = after.t - before.t;
    let s = share(before, after, t);
    let (from, to) = ((1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s), s * s * (3.0 - 2.0 * s));
    let (leave, arrive) = (h * s * (1.0 - s) * (1.0 - s), -h * s * s * (1.0 - s));
    [0, 1]
        .map(|k| from * before.place[k] + to * after.place[k] + leave * before.velocity[k] + arrive * after.velocity[k])
}

/// The share of the time between two readings that has passed at time `t`.
fn share(before: &Reading, after: &Reading, t: f64) -> f64 {
    let h = after.t - before.t;
    if h > 0.0 { ((t - before.t) / h).clamp(0.0, 1.0) } else { 1.0 }
}

/// The observation at time `t` between two readings.
pub(super) fn between(before: &Reading, after: &Reading, t: f64) -> Observation {
    let s = share(before, after, t);
    let [x, y] = place_between(before, after, t);
    let linear = |a: f64, b: f64| a + s * (b - a);
    Observation {
        x,
        y,
        velocity: linear(before.velocity[0], after.velocity[0]),
        kinetic: decaying(before.kinetic, after.kinetic, s),
        potential: linear(before.potential, after.potential),
        shape: Some(linear(before.shape, after.shape)),
        area_error: Some(linear(before.area_error, after.area_error)),
        overlap: before.overlap.max(after.overlap),
        contacts: if s < 1.0 { before.contacts } else { after.contacts },
    }
}

/// Between two positive values along an exponential, which is straight on a logarithmic plot.
fn decaying(a: f64, b: f64, s: f64) -> f64 {
    if a > 0.0 && b > 0.0 { a * libm::exp(s * libm::log(b / a)) } else { a + s * (b - a) }
}

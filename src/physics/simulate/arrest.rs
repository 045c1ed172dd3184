//! Whether a droplet whose time is over is arrested: at rest, or nearly so, above the threshold of a clog.
//!
//! After an arrest E_k falls for 500 to 1500 t0 until a droplet counts as clogged. A run that ends meanwhile would
//! count as one that flowed. So its droplet is taken on without inertia, to the equilibrium that lies ahead
//! ([`Motion::descend`]). It is arrested there if that equilibrium is stable, its centroid has at most [`FARTHEST`] to
//! go, and it has at most [`MOST_ENERGY`] to lose.

use crate::parameters::MASS;
use crate::physics::motion::{Interruption, Motion};
use crate::physics::observation::Observation;
use crate::physics::simulate::{judge::Judge, snapshot::Course};
use crate::results::trajectory::Arrest;
use std::sync::atomic::AtomicBool;

/// The longest way that the centroid has left, in sigma.
const FARTHEST: f64 = 0.01;

/// The largest energy that is left to lose, in M g sigma.
const MOST_ENERGY: f64 = 1e-3;

/// The arrest of a droplet that was `seen` at the end of its time, if it is one. The motion is spent afterwards.
///
/// # Errors
/// [`Interruption::Stopped`], once `stop` is set.
pub(super) fn arrest(
    motion: &mut dyn Motion,
    judge: &Judge,
    course: &Course,
    seen: &Observation,
    stop: &AtomicBool,
) -> Result<Option<Arrest>, Interruption> {
    let Some(rest) = motion.descend(FARTHEST, stop)? else { return Ok(None) };
    let (to_x, to_y) = (rest.x - seen.x, rest.y - seen.y);
    let r = course.recorder.displacement(seen) + to_x;
    let way_left = libm::hypot(to_x, to_y);
    let energy_left = (seen.energy() - rest.energy) / MASS;
    let is_near = way_left <= FARTHEST && energy_left <= MOST_ENERGY;
    let arrest = Arrest { r, x: rest.x, y: rest.y, way_left, energy_left };
    Ok((is_near && judge.would_stay(course, r, rest.x)).then_some(arrest))
}

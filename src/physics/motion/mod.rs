//! How time advances, and how a droplet is put in place.
//!
//! This folder knows droplets and walls; it does not know how long a run is, or what is recorded of it. Read [`Motion`]
//! first: whoever drives a droplet sees it only through that trait. Its implementations are:
//!
//! | file | droplet and scheme |
//! |---|---|
//! | [`guard`] | a ring in steps of velocity-Verlet ([`verlet`]), taken back where the energy rises |
//! | [`implicit`] | a ring in implicit steps |
//! | `soft` | a soft particle, which brings its own scheme along |
//!
//! `placing` puts droplets where they start, by the same integrators.

pub mod guard;
pub mod implicit;
pub(crate) mod placing;
mod ring_state;
mod soft;
mod step_control;
pub mod verlet;

use crate::physics::observation::Observation;
use crate::physics::point::SoftState;
use crate::physics::ring::Ring;
use crate::results::outline::Outline;
use crate::results::trajectory::Failure;
use guard::GuardState;
use implicit::ImplicitState;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// A droplet in motion, whatever its model and integrator.
///
/// # Writing your own
/// A droplet without an outline leaves `engulfed` and `ring` as they are; one whose steps are never refused leaves
/// `refused`.
pub trait Motion {
    /// Takes `steps` nominal time steps. How a run is cut into calls must not change any bit of it.
    ///
    /// # Errors
    /// [`Interruption`]: it did not arrive.
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption>;

    /// What decides how it goes on.
    fn state(&self) -> MotionState;

    /// Moves the local origin next to the droplet. Call it at instants that do not depend on how a run is cut up.
    fn follow(&mut self);

    /// Reads off everything that is recorded.
    fn observe(&mut self) -> Observation;

    /// The outline at time `t`, and the loads on it.
    fn outline(&self, t: f64) -> Outline;

    /// World position of an obstacle inside the droplet, if there is one.
    fn engulfed(&self) -> Option<[f64; 2]> {
        None
    }

    /// The ring, if the droplet has one.
    fn ring(&self) -> Option<&Ring> {
        None
    }

    /// Stretches or sub-steps of time refused so far.
    fn refused(&self) -> u64 {
        0
    }
}

/// Why a droplet did not arrive where it was to go.
#[derive(Debug)]
pub enum Interruption {
    /// It was told to stop, and is somewhere on the way.
    Stopped,
    /// A step could not be taken; the droplet is where that step began.
    Failed(Failure),
}

impl From<Failure> for Interruption {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// The state of a droplet in motion, by its model and integrator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum MotionState {
    /// Guarded Verlet steps of a ring.
    Verlet(GuardState),
    /// Implicit steps of a ring.
    Implicit(Box<ImplicitState>),
    /// A soft particle.
    Soft(SoftState),
}

/// Takes `steps` in pieces of at most `piece`, and looks at `stop` before each.
fn in_pieces(steps: u64, piece: u64, stop: &AtomicBool, mut advance: impl FnMut(u64)) -> Result<(), Interruption> {
    let mut left = steps;
    while left > 0 {
        if stop.load(Ordering::Relaxed) {
            return Err(Interruption::Stopped);
        }
        advance(left.min(piece));
        left -= left.min(piece);
    }
    Ok(())
}

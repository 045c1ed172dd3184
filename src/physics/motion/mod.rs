//! How time advances, and how a droplet is put at its start.
//!
//! This folder knows droplets and walls. How long a trajectory is and what is recorded of it is decided elsewhere. Read
//! [`Motion`] first: droplets are driven through that trait only. Its implementations are:
//!
//! | file | droplet and scheme |
//! |---|---|
//! | [`guard`] | a ring in steps of velocity-Verlet ([`verlet`]), which are taken again if the energy rises |
//! | [`implicit`] | a ring in implicit steps, of fixed length or as long as their error allows |
//! | [`darcy`] | a liquid droplet in implicit steps whose length follows their error |
//! | `soft` | a soft particle; its Verlet steps stand in [`crate::physics::point`] |
//!
//! `placing` puts droplets at their start, with the same integrators. [`descent`] finds where a droplet would come to rest.

pub mod darcy;
pub mod descent;
pub mod guard;
pub mod implicit;
pub(crate) mod placing;
mod reading;
mod ring_state;
pub(in crate::physics) mod soft;
mod step_control;
mod step_length;
pub mod verlet;

use crate::physics::observation::Observation;
use crate::physics::point::SoftState;
use crate::physics::ring::Ring;
use crate::results::outline::Outline;
use crate::results::trajectory::Failure;
use darcy::DarcyState;
use descent::Equilibrium;
use guard::GuardState;
use implicit::{AdaptiveState, ImplicitState, StepCounts};
use serde::{Deserialize, Serialize};
use soft::adaptive::AdaptivePointState;
use std::sync::atomic::{AtomicBool, Ordering};

/// A droplet in motion, whatever its model and integrator.
///
/// # Writing your own
/// The default methods suit a droplet that is no ring and whose steps are never refused.
pub trait Motion {
    /// Takes `steps` nominal time steps. No bit of the result may depend on how the steps are divided into calls.
    ///
    /// # Errors
    /// [`Interruption`], if not all steps were taken.
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption>;

    /// Everything that decides how the motion goes on.
    fn state(&self) -> MotionState;

    /// Moves the local origin next to the droplet. Call it only at times that are fixed by the job.
    fn follow(&mut self);

    /// Measures everything that is recorded.
    fn observe(&mut self) -> Observation;

    /// The outline and the loads on it; `t` is the present time.
    fn outline(&self, t: f64) -> Outline;

    /// Whether a step was taken in the last [`advance`](Self::advance). If none was, no obstacle can have come to lie
    /// inside the droplet since then, and its outline cannot have come to cross itself.
    fn is_fresh(&self) -> bool {
        true
    }

    /// World position of an obstacle inside the droplet, if there is one.
    fn engulfed(&self) -> Option<[f64; 2]> {
        None
    }

    /// World position of a film of liquid that has closed, if one has. The droplet breaks there and moves no further.
    fn pinched(&self) -> Option<[f64; 2]> {
        None
    }

    /// The ring, if the droplet has one.
    fn ring(&self) -> Option<&Ring> {
        None
    }

    /// How many stretches of Verlet steps, or implicit sub-steps, were refused so far.
    fn refused(&self) -> u64 {
        0
    }

    /// Goes without inertia to the equilibrium that lies ahead, and tells it; the time does not count, and no step
    /// follows. `None` if no equilibrium is known within `farthest` of the present centroid.
    ///
    /// # Errors
    /// [`Interruption::Stopped`], once `stop` is set.
    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        let _ = (farthest, stop);
        Ok(None)
    }
}

/// Why not all steps were taken.
#[derive(Debug)]
pub enum Interruption {
    /// The motion was told to stop, at any step.
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
    /// A liquid droplet.
    Darcy(Box<DarcyState>),
    /// A soft particle.
    Soft(SoftState),
    /// Implicit steps of a ring that follow their error.
    Adaptive(Box<AdaptiveState>),
    /// Steps of a soft particle that follow their error.
    AdaptiveSoft(Box<AdaptivePointState>),
}

impl MotionState {
    /// The implicit steps taken so far; `None` for explicit schemes.
    pub(in crate::physics) fn counts(&self) -> Option<StepCounts> {
        match self {
            Self::Implicit(state) => Some(state.counts()),
            Self::Adaptive(state) => Some(state.counts()),
            Self::Darcy(state) => Some(state.counts()),
            Self::Verlet(_) | Self::Soft(_) | Self::AdaptiveSoft(_) => None,
        }
    }
}

/// Takes `steps` in pieces of at most `piece`, and checks `stop` before each piece.
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

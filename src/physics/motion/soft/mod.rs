//! The soft particle as a [`Motion`]; its Verlet steps stand with its forces in [`crate::physics::point`].

pub(in crate::physics) mod adaptive;

use crate::physics::motion::descent::{Equilibrium, Sinking, descend};
use crate::physics::motion::{Interruption, Motion, MotionState, in_pieces};
use crate::physics::observation::Observation;
use crate::physics::point::SoftMotion;
use crate::physics::walls::wall::Walls;
use crate::results::outline::Outline;
use crate::results::trajectory::{Failure, FailureClass};
use adaptive::{AdaptivePoint, Stuck};
use std::sync::atomic::{AtomicBool, Ordering};

/// Steps between two checks of `stop`: about 10 ms.
const PIECE: u64 = 1 << 20;

impl<W: Walls> Motion for SoftMotion<W> {
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        in_pieces(steps, PIECE, stop, |steps| SoftMotion::advance(self, steps))
    }

    fn state(&self) -> MotionState {
        MotionState::Soft(SoftMotion::state(self))
    }

    fn follow(&mut self) {
        SoftMotion::follow(self);
    }

    fn observe(&mut self) -> Observation {
        SoftMotion::observe(self)
    }

    fn outline(&self, t: f64) -> Outline {
        SoftMotion::outline(self, t)
    }

    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        descend(self, farthest, stop)
    }
}

impl<W: Walls> Sinking for SoftMotion<W> {
    fn sink(&mut self, h: f64) -> Option<f64> {
        SoftMotion::sink(self, h)
    }

    fn here(&self) -> Equilibrium {
        let ([x, y], energy) = self.place_and_energy();
        Equilibrium { x, y, energy }
    }
}

impl<W: Walls> Motion for AdaptivePoint<W> {
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        for _ in 0..steps {
            if stop.load(Ordering::Relaxed) {
                return Err(Interruption::Stopped);
            }
            self.look().map_err(|Stuck(t)| Failure {
                class: FailureClass::Unstable,
                reason: format!("at t = {t:.3} no step can be taken; write integrator = \"verlet\", or lower e_w"),
                step: self.looks(),
                outline: None,
            })?;
        }
        Ok(())
    }

    fn state(&self) -> MotionState {
        MotionState::AdaptiveSoft(Box::new(AdaptivePoint::state(self)))
    }

    /// The point moves its origin by itself, because its steps do not depend on when it is looked at.
    fn follow(&mut self) {}

    fn observe(&mut self) -> Observation {
        AdaptivePoint::observe(self)
    }

    fn outline(&self, t: f64) -> Outline {
        AdaptivePoint::outline(self, t)
    }

    fn refused(&self) -> u64 {
        AdaptivePoint::refused(self)
    }

    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        descend(self.ahead(), farthest, stop)
    }
}

//! Guards Verlet steps: a stretch of time in which the total energy rises is taken again in smaller steps.
//!
//! The stability limit of a job ([`crate::physics::simulate::stability`]) assumes a certain number of neighbours. Where
//! vertices crowd, more of them may press on one another. Drag makes the energy fall, so a rise shows an instability.
//! After `PATIENCE` quiet stretches the step doubles again.
//!
//! Without a refusal the guard changes no bit. With refusals, too, the trajectory depends on its job only, because the
//! stretches are fixed by the job.

use crate::physics::motion::descent::{Equilibrium, descend};
use crate::physics::motion::implicit::SinkingRing;
use crate::physics::motion::step_control::{StepControl, WHOLE};
use crate::physics::motion::{Interruption, Motion, MotionState, ring_state::RingState, verlet::VerletMotion};
use crate::physics::observation::Observation;
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::InstructionSet;
use crate::results::outline::Outline;
use crate::results::trajectory::{Failure, FailureClass};
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;

/// A larger rise of the total energy within a stretch shows an instability, in g rho sigma^3: 0.6% of the work that
/// gravity does on a droplet over one diameter.
const RISE: f64 = 0.005;

/// The smallest step is `dt/32`.
const MOST_HALVINGS: u32 = 5;

const PATIENCE: u32 = 8;

/// A ring advanced by Verlet steps that are taken again if the energy rises.
#[derive(Debug)]
pub struct GuardedMotion {
    /// The ring and its effects.
    pub motion: VerletMotion,
    dt: f64,
    steps: u64,
    energy: f64,
    control: StepControl,
    refused: u64,
    saved: Ring,
    /// The observation at the end of the last stretch.
    seen: Option<Observation>,
}

/// Everything that decides how a guarded motion goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuardState {
    ring: RingState,
    memory: Vec<Vec<f64>>,
    dt: f64,
    steps: u64,
    energy: f64,
    control: StepControl,
    refused: u64,
}

impl GuardedMotion {
    /// Guards a motion from its present state on.
    pub fn new(mut motion: VerletMotion) -> Self {
        let (dt, energy, saved) = (motion.dt, motion.observe().energy(), motion.ring.clone());
        let control = StepControl::new(MOST_HALVINGS, PATIENCE);
        Self { motion, dt, steps: 0, energy, control, refused: 0, saved, seen: None }
    }

    /// Goes on from `state`. `None` if the state does not belong to `n` vertices and nominal steps of `dt`.
    pub(crate) fn resume(
        state: &GuardState,
        n: usize,
        effects: RingEffects,
        dt: f64,
        instruction_set: InstructionSet,
    ) -> Option<Self> {
        let mut control = StepControl::new(MOST_HALVINGS, PATIENCE);
        if !control.resume(state.control) || control.length(dt) != state.dt {
            return None;
        }
        let mut motion = VerletMotion::resume(state.ring.ring(n)?, effects, state.dt, instruction_set);
        if !motion.effects.recall(&state.memory) {
            return None;
        }
        let saved = motion.ring.clone();
        let GuardState { steps, energy, refused, .. } = *state;
        Some(Self { motion, dt, steps, energy, control, refused, saved, seen: None })
    }

    fn take_length(&mut self) {
        let dt = self.control.length(self.dt);
        if dt != self.motion.dt {
            self.motion.change_step(dt);
        }
    }

    /// The failure of a stretch of `steps` nominal steps in which the energy rises even in the shortest steps.
    fn unstable(&self, rise: f64, steps: u64, shortest: f64) -> Failure {
        let (stretch, t) = (steps as f64 * self.dt, self.steps as f64 * self.dt);
        let reason = format!(
            "the total energy rose by {rise:.3e} within {stretch} t0 from t = {t} on, even in steps of {shortest:.3e}; \
             see it with `meniscus render`"
        );
        Failure { class: FailureClass::Unstable, reason, step: self.steps, outline: None }
    }
}

impl Motion for GuardedMotion {
    /// Takes a stretch of `steps` nominal time steps. If the energy rises even in the smallest steps, the motion fails
    /// as `unstable`, with the ring where the stretch began.
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        self.saved.clone_from(&self.motion.ring);
        self.seen = None;
        let saved_dt = self.motion.dt;
        loop {
            self.motion.advance(steps * u64::from(self.control.parts()), stop)?;
            let seen = self.motion.observe();
            let energy = seen.energy();
            let rise = energy - self.energy;
            if rise < RISE {
                self.energy = energy;
                self.seen = Some(seen);
                self.steps += steps;
                self.control.accepted(WHOLE);
                self.take_length();
                return Ok(());
            }
            self.refused += 1;
            let shortest = self.motion.dt;
            self.motion.put_back(&self.saved, saved_dt);
            if !self.control.refused() {
                return Err(self.unstable(rise, steps, shortest).into());
            }
            self.take_length();
        }
    }

    fn state(&self) -> MotionState {
        MotionState::Verlet(GuardState {
            ring: RingState::of(&self.motion.ring),
            memory: self.motion.effects.memory(),
            dt: self.motion.dt,
            steps: self.steps,
            energy: self.energy,
            control: self.control,
            refused: self.refused,
        })
    }

    fn follow(&mut self) {
        self.motion.follow();
    }

    fn observe(&mut self) -> Observation {
        self.seen.unwrap_or_else(|| self.motion.observe())
    }

    fn outline(&self, t: f64) -> Outline {
        self.motion.effects.outline(&self.motion.ring, t)
    }

    fn engulfed(&self) -> Option<[f64; 2]> {
        self.motion.effects.engulfed(&self.motion.ring)
    }

    fn ring(&self) -> Option<&Ring> {
        Some(&self.motion.ring)
    }

    fn refused(&self) -> u64 {
        self.refused
    }

    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        self.seen = None;
        let VerletMotion { ring, effects, instruction_set, .. } = &mut self.motion;
        descend(&mut SinkingRing::new(ring, effects, *instruction_set), farthest, stop)
    }
}

//! Watches over an explicit integrator: a stretch of time in which the total energy rose is taken again in smaller
//! steps.
//!
//! The stability limit of a job ([`crate::physics::simulate::stability`]) adds up its effects one by one. Where vertices
//! crowd, more of them may press on one another than it counts. Drag and integrator let the energy fall, and an
//! instability shows as a rise. After `PATIENCE` quiet stretches the step doubles again.
//!
//! A run that is never refused has the same bits as without the guard. A run with refusals, too, depends on nothing but its
//! job, because the stretches do not.

use crate::physics::motion::ring_state::RingState;
use crate::physics::motion::step_control::{StepControl, WHOLE};
use crate::physics::motion::verlet::VerletMotion;
use crate::physics::motion::{Interruption, Motion, MotionState};
use crate::physics::observation::Observation;
use crate::physics::ring::Ring;
use crate::physics::ring::effects::RingEffects;
use crate::physics::simd::InstructionSet;
use crate::results::outline::Outline;
use crate::results::trajectory::{Failure, FailureClass};
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;

/// Rise of the total energy within a stretch that only an instability can cause, in g rho sigma^3: 0.6% of the work
/// that gravity does on a droplet over one diameter.
const RISE: f64 = 0.005;

/// Most halvings: the smallest step is `dt/32`.
const MOST_HALVINGS: u32 = 5;

/// Quiet stretches in a row after which the step doubles.
const PATIENCE: u32 = 8;

/// A ring advanced by Verlet steps, with a way back.
#[derive(Debug)]
pub struct GuardedMotion {
    /// The ring and its effects.
    pub motion: VerletMotion,
    /// Nominal time step.
    dt: f64,
    /// Nominal steps taken.
    steps: u64,
    /// Total energy now.
    energy: f64,
    control: StepControl,
    /// Stretches refused so far.
    refused: u64,
    /// The ring at the beginning of the stretch.
    saved: Ring,
    /// What was seen at the end of the last one.
    seen: Option<Observation>,
}

/// What decides how a guarded motion goes on.
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
    /// Guards a motion from here on.
    pub fn new(mut motion: VerletMotion) -> Self {
        let (dt, energy, saved) = (motion.dt, motion.observe().energy(), motion.ring.clone());
        let control = StepControl::new(MOST_HALVINGS, PATIENCE);
        Self { motion, dt, steps: 0, energy, control, refused: 0, saved, seen: None }
    }

    /// Goes on from `state`, with `n` vertices and nominal steps of `dt`; `None` if it is no state of such a motion.
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

    /// Goes on in steps of the length that the control now asks for.
    fn take_length(&mut self) {
        let dt = self.control.length(self.dt);
        if dt != self.motion.dt {
            self.motion.change_step(dt);
        }
    }

    /// The failure of a stretch of `steps` in which the energy rises even in the shortest steps.
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
    /// Takes a stretch of `steps` nominal time steps. If the energy rises even in the smallest steps, it fails as
    /// `unstable`; the ring is then where the stretch began.
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
}

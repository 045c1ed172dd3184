//! Watches over an explicit integrator: a stretch of time in which the total energy rose is taken again in smaller steps.
//!
//! The stability limit of a job ([`crate::physics::simulate::stability`]) is that of its effects one by one; where vertices crowd, more of them may
//! press on one another than it counts. Drag and integrator let the energy fall, and an instability shows as a rise. After
//! [`PATIENCE`] quiet stretches the step doubles again. A run that is never refused has the same bits as without the guard,
//! and one that is depends on nothing but its job, as long as the stretches do.

use crate::physics::motion::memory::{RingState, WrongState};
use crate::physics::motion::step_control::{StepControl, WHOLE};
use crate::physics::motion::verlet::{RingEffects, RingMotion};
use crate::physics::observation::Observation;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::{Drag, EdgeForce};
use crate::physics::simd::InstructionSet;
use crate::results::trajectory::{Failure, FailureClass};
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;

/// Rise of the total energy within a stretch that only an instability can cause, in g rho sigma^3: 0.6% of the work that
/// gravity does on a droplet over one diameter.
const RISE: f64 = 0.005;

/// Most halvings: the smallest step is `dt/32`.
const MOST_HALVINGS: u32 = 5;

/// Quiet stretches in a row after which the step doubles.
const PATIENCE: u32 = 8;

/// A ring advanced by Verlet steps, with a way back.
#[derive(Debug)]
pub struct GuardedMotion<E, D> {
    /// The ring and its effects.
    pub motion: RingMotion<E, D>,
    /// Nominal time step.
    dt: f64,
    /// Nominal steps taken.
    steps: u64,
    /// Total energy now.
    energy: f64,
    control: StepControl,
    /// Stretches refused so far.
    pub refused: u64,
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

impl<E: EdgeForce, D: Drag> GuardedMotion<E, D> {
    /// Guards a motion from here on.
    pub fn new(mut motion: RingMotion<E, D>) -> Self {
        let (dt, energy, saved) = (motion.dt, motion.total_energy(), motion.ring.clone());
        let control = StepControl::new(MOST_HALVINGS, PATIENCE);
        Self { motion, dt, steps: 0, energy, control, refused: 0, saved, seen: None }
    }

    /// Its state between two stretches.
    pub fn state(&self) -> GuardState {
        GuardState {
            ring: RingState::of(&self.motion.ring),
            memory: self.motion.effects.memory(),
            dt: self.motion.dt,
            steps: self.steps,
            energy: self.energy,
            control: self.control,
            refused: self.refused,
        }
    }

    /// Goes on from `state`, with `n` vertices and nominal steps of `dt`.
    ///
    /// # Errors
    /// [`WrongState`] if it is not one of such a motion.
    pub fn resume(
        state: &GuardState,
        n: usize,
        effects: RingEffects<E, D>,
        dt: f64,
        instruction_set: InstructionSet,
    ) -> Result<Self, WrongState> {
        let mut control = StepControl::new(MOST_HALVINGS, PATIENCE);
        if !control.resume(state.control) || control.length(dt) != state.dt {
            return Err(WrongState);
        }
        let mut motion = RingMotion::resume(state.ring.ring(n)?, effects, state.dt, instruction_set);
        motion.effects.recall(&state.memory)?;
        let saved = motion.ring.clone();
        let GuardState { steps, energy, refused, .. } = *state;
        Ok(Self { motion, dt, steps, energy, control, refused, saved, seen: None })
    }

    /// Takes a stretch of `steps` nominal time steps.
    ///
    /// # Errors
    /// Class `unstable` if the energy rises even in the smallest steps; the ring is then where the stretch began.
    pub fn advance(&mut self, steps: u64) -> Result<(), Failure> {
        self.advance_unless(&AtomicBool::new(false), steps).map(drop)
    }

    /// The same; false, and somewhere on the way, once `stop` is set.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    pub fn advance_unless(&mut self, stop: &AtomicBool, steps: u64) -> Result<bool, Failure> {
        self.saved.clone_from(&self.motion.ring);
        self.seen = None;
        let saved_dt = self.motion.dt;
        loop {
            if !self.motion.advance_unless(stop, steps * u64::from(self.control.parts())) {
                return Ok(false);
            }
            let seen = self.motion.observe();
            let energy = seen.energy();
            let rise = energy - self.energy;
            if rise < RISE {
                self.energy = energy;
                self.seen = Some(seen);
                self.steps += steps;
                self.control.accepted(WHOLE);
                self.take_length();
                return Ok(true);
            }
            self.refused += 1;
            let shortest = self.motion.dt;
            self.motion.put_back(&self.saved, saved_dt);
            if !self.control.refused() {
                let reason = format!(
                    "the total energy rose by {rise:.3e} within {} t0 from t = {} on, even in steps of {:.3e}; see it with `meniscus render`",
                    steps as f64 * self.dt,
                    self.steps as f64 * self.dt,
                    shortest
                );
                return Err(Failure { class: FailureClass::Unstable, reason, step: self.steps, outline: None });
            }
            self.take_length();
        }
    }

    /// Everything that is recorded, at the end of a stretch.
    pub fn observe(&mut self) -> Observation {
        self.seen.unwrap_or_else(|| self.motion.observe())
    }

    /// Goes on in steps of the length that the control now asks for.
    fn take_length(&mut self) {
        let dt = self.control.length(self.dt);
        if dt != self.motion.dt {
            self.motion.change_step(dt);
        }
    }
}

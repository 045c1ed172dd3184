//! Implicit integrator, for rings that are stiff: literal wall stiffness, `kappa -> 0`, stiff area, large tension.
//!
//! The scheme is that of backward differences of second order (BDF2): A- and L-stable, with one nonlinear solve a step.
//! For a step h after one of length `h/r`, with `D` the change over that earlier step and `s = h (1 + r)/(1 + 2r)`,
//!
//! ```text
//! x+ - x = r^2/(1 + 2r) Dx + s v+
//! v+ - v = r^2/(1 + 2r) Dv + s [F(x+)/m - lambda v+]
//! ```
//!
//! (Hairer, Norsett, Wanner, "Solving ODEs I", III.5; stable for r < 2.41, here r <= 2). The first step, and any retry
//! after Newton's method has failed, drop the terms in D and take `s = h`, which is backward Euler. With v+ eliminated
//! the step minimises the incremental potential of `potential` with
//!
//! ```text
//! w = (m/s^2)(1 + s lambda),     d* = r^2/(1 + 2r) Dx + s [v + r^2/(1 + 2r) Dv]/(1 + s lambda)
//! ```
//!
//! The damping rates lambda are those at positions extrapolated from the step before, which is correct to second order.
//! Velocities are computed from displacements, not from differences of positions, so they are accurate to about 1e-13.
//!
//! A step that Newton's method cannot solve, or that moves a vertex further than `largest_move`, is taken again in
//! halves (`step_control`). Steps whose length follows their error are those of [`AdaptiveMotion`].

mod adaptive;
mod cyclic;
mod field;
mod newton;
mod potential;
mod scheme;
mod sinking;

use crate::on_instruction_set;
use crate::physics::motion::descent::{Equilibrium, descend};
use crate::physics::motion::step_control::{StepControl, WHOLE};
use crate::physics::motion::{Interruption, Motion, MotionState, ring_state::RingState};
use crate::physics::observation::Observation;
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::InstructionSet;
use crate::results::outline::Outline;
use crate::results::trajectory::{Failure, FailureClass};
pub(crate) use adaptive::AdaptiveMotion;
pub use adaptive::AdaptiveState;
use field::Field;
use newton::{Newton, Unsolved};
use scheme::{Earlier, Scheme};
use serde::{Deserialize, Serialize};
pub(super) use sinking::SinkingRing;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest distance that a vertex may move in one step, in sigma: half of the default vertex diameter, `pi/512`.
pub(crate) const LARGEST_MOVE: f64 = std::f64::consts::PI / 512.0;

/// The smallest sub-step is `dt/65536`.
const MOST_HALVINGS: u32 = 16;

/// After this many accepted sub-steps in a row their length doubles.
const PATIENCE: u32 = 4;

#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
enum BadStep {
    #[error(transparent)]
    Newton(#[from] Unsolved),
    #[error("a vertex would move by {0:.3e} sigma at once")]
    TooFar(f64),
}

/// How many steps a motion has taken so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct StepCounts {
    /// Sub-steps accepted; their number is that of the nominal steps if none was refused.
    pub accepted: u64,
    /// Sub-steps refused.
    pub refused: u64,
    /// Newton steps of the accepted sub-steps.
    pub iterations: u64,
}

/// A ring with its effects, advanced implicitly.
#[derive(Debug)]
pub struct ImplicitMotion {
    /// The ring; here `ux`, `uy` are velocities at the same time as the positions.
    pub ring: Ring,
    /// All that acts on the ring.
    pub effects: RingEffects,
    /// Largest distance that a vertex may move in one sub-step.
    pub largest_move: f64,
    /// The steps it has taken.
    pub counts: StepCounts,
    dt: f64,
    instruction_set: InstructionSet,
    newton: Newton,
    control: StepControl,
    earlier: Earlier,
    steps: u64,
}

/// Everything that decides how an implicit motion goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImplicitState {
    ring: RingState,
    memory: Vec<Vec<f64>>,
    counts: StepCounts,
    control: StepControl,
    moved: Field,
    gained: Field,
    earlier_step: f64,
    steps: u64,
}

impl ImplicitState {
    /// The steps so far.
    pub(in crate::physics) const fn counts(&self) -> StepCounts {
        self.counts
    }
}

impl ImplicitMotion {
    /// A ring at rest.
    pub fn start(ring: Ring, effects: RingEffects, dt: f64, instruction_set: InstructionSet) -> Self {
        let n = ring.n;
        let mut motion = Self {
            ring,
            effects,
            largest_move: LARGEST_MOVE,
            counts: StepCounts::default(),
            dt,
            instruction_set,
            newton: Newton::new(n, instruction_set),
            control: StepControl::new(MOST_HALVINGS, PATIENCE),
            earlier: Earlier::none(n),
            steps: 0,
        };
        motion.ring.ux.fill(0.0);
        motion.ring.uy.fill(0.0);
        motion.moved(f64::INFINITY);
        motion
    }

    /// Tells the effects that no vertex moved further than `distance`.
    fn moved(&mut self, distance: f64) {
        self.effects.moved(distance, &self.ring);
        self.effects.drag.update(distance + self.newton.travelled, &self.ring);
        self.newton.travelled = 0.0;
    }

    /// Goes on from `state`, in nominal steps of `dt`. `None` if the state does not belong to a ring of `n` vertices.
    pub(crate) fn resume(
        state: &ImplicitState,
        n: usize,
        effects: RingEffects,
        dt: f64,
        instruction_set: InstructionSet,
    ) -> Option<Self> {
        let mut motion = Self::start(state.ring.ring(n)?, effects, dt, instruction_set);
        let fits = |field: &Field| field.x.len() == motion.earlier.moved.x.len() && field.y.len() == field.x.len();
        if !fits(&state.moved) || !fits(&state.gained) || !motion.control.resume(state.control) {
            return None;
        }
        // `start` has set the velocities to zero.
        motion.ring = state.ring.ring(n)?;
        if !motion.effects.recall(&state.memory) {
            return None;
        }
        motion.earlier = Earlier { moved: state.moved.clone(), gained: state.gained.clone(), step: state.earlier_step };
        (motion.counts, motion.steps) = (state.counts, state.steps);
        Some(motion)
    }

    fn saved(&self) -> ImplicitState {
        ImplicitState {
            ring: RingState::of(&self.ring),
            memory: self.effects.memory(),
            counts: self.counts,
            control: self.control,
            moved: self.earlier.moved.clone(),
            gained: self.earlier.gained.clone(),
            earlier_step: self.earlier.step,
            steps: self.steps,
        }
    }

    /// Puts the ring back where the refused sub-step began, and halves the sub-steps.
    fn retreat(&mut self, bad: BadStep) -> Result<(), Failure> {
        self.go_back();
        if matches!(bad, BadStep::Newton(_)) {
            self.earlier.step = f64::INFINITY;
        }
        if self.control.refused() {
            return Ok(());
        }
        let length = self.control.length(self.dt);
        let reason = format!("the implicit step fails even at dt = {length:.1e}: {bad}; lower dt or the stiffnesses");
        Err(Failure { class: FailureClass::Unstable, reason, step: self.steps, outline: None })
    }

    fn try_step(&mut self, h: f64) -> Result<(), BadStep> {
        let scheme = self.foresee(h);
        let iterations = self.solve(scheme)?;
        self.accept(scheme, iterations);
        Ok(())
    }

    /// Begins a step of length `h`: sets the displacement to what is foreseen.
    fn foresee(&mut self, h: f64) -> Scheme {
        let (ring, newton, earlier) = (&mut self.ring, &mut self.newton, &self.earlier);
        let long = ring.ux.len();
        newton.start.x.copy_from_slice(&ring.x[..long]);
        newton.start.y.copy_from_slice(&ring.y[..long]);
        let scheme = Scheme::of(h, h / earlier.step);
        on_instruction_set!(self.instruction_set, simd => scheme.foresee(simd, ring, earlier, &mut newton.displacement));
        scheme
    }

    /// Solves the step from what is foreseen; returns the number of Newton steps.
    fn solve(&mut self, scheme: Scheme) -> Result<u32, BadStep> {
        let (ring, newton, earlier) = (&mut self.ring, &mut self.newton, &self.earlier);
        let instruction_set = self.instruction_set;
        let far = newton.displacement.largest(instruction_set);
        newton.put(ring, &mut self.effects, far);
        self.effects.drag.update(newton.travelled, ring);
        newton.travelled = 0.0;
        let rates = self.effects.drag.rates();
        on_instruction_set!(instruction_set, simd => scheme.aim(simd, ring, rates, earlier, &mut newton.potential));
        let iterations = newton.minimise(ring, &mut self.effects)?;
        let far = newton.displacement.largest(instruction_set);
        if far <= self.largest_move { Ok(iterations) } else { Err(BadStep::TooFar(far)) }
    }

    /// Takes the step that was solved.
    fn accept(&mut self, scheme: Scheme, iterations: u32) {
        let (ring, newton, earlier) = (&mut self.ring, &self.newton, &mut self.earlier);
        on_instruction_set!(self.instruction_set, simd => scheme.accept(simd, ring, &newton.displacement, earlier));
        self.effects.settled(ring);
        earlier.step = scheme.length();
        self.counts.accepted += 1;
        self.counts.iterations += u64::from(iterations);
    }

    /// Puts the ring back where the step that is not taken began.
    fn go_back(&mut self) {
        self.counts.refused += 1;
        let back = self.newton.displacement.largest(self.instruction_set);
        self.newton.displacement = Field::zero(self.ring.n);
        let back = if back.is_finite() { back } else { f64::INFINITY };
        self.newton.put(&mut self.ring, &mut self.effects, back);
    }
}

impl Motion for ImplicitMotion {
    /// Takes `steps` nominal time steps. If a step cannot be solved even at 1/65536 of its length, the motion fails as
    /// `unstable`.
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        for _ in 0..steps {
            let mut at = 0;
            while at < WHOLE {
                if stop.load(Ordering::Relaxed) {
                    return Err(Interruption::Stopped);
                }
                match self.try_step(self.control.length(self.dt)) {
                    Ok(()) => {
                        at += self.control.ticks();
                        self.control.accepted(at);
                    }
                    Err(bad) => self.retreat(bad)?,
                }
            }
            self.steps += 1;
        }
        Ok(())
    }

    fn state(&self) -> MotionState {
        MotionState::Implicit(Box::new(self.saved()))
    }

    fn follow(&mut self) {
        self.ring.follow();
        self.moved(0.0);
    }

    fn observe(&mut self) -> Observation {
        self.effects.observe(&self.ring, &self.ring.ux, &self.ring.uy)
    }

    fn outline(&self, t: f64) -> Outline {
        self.effects.outline(&self.ring, t)
    }

    fn engulfed(&self) -> Option<[f64; 2]> {
        self.effects.engulfed(&self.ring)
    }

    fn ring(&self) -> Option<&Ring> {
        Some(&self.ring)
    }

    fn refused(&self) -> u64 {
        self.counts.refused
    }

    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        descend(&mut SinkingRing::new(&mut self.ring, &mut self.effects, self.instruction_set), farthest, stop)
    }
}

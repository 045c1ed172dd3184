//! Implicit integrator for stiff rings: the literal wall stiffness, `kappa -> 0`, a stiff area, a large tension.
//!
//! Backward differences of second order (BDF2), A- and L-stable, with one nonlinear solve a step. For a step h after one of
//! length `h/r`, with `D` the change over that earlier step and `s = h (1 + r)/(1 + 2r)`,
//!
//! ```text
//! x+ - x = r^2/(1 + 2r) Dx + s v+
//! v+ - v = r^2/(1 + 2r) Dv + s [F(x+)/m - lambda v+]
//! ```
//!
//! (Hairer, Norsett, Wanner, "Solving ODEs I", III.5; stable for r < 2.41, here r <= 2). A first step, and the retry after Newton's
//! method has failed, drop the terms in D and take `s = h`: backward Euler. Without v+ this is the minimisation of [`newton`]
//! with
//!
//! ```text
//! w = (m/s^2)(1 + s lambda),     d* = r^2/(1 + 2r) Dx + s [v + r^2/(1 + 2r) Dv]/(1 + s lambda)
//! ```
//!
//! The damping rates lambda are those at the positions extrapolated from the step before, right to second order. Velocities
//! are made from displacements, never from differences of positions, so they are resolved to about 1e-13.
//!
//! A step that Newton's method cannot solve, or that moves a vertex further than `largest_move`, is taken again in halves
//! ([`StepControl`]). Everything is deterministic, and does not depend on how a run is cut up.

pub mod cyclic;
pub mod field;
pub mod newton;

use crate::on_instruction_set;
use crate::physics::motion::memory::{RingState, WrongState};
use crate::physics::motion::step_control::{StepControl, WHOLE};
use crate::physics::motion::verlet::RingEffects;
use crate::physics::observation::Observation;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::{Drag, EdgeForce, Rates};
use crate::physics::simd::InstructionSet;
use crate::physics::simd::{Instructions, LANES, fma, load, store};
use crate::results::trajectory::{Failure, FailureClass};
use fearless_simd::{f64x8, prelude::*};
use field::Field;
use newton::{Newton, Refusal};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest distance that a vertex may go in one step, in sigma: half of the default vertex diameter, `pi/512`.
pub const LARGEST_MOVE: f64 = std::f64::consts::PI / 512.0;

/// Most halvings: the smallest sub-step is `dt/65536`.
const MOST_HALVINGS: u32 = 16;

/// Accepted sub-steps in a row after which the length doubles.
const PATIENCE: u32 = 4;

/// Why a sub-step was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
enum Refused {
    #[error(transparent)]
    Newton(#[from] Refusal),
    #[error("a vertex would move by {0:.3e} sigma at once")]
    TooFar(f64),
}

/// What a run has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Sub-steps accepted; as many as nominal steps if none was refused.
    pub accepted: u64,
    /// Sub-steps refused.
    pub refused: u64,
    /// Newton steps of the accepted ones.
    pub iterations: u64,
}

/// A ring with its effects, advanced implicitly.
#[derive(Debug)]
pub struct ImplicitMotion<E, D> {
    /// The ring; `ux`, `uy` are velocities at the time of its positions.
    pub ring: Ring,
    /// Its effects.
    pub effects: RingEffects<E, D>,
    /// Nominal time step.
    pub dt: f64,
    /// Largest distance that a vertex may go in one sub-step.
    pub largest_move: f64,
    /// What it has cost.
    pub work: Work,
    instruction_set: InstructionSet,
    newton: Newton,
    control: StepControl,
    earlier: Earlier,
    steps: u64,
}

/// The step before: what a backward difference of second order remembers.
#[derive(Debug)]
struct Earlier {
    /// Change of the positions.
    moved: Field,
    /// Change of the velocities.
    gained: Field,
    /// Its length; infinite if there was none, or none worth remembering.
    step: f64,
}

/// What decides how an implicit motion goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImplicitState {
    ring: RingState,
    memory: Vec<Vec<f64>>,
    work: Work,
    control: StepControl,
    moved: Field,
    gained: Field,
    earlier_step: f64,
    steps: u64,
}

impl<E: EdgeForce, D: Drag> ImplicitMotion<E, D> {
    /// A ring at rest.
    pub fn start(ring: Ring, effects: RingEffects<E, D>, dt: f64, instruction_set: InstructionSet) -> Self {
        let n = ring.n;
        let mut motion = Self {
            ring,
            effects,
            dt,
            largest_move: LARGEST_MOVE,
            work: Work::default(),
            instruction_set,
            newton: Newton::new(n),
            control: StepControl::new(MOST_HALVINGS, PATIENCE),
            earlier: Earlier { moved: Field::zero(n), gained: Field::zero(n), step: f64::INFINITY },
            steps: 0,
        };
        motion.ring.ux.fill(0.0);
        motion.ring.uy.fill(0.0);
        motion.moved(f64::INFINITY);
        motion
    }

    /// Tells the effects that no vertex moved further than `distance`.
    fn moved(&mut self, distance: f64) {
        self.effects.walls.moved(distance, &self.ring);
        for other in &mut self.effects.others {
            other.moved(distance, &self.ring);
        }
        self.effects.drag.update(distance + self.newton.travelled, &self.ring);
        self.newton.travelled = 0.0;
    }

    /// Its state between two nominal steps.
    pub fn state(&self) -> ImplicitState {
        ImplicitState {
            ring: RingState::of(&self.ring),
            memory: self.effects.memory(),
            work: self.work,
            control: self.control,
            moved: self.earlier.moved.clone(),
            gained: self.earlier.gained.clone(),
            earlier_step: self.earlier.step,
            steps: self.steps,
        }
    }

    /// Goes on from `state`, with `n` vertices and nominal steps of `dt`.
    ///
    /// # Errors
    /// [`WrongState`] if it is not one of such a motion.
    pub fn resume(
        state: &ImplicitState,
        n: usize,
        effects: RingEffects<E, D>,
        dt: f64,
        instruction_set: InstructionSet,
    ) -> Result<Self, WrongState> {
        let mut motion = Self::start(state.ring.ring(n)?, effects, dt, instruction_set);
        let fits = |field: &Field| field.x.len() == motion.earlier.moved.x.len() && field.y.len() == field.x.len();
        if !fits(&state.moved) || !fits(&state.gained) || !motion.control.resume(state.control) {
            return Err(WrongState);
        }
        // A start is at rest.
        motion.ring = state.ring.ring(n)?;
        motion.effects.recall(&state.memory)?;
        motion.earlier = Earlier { moved: state.moved.clone(), gained: state.gained.clone(), step: state.earlier_step };
        (motion.work, motion.steps) = (state.work, state.steps);
        Ok(motion)
    }

    /// Takes `steps` nominal time steps.
    ///
    /// # Errors
    /// `unstable` if a step cannot be solved even at 1/65536 of its length.
    pub fn advance(&mut self, steps: u64) -> Result<(), Failure> {
        self.advance_unless(&AtomicBool::new(false), steps).map(drop)
    }

    /// The same; false, and somewhere on the way, once `stop` is set.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    pub fn advance_unless(&mut self, stop: &AtomicBool, steps: u64) -> Result<bool, Failure> {
        for _ in 0..steps {
            let mut at = 0;
            while at < WHOLE {
                if stop.load(Ordering::Relaxed) {
                    return Ok(false);
                }
                match self.try_step(self.control.length(self.dt)) {
                    Ok(()) => {
                        at += self.control.ticks();
                        self.control.accepted(at);
                    }
                    Err(refused) => self.retreat(refused)?,
                }
            }
            self.steps += 1;
        }
        Ok(true)
    }

    /// Puts the ring back where the refused sub-step began, and halves the next one.
    fn retreat(&mut self, refused: Refused) -> Result<(), Failure> {
        self.work.refused += 1;
        let back = self.newton.displacement.largest(self.instruction_set);
        self.newton.displacement = Field::zero(self.ring.n);
        let back = if back.is_finite() { back } else { f64::INFINITY };
        self.newton.place(&mut self.ring, &mut self.effects, self.instruction_set, back);
        if matches!(refused, Refused::Newton(_)) {
            self.earlier.step = f64::INFINITY;
        }
        if self.control.refused() {
            return Ok(());
        }
        let length = self.control.length(self.dt);
        let reason =
            format!("the implicit step fails even at dt = {length:.1e}: {refused}; lower dt or the stiffnesses");
        Err(Failure { class: FailureClass::Unstable, reason, step: self.steps, outline: None })
    }

    /// Tries a step of length `h`.
    fn try_step(&mut self, h: f64) -> Result<(), Refused> {
        let (ring, newton, earlier) = (&mut self.ring, &mut self.newton, &self.earlier);
        let long = ring.ux.len();
        newton.start.x.copy_from_slice(&ring.x[..long]);
        newton.start.y.copy_from_slice(&ring.y[..long]);
        let scheme = Scheme::of(h, h / earlier.step);
        on_instruction_set!(self.instruction_set, simd => scheme.foresee(simd, ring, earlier, newton));
        let far = newton.displacement.largest(self.instruction_set);
        newton.place(ring, &mut self.effects, self.instruction_set, far);
        self.effects.drag.update(newton.travelled, ring);
        newton.travelled = 0.0;
        on_instruction_set!(self.instruction_set, simd => scheme.aim(simd, ring, self.effects.drag.rates(), earlier, newton));
        let iterations = newton.minimise(ring, &mut self.effects, self.instruction_set)?;
        let far = newton.displacement.largest(self.instruction_set);
        if !(far <= self.largest_move) {
            return Err(Refused::TooFar(far));
        }
        on_instruction_set!(self.instruction_set, simd => scheme.accept(simd, ring, newton, &mut self.earlier));
        self.effects.settled(ring);
        self.earlier.step = h;
        self.work.accepted += 1;
        self.work.iterations += u64::from(iterations);
        Ok(())
    }

    /// Moves the ring's origin next to it. Call at instants that do not depend on how a run is cut up.
    pub fn follow(&mut self) {
        self.ring.follow();
        self.moved(0.0);
    }

    /// Potential energy of all effects at the present positions.
    pub fn potential_energy(&self) -> f64 {
        self.effects.potential_energy(&self.ring)
    }

    /// Everything that is recorded, at the present positions.
    pub fn observe(&mut self) -> Observation {
        self.effects.observe(&self.ring, &self.ring.ux, &self.ring.uy)
    }

    /// World position of an obstacle inside the ring, if there is one.
    pub fn engulfed(&self) -> Option<[f64; 2]> {
        self.effects.engulfed(&self.ring)
    }
}

/// The numbers of one step.
#[derive(Clone, Copy)]
struct Scheme {
    /// h, its length.
    h: f64,
    /// r, the ratio of h to the length of the step before.
    ratio: f64,
    /// s, the implicit share of the step.
    s: f64,
    /// `r^2/(1 + 2r)`, how much of the earlier change is kept.
    keep: f64,
}

impl Scheme {
    /// A step of length `h`, `ratio` times as long as the one before.
    fn of(h: f64, ratio: f64) -> Self {
        let both = 1.0 + 2.0 * ratio;
        Self { h, ratio, s: h * (1.0 + ratio) / both, keep: ratio * ratio / both }
    }

    /// Where the ring would be if its velocities went on to change as they did: `d = h (v + r/2 Dv)`.
    #[inline(always)]
    fn foresee<S: Instructions>(self, simd: S, ring: &Ring, earlier: &Earlier, newton: &mut Newton) {
        let (h, half_change) = (f64x8::splat(simd, self.h), f64x8::splat(simd, 0.5 * self.h * self.ratio));
        let Field { x, y } = &mut newton.displacement;
        for (to, v, gained) in
            [(&mut x[..], &ring.ux[..], &earlier.gained.x[..]), (&mut y[..], &ring.uy[..], &earlier.gained.y[..])]
        {
            for i in (0..v.len()).step_by(LANES) {
                store(fma(load(simd, gained, i), half_change, load(simd, v, i) * h), to, i);
            }
        }
    }

    /// Sets the weights and the free displacements.
    #[inline(always)]
    fn aim<S: Simd>(self, simd: S, ring: &Ring, drag: Rates<'_>, earlier: &Earlier, newton: &mut Newton) {
        let Self { s, keep, .. } = self;
        let inertia = ring.vertex_mass() / (s * s);
        for i in (0..newton.weight.len()).step_by(LANES) {
            let damping = f64x8::splat(simd, 1.0) + drag.load(simd, i) * s;
            store(damping * inertia, &mut newton.weight, i);
            let share = s / damping;
            let vx = load(simd, &ring.ux, i) + load(simd, &earlier.gained.x, i) * keep;
            let vy = load(simd, &ring.uy, i) + load(simd, &earlier.gained.y, i) * keep;
            store(load(simd, &earlier.moved.x, i) * keep + vx * share, &mut newton.free.x, i);
            store(load(simd, &earlier.moved.y, i) * keep + vy * share, &mut newton.free.y, i);
        }
    }

    /// Takes over the new velocities `v+ = (d - keep Dx)/s`, and remembers the step.
    #[inline(always)]
    fn accept<S: Instructions>(self, simd: S, ring: &mut Ring, newton: &Newton, earlier: &mut Earlier) {
        let (inverse, less) = (f64x8::splat(simd, 1.0 / self.s), f64x8::splat(simd, -self.keep / self.s));
        let (d, Earlier { moved, gained, .. }) = (&newton.displacement, earlier);
        for (d, v, moved, gained) in [
            (&d.x[..], &mut ring.ux[..], &mut moved.x[..], &mut gained.x[..]),
            (&d.y[..], &mut ring.uy[..], &mut moved.y[..], &mut gained.y[..]),
        ] {
            for i in (0..d.len()).step_by(LANES) {
                let (now, before) = (load(simd, d, i), load(simd, v, i));
                let after = fma(load(simd, moved, i), less, now * inverse);
                store(after - before, gained, i);
                store(now, moved, i);
                store(after, v, i);
            }
        }
    }
}

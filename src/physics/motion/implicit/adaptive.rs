//! Implicit steps of a ring whose length follows their error.
//!
//! The scheme is that of [`ImplicitMotion`], which takes steps of any length. What was foreseen of a step and what came
//! of it differ by a multiple of the third derivative, and so does the error of the step (`scheme`). The next step is as
//! long as the error allowed lets it be ([`step_length`]):
//!
//! ```text
//! h+ = 0.9 h (allowed/error)^(1/3),     allowed = min(step_error, 0.01 t0 x the speed of the fastest vertex)
//! ```
//!
//! where the error is three times the root mean square of those of the vertices. The second bound follows a droplet that
//! comes to rest: without it, steps would no longer see how its motion decays once that is smaller than `step_error`. No
//! vertex moves further in a step than a third of the size of what it could leap over.
//!
//! Steps depend on the trajectory only, not on when it is looked at: the ring is ahead of the present time by part of a
//! step, and what is asked of the present is read off in between ([`crate::physics::motion::reading`]).
//!
//! A step is taken again, shorter, if it is not solved, if its error is more than twice what is allowed, or if the
//! energy rises in a step that is not short. In the first case and the last, the next attempt is a step of backward
//! Euler, which lowers the energy if it is short enough.

use crate::on_instruction_set;
use crate::physics::motion::descent::Equilibrium;
use crate::physics::motion::implicit::{BadStep, Field, ImplicitMotion, ImplicitState, LARGEST_MOVE, StepCounts};
use crate::physics::motion::reading::{Reading, between};
use crate::physics::motion::step_length::{self, FIRST, SHORTEST};
use crate::physics::motion::{Interruption, Motion, MotionState};
use crate::physics::observation::Observation;
use crate::physics::ring::effects::{RingEffects, outline_of};
use crate::physics::ring::{Ring, forces::contact::Load};
use crate::physics::simd::InstructionSet;
use crate::results::outline::Outline;
use crate::results::trajectory::{Failure, FailureClass};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};

/// The error allowed in a step over the speed of the fastest vertex, in t0.
const OF_SPEED: f64 = 0.01;

/// The error of a step is this many times the root mean square of those of the vertices. The largest of them is that of
/// a vertex that slips over a tip along the interface, which hardly matters to the droplet and would take ten steps.
const OF_MEAN: f64 = 3.0;

/// A step is given up after this many Newton steps, because most take two to five, and a shorter step is as good.
const MOST_ITERATIONS: u32 = 10;

/// Newton's method ends with a correction below this share of the error allowed.
const PRECISION: f64 = 1e-3;

/// Corrections below this are rounding, in sigma.
const FINEST: f64 = 1e-12;

/// A droplet whose vertices are slower counts as this fast, in sigma/t0.
const SLOWEST: f64 = 1e-9;

/// A rise of the energy by this share of its size is rounding.
const ROUNDING: f64 = 1e-13;

/// A rise of the energy in so short a step is not an error of the step, in t0: a part of the ring has just come to count
/// as a fold of another part.
const SHORT: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
enum Refused {
    #[error(transparent)]
    Unsolved(#[from] BadStep),
    #[error("its error is {0:.1e} times what is allowed")]
    Inexact(f64),
    #[error("the energy would rise by {0:.1e}")]
    EnergyRises(f64),
}

/// A ring with its effects, advanced by implicit steps that follow their error.
#[derive(Debug)]
pub(crate) struct AdaptiveMotion {
    steps: ImplicitMotion,
    /// The error allowed in one step, in sigma.
    step_error: f64,
    /// Time between two looks.
    dt: f64,
    /// How many times it was looked at.
    looks: u64,
    /// Length of the next step.
    next: f64,
    /// Readings at the last two ends of steps.
    readings: [Reading; 2],
    /// The loads at the last of them.
    loads: Vec<Load>,
    /// Whether a step was taken in the last call.
    is_fresh: bool,
    foreseen: Field,
    velocity: Field,
}

/// Everything that decides how an adaptive motion goes on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdaptiveState {
    steps: ImplicitState,
    looks: u64,
    next: f64,
    readings: [Reading; 2],
}

impl AdaptiveState {
    /// The steps so far.
    pub(in crate::physics) const fn counts(&self) -> StepCounts {
        self.steps.counts()
    }
}

impl AdaptiveMotion {
    /// A ring at rest, of which no vertex may move further than `largest_move` in a step. It is looked at every `dt`.
    pub(crate) fn start(
        ring: Ring,
        effects: RingEffects,
        [dt, step_error]: [f64; 2],
        largest_move: f64,
        instruction_set: InstructionSet,
    ) -> Self {
        let steps = ImplicitMotion::start(ring, effects, FIRST, instruction_set);
        let motion = Self::with(steps, [dt, step_error], largest_move);
        let (reading, loads) = motion.reading(0.0);
        Self { readings: [reading; 2], loads, ..motion }
    }

    fn with(steps: ImplicitMotion, [dt, step_error]: [f64; 2], largest_move: f64) -> Self {
        let n = steps.ring.n;
        let (foreseen, velocity, readings) = (Field::zero(n), Field::zero(n), [Reading::default(); 2]);
        let mut steps = ImplicitMotion { largest_move, ..steps };
        (steps.newton.takes_long_steps, steps.newton.most_iterations) = (true, MOST_ITERATIONS);
        let (loads, is_fresh) = (Vec::new(), true);
        Self { steps, step_error, dt, looks: 0, next: FIRST, readings, loads, is_fresh, foreseen, velocity }
    }

    /// Goes on from `state`. `None` if the state does not belong to a ring of `n` vertices.
    pub(crate) fn resume(
        state: &AdaptiveState,
        n: usize,
        effects: RingEffects,
        times: [f64; 2],
        largest_move: f64,
        instruction_set: InstructionSet,
    ) -> Option<Self> {
        let steps = ImplicitMotion::resume(&state.steps, n, effects, FIRST, instruction_set)?;
        let AdaptiveState { looks, next, readings, .. } = *state;
        let loads = steps.effects.walls.state(&steps.ring).loads;
        Some(Self { looks, next, readings, loads, ..Self::with(steps, times, largest_move) })
    }

    fn now(&self) -> f64 {
        self.looks as f64 * self.dt
    }

    /// The reading at time `t` of the present positions, with the velocities in `self.velocity`, and the loads there.
    fn reading(&self, t: f64) -> (Reading, Vec<Load>) {
        let measured = self.steps.effects.measure(&self.steps.ring, &self.velocity.x, &self.velocity.y);
        (Reading::of(&measured, t), measured.loads)
    }

    /// Takes one step of whatever length can be taken.
    fn step(&mut self) -> Result<(), Failure> {
        self.steps.follow();
        loop {
            let fastest = self.steps.ring.fastest();
            let farthest = 0.9 * self.farthest();
            let h = if fastest * self.next > farthest { farthest / fastest } else { self.next };
            match self.attempt(h, fastest) {
                Ok(()) => return Ok(()),
                Err(refused) => self.retreat(h, refused)?,
            }
        }
    }

    /// How far a vertex may move in the next step: half of its diameter where parts of the ring lie side by side, so that
    /// none leaps over another.
    fn farthest(&self) -> f64 {
        let lies_folded = self.steps.effects.acting_without_stiffness().next().is_some();
        if lies_folded { LARGEST_MOVE.min(self.steps.largest_move) } else { self.steps.largest_move }
    }

    fn attempt(&mut self, h: f64, fastest: f64) -> Result<(), Refused> {
        let scheme = self.steps.foresee(h);
        self.foreseen.clone_from(&self.steps.newton.displacement);
        let instruction_set = self.steps.instruction_set;
        // A droplet that starts has no speed yet.
        let speed = fastest.max(self.foreseen.largest(instruction_set) / h).max(SLOWEST);
        let allowed = self.step_error.min(OF_SPEED * speed);
        self.steps.newton.precision = (PRECISION * allowed).max(FINEST);
        let iterations = self.steps.solve(scheme)?;
        let displacement = &self.steps.newton.displacement;
        let error = scheme.error_share() * self.off() / allowed;
        if !(error <= 2.0) {
            return Err(Refused::Inexact(error));
        }
        let (velocity, earlier) = (&mut self.velocity, &self.steps.earlier);
        on_instruction_set!(instruction_set, simd => scheme.velocities(simd, displacement, earlier, velocity));
        let (reading, loads) = self.reading(self.readings[1].t + h);
        let rise = reading.energy() - self.readings[1].energy();
        if h > SHORT && rise > ROUNDING * (1.0 + reading.potential.abs()) {
            return Err(Refused::EnergyRises(rise));
        }
        self.steps.accept(scheme, iterations);
        (self.readings, self.loads, self.is_fresh) = ([self.readings[1], reading], loads, true);
        self.next = step_length::after(h, libm::cbrt(1.0 / error.max(1e-30)));
        Ok(())
    }

    /// How far the step ended from what was foreseen: [`OF_MEAN`] root mean squares over the vertices.
    fn off(&self) -> f64 {
        let (steps, foreseen) = (&self.steps, &self.foreseen);
        let squares = on_instruction_set!(
            steps.instruction_set,
            simd => steps.newton.displacement.squared_distance(simd, foreseen)
        );
        OF_MEAN * (squares / steps.ring.n as f64).sqrt()
    }

    /// Shortens the next step.
    fn retreat(&mut self, h: f64, refused: Refused) -> Result<(), Failure> {
        self.steps.go_back();
        self.next = match refused {
            Refused::Unsolved(_) | Refused::EnergyRises(_) => 0.4 * h,
            Refused::Inexact(error) => step_length::instead(h, libm::cbrt(1.0 / error)),
        };
        if !matches!(refused, Refused::Inexact(_)) {
            self.steps.earlier.step = f64::INFINITY;
        }
        if self.next >= SHORTEST {
            return Ok(());
        }
        let (t, next) = (self.readings[1].t, self.next);
        let reason = format!(
            "at t = {t:.3} no step can be taken, even at {next:.1e} t0: {refused}; write integrator = \"verlet\", or lower \
             the stiffnesses"
        );
        Err(Failure { class: FailureClass::Unstable, reason, step: self.looks, outline: None })
    }

    /// The ring at time `t`: Hermite's cubic through places and velocities at both ends of the last step.
    fn ring_at(&self, t: f64) -> Ring {
        let [from, to] = [self.readings[0].t, self.readings[1].t];
        let mut ring = self.steps.ring.clone();
        let h = to - from;
        // What is left of the step after `t`.
        let left = if h > 0.0 { ((to - t) / h).clamp(0.0, 1.0) } else { 0.0 };
        let done = 1.0 - left;
        let (back, before, after) = (left * left * (3.0 - 2.0 * left), h * done * left * left, h * done * done * left);
        let Ring { x, y, ux, uy, .. } = &mut ring;
        let earlier = &self.steps.earlier;
        for (place, v, moved, gained) in
            [(x, ux, &earlier.moved.x, &earlier.gained.x), (y, uy, &earlier.moved.y, &earlier.gained.y)]
        {
            for i in 0..self.steps.ring.n {
                place[i] += (v[i] - gained[i]) * before - moved[i] * back - v[i] * after;
            }
        }
        ring.close();
        ring
    }
}

impl Motion for AdaptiveMotion {
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        self.is_fresh = false;
        let until = (self.looks + steps) as f64 * self.dt;
        while self.readings[1].t < until {
            if stop.load(Ordering::Relaxed) {
                return Err(Interruption::Stopped);
            }
            self.step()?;
        }
        self.looks += steps;
        Ok(())
    }

    fn state(&self) -> MotionState {
        let Self { looks, next, readings, .. } = *self;
        MotionState::Adaptive(Box::new(AdaptiveState { steps: self.steps.saved(), looks, next, readings }))
    }

    /// The ring moves its origin by itself, because its steps do not depend on when it is looked at.
    fn follow(&mut self) {}

    fn observe(&mut self) -> Observation {
        between(&self.readings[0], &self.readings[1], self.now())
    }

    /// The loads are those at the end of the step.
    fn outline(&self, t: f64) -> Outline {
        outline_of(&self.ring_at(t), t, &self.loads)
    }

    fn is_fresh(&self) -> bool {
        self.is_fresh
    }

    fn engulfed(&self) -> Option<[f64; 2]> {
        self.steps.engulfed()
    }

    fn ring(&self) -> Option<&Ring> {
        self.steps.ring()
    }

    fn refused(&self) -> u64 {
        self.steps.counts.refused
    }

    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        self.steps.descend(farthest, stop)
    }
}

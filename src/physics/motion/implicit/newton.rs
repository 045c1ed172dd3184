//! One implicit step as a minimisation of its [`Potential`], by Newton's method.
//!
//! Newton's direction p solves `(w + U'') p = -Phi'` with a cyclic block-tridiagonal matrix plus `K_a grad a grad a^T`.
//! If the matrix is not positive definite, only the positive parts of U'' are kept.
//!
//! **Length of a step.** A step `t p` is cut until the slope `p Phi'(d + t p)` is at most half as steep upwards as it
//! was downwards at t = 0; Phi has then fallen. The slope is used because differences of Phi itself drown in round-off
//! long before velocities of 1e-9 V_t are resolved. Nor may a cut step end where the slope is still steeper than 0.9 of
//! that at t = 0, because the slope has kinks where a hard wall is touched. A step that ends just before the wall would
//! not see it, and the next Newton step would be the same again.
//!
//! **Held contacts.** In the predicted positions a ring that slides round an obstacle has lost contact, because the
//! prediction follows the tangent of the circle. Newton's method would find the contacts again one by one. So the first
//! Newton step holds the contacts that pushed at the end of the time step before, and is taken whole. Then they are
//! free to open.

use crate::on_instruction_set;
use crate::physics::motion::implicit::cyclic::{CyclicSolver, Outer};
use crate::physics::motion::implicit::{field::Field, potential::Potential};
use crate::physics::ring::forces::stiffness::Parts;
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::{InstructionSet, LANES, load, store};
use fearless_simd::prelude::*;

/// A time step is given up after this many Newton steps, unless another number is asked for.
const MOST_ITERATIONS: u32 = 25;

/// Largest number of cuts of one Newton step.
const MOST_CUTS: u32 = 14;

/// Newton's method ends with a correction below this, in sigma, plus [`RELATIVE_TOLERANCE`] times the displacement, or
/// below the precision that is asked for.
const TOLERANCE: f64 = 1e-14;

/// See [`TOLERANCE`].
const RELATIVE_TOLERANCE: f64 = 1e-8;

/// Smaller corrections, in sigma, are taken whole, because their slopes drown in round-off.
const NOT_CUT: f64 = 1e-11;

/// Longest correction of one vertex in one Newton step, in sigma.
const LONGEST: f64 = 0.02;

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Unsolved {
    /// Newton's method did not converge.
    #[error("Newton's method did not converge")]
    NotConverged,
    /// Even the positive parts gave no positive definite matrix, so the numbers are no longer finite.
    #[error("the positions are no longer finite")]
    NotFinite,
    /// The second derivative is indefinite, so there need not be one minimum nearby.
    #[error("the second derivative is indefinite")]
    Indefinite,
}

#[derive(Debug)]
pub(super) struct Newton {
    instruction_set: InstructionSet,
    /// Positions at the start of the step.
    pub(super) start: Field,
    /// Displacements since then.
    pub(super) displacement: Field,
    /// Upper bound of the distance that any vertex has moved since this was last set to zero.
    pub(super) travelled: f64,
    /// A time step is given up after this many Newton steps.
    pub(super) most_iterations: u32,
    /// Whether the matrix is made for long steps: the stiffness of the area may be what makes it positive definite, and
    /// self-contact has a part in it.
    pub(super) takes_long_steps: bool,
    /// A correction below this is the last, in sigma.
    pub(super) precision: f64,
    pub(super) potential: Potential,
    correction: Field,
    solver: CyclicSolver,
}

impl Newton {
    pub(super) fn new(n: usize, instruction_set: InstructionSet) -> Self {
        Self {
            instruction_set,
            start: Field::zero(n),
            displacement: Field::zero(n),
            travelled: 0.0,
            most_iterations: MOST_ITERATIONS,
            takes_long_steps: false,
            precision: 0.0,
            potential: Potential::new(n, instruction_set),
            correction: Field::zero(n),
            solver: CyclicSolver::new(n),
        }
    }

    /// Puts the ring at `start + displacement`, to which no vertex moves further than `distance`.
    pub(super) fn put(&mut self, ring: &mut Ring, effects: &mut RingEffects, distance: f64) {
        on_instruction_set!(self.instruction_set, simd => self.put_with(simd, ring));
        ring.close();
        self.travelled += distance;
        effects.moved(distance, ring);
    }

    #[inline(always)]
    fn put_with<S: Simd>(&self, simd: S, ring: &mut Ring) {
        for (to, start, by) in [
            (&mut ring.x[..], &self.start.x[..], &self.displacement.x[..]),
            (&mut ring.y[..], &self.start.y[..], &self.displacement.y[..]),
        ] {
            for i in (0..by.len()).step_by(LANES) {
                store(load(simd, start, i) + load(simd, by, i), to, i);
            }
        }
    }

    /// Adds `share` times the correction, whose longest vector has the length `size`.
    fn go(&mut self, ring: &mut Ring, effects: &mut RingEffects, share: f64, size: f64) {
        on_instruction_set!(self.instruction_set, simd => self.displacement.add(simd, share, &self.correction));
        self.put(ring, effects, share.abs() * size);
    }

    /// Minimises Phi, beginning at the present displacement; returns the number of Newton steps.
    ///
    /// # Errors
    /// [`Unsolved`]; the ring is then where the search ended.
    pub(super) fn minimise(&mut self, ring: &mut Ring, effects: &mut RingEffects) -> Result<u32, Unsolved> {
        let mut held = effects.hold(ring);
        self.potential.evaluate(&self.displacement, ring, effects);
        for iteration in 1..=self.most_iterations {
            let found = self.direct(ring, effects);
            effects.let_go();
            found?;
            let size = self.correction.largest(self.instruction_set);
            if !size.is_finite() {
                return Err(Unsolved::NotFinite);
            }
            if held {
                held = false;
                self.go(ring, effects, (LONGEST / size).min(1.0), size);
                self.potential.evaluate(&self.displacement, ring, effects);
                continue;
            }
            let relative = RELATIVE_TOLERANCE * self.displacement.largest(self.instruction_set);
            if size <= (TOLERANCE + relative).max(self.precision) {
                self.go(ring, effects, 1.0, size);
                return Ok(iteration);
            }
            self.search(ring, effects, size);
        }
        Err(Unsolved::NotConverged)
    }

    /// Minimises Phi where it is convex, from the present displacement on, to a last correction below `precision`.
    ///
    /// # Errors
    /// [`Unsolved::Indefinite`] where `w + U''` has a negative eigenvalue; else as [`minimise`](Self::minimise).
    pub(super) fn minimise_convex(
        &mut self,
        ring: &mut Ring,
        effects: &mut RingEffects,
        precision: f64,
    ) -> Result<(), Unsolved> {
        self.potential.evaluate(&self.displacement, ring, effects);
        for _ in 1..=MOST_ITERATIONS {
            let Self { potential, correction, solver, .. } = self;
            potential.assemble(ring, effects, Parts::All, false);
            against(&potential.gradient, correction);
            let (area, right) = (potential.area_gradient.parts(), correction.parts_mut());
            let k = effects.area.stiffness;
            if solver.solve_counting(self.instruction_set, &potential.stiffness, k, area, right) > 0 {
                return Err(Unsolved::Indefinite);
            }
            let size = self.correction.largest(self.instruction_set);
            if !size.is_finite() {
                return Err(Unsolved::NotFinite);
            }
            if size <= precision {
                self.go(ring, effects, 1.0, size);
                return Ok(());
            }
            self.search(ring, effects, size);
        }
        Err(Unsolved::NotConverged)
    }

    /// Newton's direction at the present positions.
    fn direct(&mut self, ring: &Ring, effects: &RingEffects) -> Result<(), Unsolved> {
        let Self { potential, correction, solver, .. } = self;
        for parts in [Parts::All, Parts::Positive] {
            potential.assemble(ring, effects, parts, self.takes_long_steps);
            against(&potential.gradient, correction);
            let (area, right) = (potential.area_gradient.parts(), correction.parts_mut());
            let is_needed = self.takes_long_steps && parts == Parts::All;
            let outer = Outer { k: effects.area.stiffness, g: area, is_needed };
            let solved = solver.solve(self.instruction_set, &potential.stiffness, outer, right);
            if solved.is_ok() {
                return Ok(());
            }
        }
        Err(Unsolved::NotFinite)
    }

    /// Moves along the correction, which is cut as the [module](self) says.
    fn search(&mut self, ring: &mut Ring, effects: &mut RingEffects, size: f64) {
        let down = -self.slope();
        let mut share = (LONGEST / size).min(1.0);
        self.go(ring, effects, share, size);
        self.potential.evaluate(&self.displacement, ring, effects);
        if size < NOT_CUT {
            return;
        }
        let mut up = self.slope();
        // Two lengths between which the minimum lies, and their slopes.
        let (mut low, mut high) = ((0.0, -down), (share, up));
        for cut in 0..MOST_CUTS {
            if up <= 0.5 * down && (cut == 0 || up >= -0.9 * down) {
                return;
            }
            // Where the straight line through both slopes is zero. Kinks mislead it, so every third cut is half way.
            let width = high.0 - low.0;
            let level_at = if cut % 3 == 2 { 0.5 } else { low.1 / (low.1 - high.1) };
            let level_at = if level_at.is_finite() { level_at.clamp(0.01, 0.99) } else { 0.1 };
            let next = low.0 + level_at * width;
            self.go(ring, effects, next - share, size);
            share = next;
            self.potential.evaluate(&self.displacement, ring, effects);
            up = self.slope();
            if up <= 0.0 {
                low = (share, up);
            } else {
                high = (share, up);
            }
        }
    }

    /// `p Phi'`.
    fn slope(&self) -> f64 {
        on_instruction_set!(self.instruction_set, simd => self.correction.dot(simd, &self.potential.gradient))
    }
}

/// Sets `direction` against the gradient.
fn against(gradient: &Field, direction: &mut Field) {
    for (p, slope) in direction.parts_mut().into_iter().zip(gradient.parts()) {
        p.iter_mut().zip(slope).for_each(|(p, slope)| *p = -slope);
    }
}

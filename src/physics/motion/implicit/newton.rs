//! One implicit step as a minimisation of its [`Potential`], by Newton's method.
//!
//! Newton's direction p solves `(w + U'') p = -Phi'` with a cyclic block-tridiagonal matrix plus `K_a grad a grad a^T`.
//! Where that is not positive definite, only the positive parts of U'' are kept.
//!
//! The length t of a step along p is such that the slope `p Phi'(d + t p)` has not turned up by more than half of what
//! it was down. Phi has then fallen. It is judged by the slope because differences of Phi itself drown in round-off
//! long before velocities of 1e-9 V_t are resolved. Nor may a cut step end short of the bottom, because the slope has
//! kinks where a hard wall is touched: a step that ends just before the wall does not learn of it, and the next one is
//! the same again.
//!
//! A ring that slides round an obstacle loses touch in every prediction, by the little that a tangent leads away from a
//! circle, and Newton's method would find the contacts again one by one. So the first step holds on to those that
//! pushed at the end of the time step before, and is taken whole; then they are free to open.

use crate::on_instruction_set;
use crate::physics::motion::implicit::cyclic::CyclicSolver;
use crate::physics::motion::implicit::field::Field;
use crate::physics::motion::implicit::potential::Potential;
use crate::physics::ring::Ring;
use crate::physics::ring::effects::RingEffects;
use crate::physics::ring::forces::stiffness::Parts;
use crate::physics::simd::{InstructionSet, LANES, load, store};
use fearless_simd::prelude::*;

/// Most Newton steps before a time step is given up.
const MOST_ITERATIONS: u32 = 25;

/// Most cuts of one Newton step.
const MOST_CUTS: u32 = 14;

/// The last correction is smaller than this, in sigma, plus [`RELATIVE_TOLERANCE`] of the largest displacement.
const TOLERANCE: f64 = 1e-14;

/// Share of the largest displacement that the last correction may have.
const RELATIVE_TOLERANCE: f64 = 1e-8;

/// Corrections below this are taken whole: slopes drown in round-off.
const NOT_CUT: f64 = 1e-11;

/// Longest correction of one vertex in one Newton step, in sigma.
const LONGEST: f64 = 0.02;

/// Why a step could not be solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Unsolved {
    /// Newton's method did not arrive.
    #[error("Newton's method did not converge")]
    NotConverged,
    /// Not even the positive parts gave a positive matrix: the numbers are no longer finite.
    #[error("the positions are no longer finite")]
    NotFinite,
}

/// Work space of the minimisation.
#[derive(Debug)]
pub(super) struct Newton {
    instruction_set: InstructionSet,
    /// Positions at the start of the step.
    pub(super) start: Field,
    /// Displacements since then.
    pub(super) displacement: Field,
    /// How far any vertex may have moved since this was last set to zero.
    pub(super) travelled: f64,
    /// What is minimised.
    pub(super) potential: Potential,
    correction: Field,
    solver: CyclicSolver,
}

impl Newton {
    /// Work space for `n` vertices.
    pub(super) fn new(n: usize, instruction_set: InstructionSet) -> Self {
        Self {
            instruction_set,
            start: Field::zero(n),
            displacement: Field::zero(n),
            travelled: 0.0,
            potential: Potential::new(n, instruction_set),
            correction: Field::zero(n),
            solver: CyclicSolver::new(n),
        }
    }

    /// Puts the ring at `start + displacement`; none of its vertices has been further than `distance` from there.
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

    /// Adds `share` of the correction, whose largest vector is `size`.
    fn go(&mut self, ring: &mut Ring, effects: &mut RingEffects, share: f64, size: f64) {
        on_instruction_set!(self.instruction_set, simd => self.displacement.add(simd, share, &self.correction));
        self.put(ring, effects, share.abs() * size);
    }

    /// Minimises Phi from the present displacement on; returns the number of Newton steps.
    ///
    /// # Errors
    /// [`Unsolved`], with the ring wherever the search had got to.
    pub(super) fn minimise(&mut self, ring: &mut Ring, effects: &mut RingEffects) -> Result<u32, Unsolved> {
        let mut held = effects.hold(ring);
        self.potential.evaluate(&self.displacement, ring, effects);
        for iteration in 1..=MOST_ITERATIONS {
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
            if size <= TOLERANCE + RELATIVE_TOLERANCE * self.displacement.largest(self.instruction_set) {
                self.go(ring, effects, 1.0, size);
                return Ok(iteration);
            }
            self.search(ring, effects, size);
        }
        Err(Unsolved::NotConverged)
    }

    /// Newton's direction at the present positions.
    fn direct(&mut self, ring: &Ring, effects: &RingEffects) -> Result<(), Unsolved> {
        let Self { potential, correction, solver, .. } = self;
        for parts in [Parts::All, Parts::Positive] {
            potential.assemble(ring, effects, parts);
            for (p, slope) in correction.parts_mut().into_iter().zip(potential.gradient.parts()) {
                p.iter_mut().zip(slope).for_each(|(p, slope)| *p = -slope);
            }
            let (area, right) = (potential.area_gradient.parts(), correction.parts_mut());
            let solved = solver.solve(self.instruction_set, &potential.stiffness, effects.area.stiffness, area, right);
            if solved.is_ok() {
                return Ok(());
            }
        }
        Err(Unsolved::NotFinite)
    }

    /// Goes along the correction, cut until the slope of Phi is no longer steep.
    fn search(&mut self, ring: &mut Ring, effects: &mut RingEffects, size: f64) {
        let down = -self.slope();
        let mut share = (LONGEST / size).min(1.0);
        self.go(ring, effects, share, size);
        self.potential.evaluate(&self.displacement, ring, effects);
        if size < NOT_CUT {
            return;
        }
        let mut up = self.slope();
        // The bottom lies between two lengths: at the first the slope leads down, at the second up.
        let (mut low, mut high) = ((0.0, -down), (share, up));
        for cut in 0..MOST_CUTS {
            if up <= 0.5 * down && (cut == 0 || up >= -0.9 * down) {
                return;
            }
            // Where a straight line through both slopes is level. Kinks mislead it, so every third cut is half way.
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

//! One implicit step as a minimisation, by Newton's method.
//!
//! The displacements d that the step looks for minimise the incremental potential
//!
//! ```text
//! Phi(d) = sum_i (w_i/2) |d_i - d*_i|^2 + U(x + d)
//! ```
//!
//! with weights `w_i` of inertia and drag and free displacements `d*` that the time scheme sets. Newton's direction p solves
//! `(w + U'') p = -Phi'` with a cyclic block-tridiagonal matrix plus `K_a grad a grad a^T`. Where that is not positive
//! definite, only the positive parts of U'' are kept.
//!
//! The length t of a step along p is such that the slope `p Phi'(d + t p)` has not turned up by more than half of what it was
//! down: Phi has fallen, which is judged by the slope because differences of Phi itself drown in round-off long before
//! velocities of 1e-9 V_t are resolved. Nor may a cut step end short of the bottom, for the slope has kinks where a hard wall is
//! touched: a step that ends just before the wall does not learn of it, and the next one is the same again.
//!
//! A ring that slides round an obstacle loses touch in every prediction, by the little that a tangent leads away from a
//! circle, and Newton's method would find the contacts again one by one. So the first step holds on to those that pushed at the
//! end of the time step before, and is taken whole; then they are free to open.

use crate::on_instruction_set;
use crate::physics::motion::implicit::cyclic::CyclicSolver;
use crate::physics::motion::implicit::field::Field;
use crate::physics::motion::verlet::{RingEffects, add_forces};
use crate::physics::ring::Ring;
use crate::physics::ring::forces::stiffness::{Parts, Stiffness};
use crate::physics::ring::forces::{Drag, EdgeForce};
use crate::physics::ring::passes::{EdgeLaw, Edges, RingForces, edge_pass};
use crate::physics::simd::InstructionSet;
use crate::physics::simd::aligned::Aligned;
use crate::physics::simd::{Instructions, LANES, fma, inverse_sqrt, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

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
pub enum Refusal {
    /// Newton's method did not arrive.
    #[error("Newton's method did not converge")]
    NotConverged,
    /// Not even the positive parts gave a positive matrix: the numbers are no longer finite.
    #[error("the positions are no longer finite")]
    NotFinite,
}

/// Work space of the minimisation.
#[derive(Debug)]
pub struct Newton {
    /// Positions at the start of the step.
    pub start: Field,
    /// Displacements.
    pub displacement: Field,
    /// Free displacements d*.
    pub free: Field,
    /// Weights w.
    pub weight: Aligned,
    /// How far any vertex may have moved since this was last set to zero.
    pub travelled: f64,
    residual: Field,
    correction: Field,
    area_gradient: Field,
    half_pressure: f64,
    edge_stiffness: [Aligned; 3],
    stiffness: Stiffness,
    solver: CyclicSolver,
}

impl Newton {
    /// Work space for `n` vertices.
    pub fn new(n: usize) -> Self {
        let field = || Field::zero(n);
        let edges = || Aligned::zeros(padded(n) + LANES);
        Self {
            start: field(),
            displacement: field(),
            free: field(),
            weight: Aligned::zeros(padded(n)),
            travelled: 0.0,
            residual: field(),
            correction: field(),
            area_gradient: field(),
            half_pressure: 0.0,
            edge_stiffness: [edges(), edges(), edges()],
            stiffness: Stiffness::new(n),
            solver: CyclicSolver::new(n),
        }
    }

    /// Puts the ring at `start + displacement`, none of its vertices having been further than `distance` from there.
    pub fn place<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &mut RingEffects<E, D>,
        instruction_set: InstructionSet,
        distance: f64,
    ) {
        on_instruction_set!(instruction_set, simd => self.place_with(simd, ring));
        ring.close();
        self.travelled += distance;
        effects.walls.moved(distance, ring);
        for other in &mut effects.others {
            other.moved(distance, ring);
        }
    }

    #[inline(always)]
    fn place_with<S: Simd>(&self, simd: S, ring: &mut Ring) {
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
    fn go<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &mut RingEffects<E, D>,
        instruction_set: InstructionSet,
        share: f64,
        size: f64,
    ) {
        on_instruction_set!(instruction_set, simd => self.displacement.add(simd, share, &self.correction));
        self.place(ring, effects, instruction_set, share.abs() * size);
    }

    /// Minimises Phi from the present displacement on; returns the number of Newton steps.
    ///
    /// # Errors
    /// [`Refusal`], with the ring wherever the search had got to.
    pub fn minimise<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &mut RingEffects<E, D>,
        instruction_set: InstructionSet,
    ) -> Result<u32, Refusal> {
        let mut held = effects.hold(ring);
        self.evaluate(ring, effects, instruction_set);
        for iteration in 1..=MOST_ITERATIONS {
            let found = self.direct(ring, effects, instruction_set);
            effects.let_go();
            found?;
            let size = self.correction.largest(instruction_set);
            if !size.is_finite() {
                return Err(Refusal::NotFinite);
            }
            if held {
                held = false;
                self.go(ring, effects, instruction_set, (LONGEST / size).min(1.0), size);
                self.evaluate(ring, effects, instruction_set);
                continue;
            }
            if size <= TOLERANCE + RELATIVE_TOLERANCE * self.displacement.largest(instruction_set) {
                self.go(ring, effects, instruction_set, 1.0, size);
                return Ok(iteration);
            }
            self.search(ring, effects, instruction_set, size);
        }
        Err(Refusal::NotConverged)
    }

    /// Newton's direction at the present positions.
    fn direct<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &Ring,
        effects: &RingEffects<E, D>,
        instruction_set: InstructionSet,
    ) -> Result<(), Refusal> {
        for parts in [Parts::All, Parts::Positive] {
            self.assemble(ring, effects, instruction_set, parts);
            for (p, r) in [(&mut self.correction.x, &self.residual.x), (&mut self.correction.y, &self.residual.y)] {
                p.iter_mut().zip(r.iter()).for_each(|(p, r)| *p = -r);
            }
            let gradient = [&self.area_gradient.x[..], &self.area_gradient.y[..]];
            let right = [&mut self.correction.x[..], &mut self.correction.y[..]];
            if self.solver.solve(instruction_set, &self.stiffness, effects.area.stiffness, gradient, right).is_ok() {
                return Ok(());
            }
        }
        Err(Refusal::NotFinite)
    }

    /// Goes along the correction, cut until the slope of Phi is no longer steep.
    fn search<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &mut RingEffects<E, D>,
        instruction_set: InstructionSet,
        size: f64,
    ) {
        let down = -self.slope(instruction_set);
        let mut share = (LONGEST / size).min(1.0);
        self.go(ring, effects, instruction_set, share, size);
        self.evaluate(ring, effects, instruction_set);
        if size < NOT_CUT {
            return;
        }
        let mut up = self.slope(instruction_set);
        // The bottom lies between two lengths: at the first the slope leads down, at the second up.
        let (mut low, mut high) = ((0.0, -down), (share, up));
        for cut in 0..MOST_CUTS {
            if up <= 0.5 * down && (cut == 0 || up >= -0.9 * down) {
                return;
            }
            // Where a straight line through both slopes is level; every third time half way, for kinks mislead it.
            let width = high.0 - low.0;
            let level_at = if cut % 3 == 2 { 0.5 } else { low.1 / (low.1 - high.1) };
            let level_at = if level_at.is_finite() { level_at.clamp(0.01, 0.99) } else { 0.1 };
            let next = low.0 + level_at * width;
            self.go(ring, effects, instruction_set, next - share, size);
            share = next;
            self.evaluate(ring, effects, instruction_set);
            up = self.slope(instruction_set);
            if up <= 0.0 {
                low = (share, up);
            } else {
                high = (share, up);
            }
        }
    }

    /// `p Phi'`.
    fn slope(&self, instruction_set: InstructionSet) -> f64 {
        on_instruction_set!(instruction_set, simd => self.correction.dot(simd, &self.residual))
    }

    /// Phi' and the gradient of the area at the present positions.
    fn evaluate<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &RingEffects<E, D>,
        instruction_set: InstructionSet,
    ) {
        let area = edge_pass(instruction_set, ring, effects.edge_law());
        let forces = effects.forces(area, add_forces(ring, effects));
        self.half_pressure = forces.half_pressure;
        self.evaluate_forces(ring, &forces, instruction_set);
    }

    /// The same, the forces being known.
    fn evaluate_forces(&mut self, ring: &Ring, forces: &RingForces, instruction_set: InstructionSet) {
        match (forces.law.tension.needs_length(), forces.pushed) {
            (false, false) => {
                on_instruction_set!(instruction_set, simd => self.evaluate_with::<_, false, false>(simd, ring, forces))
            }
            (false, true) => {
                on_instruction_set!(instruction_set, simd => self.evaluate_with::<_, false, true>(simd, ring, forces))
            }
            (true, false) => {
                on_instruction_set!(instruction_set, simd => self.evaluate_with::<_, true, false>(simd, ring, forces))
            }
            (true, true) => {
                on_instruction_set!(instruction_set, simd => self.evaluate_with::<_, true, true>(simd, ring, forces))
            }
        }
        self.residual.still_padding(ring.n);
        self.area_gradient.still_padding(ring.n);
    }

    #[inline(always)]
    fn evaluate_with<S: Instructions, const LENGTH: bool, const PUSHED: bool>(
        &mut self,
        simd: S,
        ring: &Ring,
        forces: &RingForces,
    ) {
        let Self { displacement, free, residual, area_gradient, .. } = self;
        let (weight, edges, pushes) = (&self.weight[..], Edges::of(ring), [&ring.force_x[..], &ring.force_y[..]]);
        let ([x, y], [free_x, free_y]) = (displacement.parts(), free.parts());
        let ([residual_x, residual_y], [area_x, area_y]) = (residual.parts_mut(), area_gradient.parts_mut());
        for i in (0..weight.len()).step_by(LANES) {
            let (fx, fy) = forces.at::<S, LENGTH, PUSHED>(simd, edges, pushes, i);
            let weight = load(simd, weight, i);
            let (off_x, off_y) = (load(simd, x, i) - load(simd, free_x, i), load(simd, y, i) - load(simd, free_y, i));
            store(fma(weight, off_x, -fx), residual_x, i);
            store(fma(weight, off_y, -fy), residual_y, i);
            let chord_x = load(simd, edges.x, i + LANES) + load(simd, edges.x, i + LANES - 1);
            let chord_y = load(simd, edges.y, i + LANES) + load(simd, edges.y, i + LANES - 1);
            store(chord_y * 0.5, area_x, i);
            store(chord_x * -0.5, area_y, i);
        }
    }

    /// Fills the band of `w + U''` where Phi' was last evaluated.
    fn assemble<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &Ring,
        effects: &RingEffects<E, D>,
        instruction_set: InstructionSet,
        parts: Parts,
    ) {
        self.assemble_ring(instruction_set, ring, effects.edge_law(), parts);
        if effects.walls.acts() {
            effects.walls.add_stiffness(ring, parts, &mut self.stiffness);
        }
        for other in effects.others.iter().filter(|other| other.acts()) {
            other.add_stiffness(ring, parts, &mut self.stiffness);
        }
        self.stiffness.fold();
    }

    /// Weights, edges and the pressure, `-p a''` with `d^2 a/(dx_i dy_{i+1}) = 1/2 = -d^2 a/(dy_i dx_{i+1})`.
    fn assemble_ring(&mut self, instruction_set: InstructionSet, ring: &Ring, law: EdgeLaw, parts: Parts) {
        on_instruction_set!(instruction_set, simd => self.assemble_ring_with(simd, ring, law, parts));
    }

    #[inline(always)]
    fn assemble_ring_with<S: Instructions>(&mut self, simd: S, ring: &Ring, law: EdgeLaw, parts: Parts) {
        let (n, long, zero) = (ring.n, padded(ring.n), f64x8::splat(simd, 0.0));
        let EdgeLaw { tension, eps_squared } = law;
        let [along_xx, along_xy, along_yy] = self.edge_stiffness.each_mut().map(|edges| &mut edges[..]);
        let edges = Edges::of(ring);
        for i in (LANES..long + LANES).step_by(LANES) {
            let (ex, ey) = (load(simd, edges.x, i), load(simd, edges.y, i));
            let inverse_length =
                if tension.needs_length() { inverse_sqrt(simd, ex * ex + ey * ey + eps_squared) } else { zero };
            let mut across = tension.coefficient(simd, inverse_length);
            let mut slope = tension.slope(inverse_length);
            if parts == Parts::Positive {
                slope = across.simd_lt(zero).select(slope.max(zero), slope);
                across = across.max(zero);
            }
            store(across + slope * ex * ex, along_xx, i);
            store(slope * ex * ey, along_xy, i);
            store(across + slope * ey * ey, along_yy, i);
        }
        for edges in [&mut *along_xx, &mut *along_xy, &mut *along_yy] {
            edges[LANES - 1] = edges[LANES - 1 + n];
        }
        let turn = if parts == Parts::All { self.half_pressure } else { 0.0 };
        let m = &mut self.stiffness;
        let [own_xx, own_xy, own_yy] = [&mut m.own_xx, &mut m.own_xy, &mut m.own_yy].map(|own| &mut own[..]);
        let next = [&mut m.next_xx, &mut m.next_xy, &mut m.next_yx, &mut m.next_yy];
        let [next_xx, next_xy, next_yx, next_yy] = next.map(|next| &mut next[..]);
        let weights = &self.weight[..];
        for i in (0..long).step_by(LANES) {
            let weight = load(simd, weights, i);
            let (xx, xy, yy) =
                (load(simd, along_xx, i + LANES), load(simd, along_xy, i + LANES), load(simd, along_yy, i + LANES));
            store(weight + (xx + load(simd, along_xx, i + LANES - 1)), own_xx, i);
            store(xy + load(simd, along_xy, i + LANES - 1), own_xy, i);
            store(weight + (yy + load(simd, along_yy, i + LANES - 1)), own_yy, i);
            store(-xx, next_xx, i);
            store(-xy - turn, next_xy, i);
            store(-xy + turn, next_yx, i);
            store(-yy, next_yy, i);
        }
        for own in [own_xx, own_xy, own_yy] {
            own[n..].fill(0.0);
        }
    }

    /// Phi', the band of Phi'' and the gradient of the area with the ring where it is: what a test compares with differences.
    pub fn derivatives<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &RingEffects<E, D>,
        instruction_set: InstructionSet,
        parts: Parts,
    ) -> (Field, Stiffness, Field) {
        self.evaluate(ring, effects, instruction_set);
        self.assemble(ring, effects, instruction_set, parts);
        (self.residual.clone(), self.stiffness.clone(), self.area_gradient.clone())
    }
}

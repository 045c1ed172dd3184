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

use crate::droplet::deformable::Ring;
use crate::effects::stiffness::{Parts, Stiffness};
use crate::effects::{Drag, EdgeForce};
use crate::integrator::cyclic::CyclicSolver;
use crate::integrator::implicit::field::Field;
use crate::integrator::ring_passes::{EdgeLaw, RingForces, edge_pass};
use crate::integrator::verlet::{RingEffects, add_forces};
use crate::on_level;
use crate::vector::{Instructions, LANES, inverse_sqrt, load, padded, store};
use fearless_simd::{Level, f64x8, prelude::*};

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
    pub weight: Vec<f64>,
    /// How far any vertex may have moved since this was last set to zero.
    pub travelled: f64,
    residual: Field,
    correction: Field,
    area_gradient: Field,
    half_pressure: f64,
    edge_stiffness: [Vec<f64>; 3],
    stiffness: Stiffness,
    solver: CyclicSolver,
}

impl Newton {
    /// Work space for `n` vertices.
    pub fn new(n: usize) -> Self {
        let field = || Field::zero(n);
        let edges = || vec![0.0; padded(n) + LANES];
        Self {
            start: field(),
            displacement: field(),
            free: field(),
            weight: vec![0.0; padded(n)],
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
    pub fn place<E: EdgeForce, D: Drag>(&mut self, ring: &mut Ring, effects: &mut RingEffects<E, D>, distance: f64) {
        let n = ring.n;
        for (to, start, by) in [
            (&mut ring.x[..n], &self.start.x[..n], &self.displacement.x[..n]),
            (&mut ring.y[..n], &self.start.y[..n], &self.displacement.y[..n]),
        ] {
            for i in 0..n {
                to[i] = start[i] + by[i];
            }
        }
        ring.close();
        self.travelled += distance;
        effects.walls.moved(distance, ring);
        for other in &mut effects.others {
            other.moved(distance, ring);
        }
    }

    /// Adds `share` of the correction, whose largest vector is `size`.
    fn go<E: EdgeForce, D: Drag>(&mut self, ring: &mut Ring, effects: &mut RingEffects<E, D>, share: f64, size: f64) {
        let n = ring.n;
        for (to, by) in [
            (&mut self.displacement.x[..n], &self.correction.x[..n]),
            (&mut self.displacement.y[..n], &self.correction.y[..n]),
        ] {
            for i in 0..n {
                to[i] += share * by[i];
            }
        }
        self.place(ring, effects, share.abs() * size);
    }

    /// Minimises Phi from the present displacement on; returns the number of Newton steps.
    ///
    /// # Errors
    /// [`Refusal`], with the ring wherever the search had got to.
    pub fn minimise<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &mut RingEffects<E, D>,
        level: Level,
    ) -> Result<u32, Refusal> {
        let mut held = effects.hold(ring);
        self.evaluate(ring, effects, level);
        for iteration in 1..=MOST_ITERATIONS {
            let found = self.direct(ring, effects, level);
            effects.let_go();
            found?;
            let size = self.correction.largest(level);
            if !size.is_finite() {
                return Err(Refusal::NotFinite);
            }
            if held {
                held = false;
                self.go(ring, effects, (LONGEST / size).min(1.0), size);
                self.evaluate(ring, effects, level);
                continue;
            }
            if size <= TOLERANCE + RELATIVE_TOLERANCE * self.displacement.largest(level) {
                self.go(ring, effects, 1.0, size);
                return Ok(iteration);
            }
            self.search(ring, effects, level, size);
        }
        Err(Refusal::NotConverged)
    }

    /// Newton's direction at the present positions.
    fn direct<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &Ring,
        effects: &RingEffects<E, D>,
        level: Level,
    ) -> Result<(), Refusal> {
        for parts in [Parts::All, Parts::Positive] {
            self.assemble(ring, effects, level, parts);
            for (p, r) in [(&mut self.correction.x, &self.residual.x), (&mut self.correction.y, &self.residual.y)] {
                p.iter_mut().zip(r.iter()).for_each(|(p, r)| *p = -r);
            }
            let gradient = [&self.area_gradient.x[..], &self.area_gradient.y[..]];
            let right = [&mut self.correction.x[..], &mut self.correction.y[..]];
            if self.solver.solve(level, &self.stiffness, effects.area.stiffness, gradient, right).is_ok() {
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
        level: Level,
        size: f64,
    ) {
        let down = -self.slope();
        let mut share = (LONGEST / size).min(1.0);
        self.go(ring, effects, share, size);
        self.evaluate(ring, effects, level);
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
            // Where a straight line through both slopes is level; every third time half way, for kinks mislead it.
            let width = high.0 - low.0;
            let level_at = if cut % 3 == 2 { 0.5 } else { low.1 / (low.1 - high.1) };
            let level_at = if level_at.is_finite() { level_at.clamp(0.01, 0.99) } else { 0.1 };
            let next = low.0 + level_at * width;
            self.go(ring, effects, next - share, size);
            share = next;
            self.evaluate(ring, effects, level);
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
        let (p, r) = (&self.correction, &self.residual);
        let mut lanes = [0.0; LANES];
        let (px, py) = (p.x.chunks_exact(LANES), p.y.chunks_exact(LANES));
        let (rx, ry) = (r.x.chunks_exact(LANES), r.y.chunks_exact(LANES));
        for ((px, py), (rx, ry)) in px.zip(py).zip(rx.zip(ry)) {
            for k in 0..LANES {
                lanes[k] += px[k] * rx[k] + py[k] * ry[k];
            }
        }
        lanes.iter().sum()
    }

    /// Phi' and the gradient of the area at the present positions.
    fn evaluate<E: EdgeForce, D: Drag>(&mut self, ring: &mut Ring, effects: &RingEffects<E, D>, level: Level) {
        let area = edge_pass(level, ring, effects.edge_law());
        let forces = effects.forces(area, add_forces(ring, effects));
        self.half_pressure = forces.half_pressure;
        self.evaluate_forces(ring, &forces, level);
    }

    /// The same, the forces being known.
    fn evaluate_forces(&mut self, ring: &Ring, forces: &RingForces, level: Level) {
        match (forces.law.tension.needs_length(), forces.pushed) {
            (false, false) => on_level!(level, simd => self.evaluate_with::<_, false, false>(simd, ring, forces)),
            (false, true) => on_level!(level, simd => self.evaluate_with::<_, false, true>(simd, ring, forces)),
            (true, false) => on_level!(level, simd => self.evaluate_with::<_, true, false>(simd, ring, forces)),
            (true, true) => on_level!(level, simd => self.evaluate_with::<_, true, true>(simd, ring, forces)),
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
        for i in (0..self.weight.len()).step_by(LANES) {
            let (fx, fy) = forces.on::<S, LENGTH, PUSHED>(simd, ring, i);
            let weight = load(simd, &self.weight, i);
            let off_x = load(simd, &self.displacement.x, i) - load(simd, &self.free.x, i);
            let off_y = load(simd, &self.displacement.y, i) - load(simd, &self.free.y, i);
            store(weight * off_x - fx, &mut self.residual.x, i);
            store(weight * off_y - fy, &mut self.residual.y, i);
            let chord_x = load(simd, &ring.edge_x, i + LANES) + load(simd, &ring.edge_x, i + LANES - 1);
            let chord_y = load(simd, &ring.edge_y, i + LANES) + load(simd, &ring.edge_y, i + LANES - 1);
            store(chord_y * 0.5, &mut self.area_gradient.x, i);
            store(chord_x * -0.5, &mut self.area_gradient.y, i);
        }
    }

    /// Fills the band of `w + U''` where Phi' was last evaluated.
    fn assemble<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &Ring,
        effects: &RingEffects<E, D>,
        level: Level,
        parts: Parts,
    ) {
        self.assemble_ring(level, ring, effects.edge_law(), parts);
        if effects.walls.acts() {
            effects.walls.add_stiffness(ring, parts, &mut self.stiffness);
        }
        for other in effects.others.iter().filter(|other| other.acts()) {
            other.add_stiffness(ring, parts, &mut self.stiffness);
        }
        self.stiffness.fold();
    }

    /// Weights, edges and the pressure, `-p a''` with `d^2 a/(dx_i dy_{i+1}) = 1/2 = -d^2 a/(dy_i dx_{i+1})`.
    fn assemble_ring(&mut self, level: Level, ring: &Ring, law: EdgeLaw, parts: Parts) {
        on_level!(level, simd => self.assemble_ring_with(simd, ring, law, parts));
    }

    #[inline(always)]
    fn assemble_ring_with<S: Instructions>(&mut self, simd: S, ring: &Ring, law: EdgeLaw, parts: Parts) {
        let (n, long, zero) = (ring.n, padded(ring.n), f64x8::splat(simd, 0.0));
        let EdgeLaw { tension, eps_squared } = law;
        let [along_xx, along_xy, along_yy] = &mut self.edge_stiffness;
        for i in (LANES..long + LANES).step_by(LANES) {
            let (ex, ey) = (load(simd, &ring.edge_x, i), load(simd, &ring.edge_y, i));
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
        for i in (0..long).step_by(LANES) {
            let weight = load(simd, &self.weight, i);
            let (xx, xy, yy) =
                (load(simd, along_xx, i + LANES), load(simd, along_xy, i + LANES), load(simd, along_yy, i + LANES));
            store(weight + (xx + load(simd, along_xx, i + LANES - 1)), &mut m.own_xx, i);
            store(xy + load(simd, along_xy, i + LANES - 1), &mut m.own_xy, i);
            store(weight + (yy + load(simd, along_yy, i + LANES - 1)), &mut m.own_yy, i);
            store(-xx, &mut m.next_xx, i);
            store(-xy - turn, &mut m.next_xy, i);
            store(-xy + turn, &mut m.next_yx, i);
            store(-yy, &mut m.next_yy, i);
        }
        for own in [&mut m.own_xx, &mut m.own_xy, &mut m.own_yy] {
            own[n..].fill(0.0);
        }
    }

    /// Phi', the band of Phi'' and the gradient of the area with the ring where it is: what a test compares with differences.
    pub fn derivatives<E: EdgeForce, D: Drag>(
        &mut self,
        ring: &mut Ring,
        effects: &RingEffects<E, D>,
        level: Level,
        parts: Parts,
    ) -> (Field, Stiffness, Field) {
        self.evaluate(ring, effects, level);
        self.assemble(ring, effects, level, parts);
        (self.residual.clone(), self.stiffness.clone(), self.area_gradient.clone())
    }
}

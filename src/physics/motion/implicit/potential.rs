//! The potential that one implicit step minimises, and its derivatives.
//!
//! The displacements d of a step minimise the incremental potential
//!
//! ```text
//! Phi(d) = sum_i (w_i/2) |d_i - d*_i|^2 + U(x + d)
//! ```
//!
//! The time scheme sets the weights `w_i` of inertia and drag and the free displacements `d*`. The gradient is `Phi' =
//! w (d - d*) - F`. The second derivative `w + U''` is a cyclic block-tridiagonal matrix plus `K_a grad a grad a^T`,
//! which is kept apart because it couples all vertices.

use crate::on_instruction_set;
use crate::physics::motion::implicit::field::Field;
use crate::physics::ring::forces::stiffness::{Parts, Stiffness};
use crate::physics::ring::passes::{EdgeArrays, EdgeLaw, RingForces, edge_pass};
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::InstructionSet;
use crate::physics::simd::aligned::Aligned;
use crate::physics::simd::{Instructions, LANES, fma, inverse_sqrt, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

/// Phi and its last evaluated derivatives.
#[derive(Debug)]
pub(super) struct Potential {
    instruction_set: InstructionSet,
    /// Free displacements d*.
    pub(super) free: Field,
    pub(super) weight: Aligned,
    /// Phi'.
    pub(super) gradient: Field,
    pub(super) area_gradient: Field,
    /// `w + U''` without the rank-one term of the area.
    pub(super) stiffness: Stiffness,
    half_pressure: f64,
    /// Second derivatives of the energy of each edge: xx, xy, yy.
    edge_stiffness: [Aligned; 3],
}

impl Potential {
    pub(super) fn new(n: usize, instruction_set: InstructionSet) -> Self {
        let edges = || Aligned::zeros(padded(n) + LANES);
        Self {
            instruction_set,
            free: Field::zero(n),
            weight: Aligned::zeros(padded(n)),
            gradient: Field::zero(n),
            area_gradient: Field::zero(n),
            stiffness: Stiffness::new(n),
            half_pressure: 0.0,
            edge_stiffness: [edges(), edges(), edges()],
        }
    }

    /// Evaluates Phi' and the gradient of the area at the present positions, which `displacement` led to.
    pub(super) fn evaluate(&mut self, displacement: &Field, ring: &mut Ring, effects: &RingEffects) {
        let area = edge_pass(self.instruction_set, ring, effects.edge_law());
        let forces = effects.forces(area, effects.push(ring));
        self.half_pressure = forces.half_pressure;
        match (forces.law.tension.needs_length(), forces.pushed) {
            (false, false) => self.evaluate_on::<false, false>(displacement, ring, &forces),
            (false, true) => self.evaluate_on::<false, true>(displacement, ring, &forces),
            (true, false) => self.evaluate_on::<true, false>(displacement, ring, &forces),
            (true, true) => self.evaluate_on::<true, true>(displacement, ring, &forces),
        }
        self.gradient.still_padding(ring.n);
        self.area_gradient.still_padding(ring.n);
    }

    fn evaluate_on<const LENGTH: bool, const PUSHED: bool>(
        &mut self,
        displacement: &Field,
        ring: &Ring,
        forces: &RingForces,
    ) {
        on_instruction_set!(
            self.instruction_set,
            simd => self.evaluate_with::<_, LENGTH, PUSHED>(simd, displacement, ring, forces)
        );
    }

    #[inline(always)]
    fn evaluate_with<S: Instructions, const LENGTH: bool, const PUSHED: bool>(
        &mut self,
        simd: S,
        displacement: &Field,
        ring: &Ring,
        forces: &RingForces,
    ) {
        let Self { free, gradient, area_gradient, .. } = self;
        let (weight, edges, pushes) = (&self.weight[..], EdgeArrays::of(ring), [&ring.force_x[..], &ring.force_y[..]]);
        let ([x, y], [free_x, free_y]) = (displacement.parts(), free.parts());
        let ([gradient_x, gradient_y], [area_x, area_y]) = (gradient.parts_mut(), area_gradient.parts_mut());
        for i in (0..weight.len()).step_by(LANES) {
            let (fx, fy) = forces.at::<S, LENGTH, PUSHED>(simd, edges, pushes, i);
            let weight = load(simd, weight, i);
            let (off_x, off_y) = (load(simd, x, i) - load(simd, free_x, i), load(simd, y, i) - load(simd, free_y, i));
            store(fma(weight, off_x, -fx), gradient_x, i);
            store(fma(weight, off_y, -fy), gradient_y, i);
            let chord_x = load(simd, edges.x, i + LANES) + load(simd, edges.x, i + LANES - 1);
            let chord_y = load(simd, edges.y, i + LANES) + load(simd, edges.y, i + LANES - 1);
            store(chord_y * 0.5, area_x, i);
            store(chord_x * -0.5, area_y, i);
        }
    }

    /// Fills the matrix `w + U''`, at the positions at which Phi' was last evaluated; if it `stands_in`, with the second
    /// derivatives of each part of the ring as if the rest stood still where others are not known.
    pub(super) fn assemble(&mut self, ring: &Ring, effects: &RingEffects, parts: Parts, stands_in: bool) {
        let law = effects.edge_law();
        on_instruction_set!(self.instruction_set, simd => {
            self.assemble_edges(simd, ring, law, parts);
            self.assemble_vertices(simd, ring.n, parts);
        });
        if effects.walls.acts() {
            effects.walls.add_stiffness(ring, parts, &mut self.stiffness);
        }
        for other in effects.others.iter().filter(|other| other.acts()) {
            other.add_stiffness(ring, parts, &mut self.stiffness);
            if stands_in {
                other.add_own_stiffness(ring, &mut self.stiffness);
            }
        }
        self.stiffness.fold();
    }

    /// Second derivatives of the energy of each edge.
    #[inline(always)]
    fn assemble_edges<S: Instructions>(&mut self, simd: S, ring: &Ring, law: EdgeLaw, parts: Parts) {
        let (n, long, zero) = (ring.n, padded(ring.n), f64x8::splat(simd, 0.0));
        let EdgeLaw { tension, eps_squared } = law;
        let [along_xx, along_xy, along_yy] = self.edge_stiffness.each_mut().map(|edges| &mut edges[..]);
        let edges = EdgeArrays::of(ring);
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
    }

    /// Adds up weights, edges and the pressure: `-p a''` with `d^2 a/(dx_i dy_{i+1}) = 1/2 = -d^2 a/(dy_i dx_{i+1})`.
    #[inline(always)]
    fn assemble_vertices<S: Instructions>(&mut self, simd: S, n: usize, parts: Parts) {
        let [along_xx, along_xy, along_yy] = self.edge_stiffness.each_ref().map(|edges| &edges[..]);
        let turn = if parts == Parts::All { self.half_pressure } else { 0.0 };
        let m = &mut self.stiffness;
        let [own_xx, own_xy, own_yy] = [&mut m.own_xx, &mut m.own_xy, &mut m.own_yy].map(|own| &mut own[..]);
        let next = [&mut m.next_xx, &mut m.next_xy, &mut m.next_yx, &mut m.next_yy];
        let [next_xx, next_xy, next_yx, next_yy] = next.map(|next| &mut next[..]);
        let weights = &self.weight[..];
        for i in (0..padded(n)).step_by(LANES) {
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
}

#[cfg(test)]
mod tests;

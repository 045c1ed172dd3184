//! The passes over a ring that both integrators use, eight vertices at a time.
//!
//! [`edge_pass`] computes edges, tension coefficients and area from the positions, and [`net_forces`] the forces.
//! [`step_pass`] takes a Verlet step and also computes the edges at the *new* positions. While a block is in registers
//! its edges cost two shuffles instead of four loads, and one loop replaces two (linear tension at N_v = 256, AVX-512:
//! 0.64 instead of 0.90 ns per vertex). The last edge of a block needs the next block, so the edges are computed one
//! block later than the positions.
//!
//! Each pass is compiled for every instruction set, and there with and without edge lengths, forces of walls, and
//! separate drag rates of the vertices.

use crate::on_instruction_set;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::{drag::Rates, tension::TensionLaw};
use crate::physics::simd::{InstructionSet, Instructions, LANES, fma, inverse_sqrt, load, max_lanes, store, sum_lanes};
use fearless_simd::{f64x8, prelude::*};

/// The tension of a ring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeLaw {
    pub(crate) tension: TensionLaw,
    /// Square of the smoothing length eps.
    pub(crate) eps_squared: f64,
}

impl EdgeLaw {
    /// `T/l_eps` of eight edges.
    #[inline(always)]
    fn coefficients<S: Instructions>(self, simd: S, ex: f64x8<S>, ey: f64x8<S>) -> f64x8<S> {
        let length_squared = fma(ex, ex, fma(ey, ey, f64x8::splat(simd, self.eps_squared)));
        self.tension.coefficient(simd, inverse_sqrt(simd, length_squared))
    }
}

/// Adds `x_i y_{i+1} - y_i x_{i+1}` of eight edges.
#[inline(always)]
fn add_cross<S: Instructions>(sum: f64x8<S>, x: f64x8<S>, y: f64x8<S>, ex: f64x8<S>, ey: f64x8<S>) -> f64x8<S> {
    fma(x, ey, fma(-y, ex, sum))
}

/// Computes edge vectors and their tension coefficients; returns the area.
pub(crate) fn edge_pass(instruction_set: InstructionSet, ring: &mut Ring, law: EdgeLaw) -> f64 {
    if law.tension.needs_length() {
        on_instruction_set!(instruction_set, simd => edge_pass_with::<_, true>(simd, ring, law))
    } else {
        on_instruction_set!(instruction_set, simd => edge_pass_with::<_, false>(simd, ring, law))
    }
}

#[inline(always)]
fn edge_pass_with<S: Instructions, const LENGTH: bool>(simd: S, ring: &mut Ring, law: EdgeLaw) -> f64 {
    let long = ring.ux.len();
    // Slices of one known length let the compiler drop the bounds checks.
    let (x, y) = (&ring.x[..long + LANES], &ring.y[..long + LANES]);
    let edge_x = &mut ring.edge_x[..long + LANES];
    let edge_y = &mut ring.edge_y[..long + LANES];
    let coefficient = &mut ring.coefficient[..long + LANES];
    let mut cross = f64x8::splat(simd, 0.0);
    let mut i = 0;
    while i + LANES <= long {
        let (x0, y0) = (load(simd, x, i), load(simd, y, i));
        let (ex, ey) = (load(simd, x, i + 1) - x0, load(simd, y, i + 1) - y0);
        cross = add_cross(cross, x0, y0, ex, ey);
        store(ex, edge_x, i + LANES);
        store(ey, edge_y, i + LANES);
        if LENGTH {
            store(law.coefficients(simd, ex, ey), coefficient, i + LANES);
        }
        i += LANES;
    }
    close_seam(ring);
    0.5 * sum_lanes(cross)
}

/// Edge -1 is the last one.
#[inline(always)]
fn close_seam(ring: &mut Ring) {
    for edges in [&mut ring.edge_x, &mut ring.edge_y, &mut ring.coefficient] {
        edges[LANES - 1] = edges[LANES - 1 + ring.n];
    }
}

/// Stores the edges that begin at the block of vertices `here`, and their tension coefficients, at `at`; adds their
/// part of the area to `cross`. The last edge ends at the first vertex of the block `next`.
#[inline(always)]
fn edges_behind<S: Instructions, const LENGTH: bool>(
    simd: S,
    law: EdgeLaw,
    here: (f64x8<S>, f64x8<S>),
    next: (f64x8<S>, f64x8<S>),
    [edge_x, edge_y, coefficient]: [&mut [f64]; 3],
    at: usize,
    cross: f64x8<S>,
) -> f64x8<S> {
    let ex = simd.slide_f64x8::<1>(here.0, next.0) - here.0;
    let ey = simd.slide_f64x8::<1>(here.1, next.1) - here.1;
    store(ex, edge_x, at);
    store(ey, edge_y, at);
    if LENGTH {
        store(law.coefficients(simd, ex, ey), coefficient, at);
    }
    add_cross(cross, here.0, here.1, ex, ey)
}

/// The forces on a ring whose edges are known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RingForces {
    pub(crate) law: EdgeLaw,
    pub(crate) half_pressure: f64,
    pub(crate) weight: f64,
    /// Whether `ring.force_x`, `ring.force_y` hold forces of walls or other forces.
    pub(crate) pushed: bool,
}

#[derive(Clone, Copy)]
pub(crate) struct EdgeArrays<'a> {
    pub(crate) x: &'a [f64],
    pub(crate) y: &'a [f64],
    coefficient: &'a [f64],
}

impl<'a> EdgeArrays<'a> {
    #[inline(always)]
    pub(crate) fn of(ring: &'a Ring) -> Self {
        Self { x: &ring.edge_x, y: &ring.edge_y, coefficient: &ring.coefficient }
    }
}

impl RingForces {
    /// Sum of all forces on the vertices `i..i + 8` except drag.
    #[inline(always)]
    pub(crate) fn at<S: Instructions, const LENGTH: bool, const PUSHED: bool>(
        &self,
        simd: S,
        edges: EdgeArrays<'_>,
        pushes: [&[f64]; 2],
        i: usize,
    ) -> (f64x8<S>, f64x8<S>) {
        let (ex, ey) = (load(simd, edges.x, i + LANES), load(simd, edges.y, i + LANES));
        let (back_x, back_y) = (load(simd, edges.x, i + LANES - 1), load(simd, edges.y, i + LANES - 1));
        let (pull_x, pull_y) = if LENGTH {
            let ahead = load(simd, edges.coefficient, i + LANES);
            let behind = load(simd, edges.coefficient, i + LANES - 1);
            (fma(ahead, ex, -(behind * back_x)), fma(ahead, ey, -(behind * back_y)))
        } else {
            let stiffness = self.law.tension.per_length;
            ((ex - back_x) * stiffness, (ey - back_y) * stiffness)
        };
        let half_pressure = f64x8::splat(simd, self.half_pressure);
        let mut fx = fma(ey + back_y, half_pressure, pull_x + self.weight);
        let mut fy = fma(ex + back_x, -half_pressure, pull_y);
        if PUSHED {
            fx += load(simd, pushes[0], i);
            fy += load(simd, pushes[1], i);
        }
        (fx, fy)
    }
}

/// Stores the force on each vertex, without drag.
pub(crate) fn net_forces(
    instruction_set: InstructionSet,
    ring: &Ring,
    forces: &RingForces,
    fx: &mut [f64],
    fy: &mut [f64],
) {
    if forces.law.tension.needs_length() {
        on_instruction_set!(instruction_set, simd => net_forces_with::<_, true>(simd, ring, forces, fx, fy));
    } else {
        on_instruction_set!(instruction_set, simd => net_forces_with::<_, false>(simd, ring, forces, fx, fy));
    }
}

#[inline(always)]
fn net_forces_with<S: Instructions, const LENGTH: bool>(
    simd: S,
    ring: &Ring,
    forces: &RingForces,
    fx: &mut [f64],
    fy: &mut [f64],
) {
    let (edges, pushes) = (EdgeArrays::of(ring), [&ring.force_x[..], &ring.force_y[..]]);
    for i in (0..ring.ux.len()).step_by(LANES) {
        let (x, y) = if forces.pushed {
            forces.at::<S, LENGTH, true>(simd, edges, pushes, i)
        } else {
            forces.at::<S, LENGTH, false>(simd, edges, pushes, i)
        };
        store(x, fx, i);
        store(y, fy, i);
    }
}

/// Takes a Verlet step of `dt`: new half-step velocities and positions, and the edges and tension coefficients at these
/// positions. Before it the edges must be up to date. Returns the new area and the largest squared speed.
#[inline]
pub(crate) fn step_pass(
    instruction_set: InstructionSet,
    ring: &mut Ring,
    forces: &RingForces,
    drag: Rates<'_>,
    dt: f64,
) -> (f64, f64) {
    match (forces.law.tension.needs_length(), forces.pushed) {
        (false, false) => step_on::<false, false>(instruction_set, ring, forces, drag, dt),
        (false, true) => step_on::<false, true>(instruction_set, ring, forces, drag, dt),
        (true, false) => step_on::<true, false>(instruction_set, ring, forces, drag, dt),
        (true, true) => step_on::<true, true>(instruction_set, ring, forces, drag, dt),
    }
}

#[inline(never)]
fn step_on<const LENGTH: bool, const PUSHED: bool>(
    instruction_set: InstructionSet,
    ring: &mut Ring,
    forces: &RingForces,
    drag: Rates<'_>,
    dt: f64,
) -> (f64, f64) {
    match drag {
        Rates::Even(rate) => on_instruction_set!(instruction_set, simd => {
            step_with::<_, LENGTH, PUSHED, true>(simd, ring, forces, rate, &[], dt)
        }),
        Rates::Each(rates) => on_instruction_set!(instruction_set, simd => {
            step_with::<_, LENGTH, PUSHED, false>(simd, ring, forces, 0.0, rates, dt)
        }),
    }
}

#[inline(always)]
fn step_with<S: Instructions, const LENGTH: bool, const PUSHED: bool, const EVEN: bool>(
    simd: S,
    ring: &mut Ring,
    forces: &RingForces,
    rate: f64,
    rates: &[f64],
    dt: f64,
) -> (f64, f64) {
    let (n, long, law) = (ring.n, ring.ux.len(), forces.law);
    let (half_dt, kick) = (0.5 * dt, dt / ring.vertex_mass());
    let dt = f64x8::splat(simd, dt);
    let (xs, ys) = (&mut ring.x[..long + LANES], &mut ring.y[..long + LANES]);
    let (uxs, uys) = (&mut ring.ux[..long], &mut ring.uy[..long]);
    let edge_x = &mut ring.edge_x[..long + LANES];
    let edge_y = &mut ring.edge_y[..long + LANES];
    let coefficient = &mut ring.coefficient[..long + LANES];
    let pushes = [&ring.force_x[..long + LANES], &ring.force_y[..long + LANES]];
    let rates = if EVEN { rates } else { &rates[..long] };
    let zero = f64x8::splat(simd, 0.0);
    let (mut cross, mut fastest, mut last) = (zero, zero, 0.0);
    let (mut x_before, mut y_before) = (zero, zero);
    let mut i = 0;
    while i + LANES <= long {
        let edges = EdgeArrays { x: edge_x, y: edge_y, coefficient };
        let (fx, fy) = forces.at::<S, LENGTH, PUSHED>(simd, edges, pushes, i);
        let rate = if EVEN { f64x8::splat(simd, rate) } else { load(simd, rates, i) };
        let damping = rate * half_dt;
        let share = 1.0 / (1.0 + damping);
        let (keep, gain) = ((1.0 - damping) * share, share * kick);
        let ux = fma(fx, gain, load(simd, uxs, i) * keep);
        let uy = fma(fy, gain, load(simd, uys, i) * keep);
        store(ux, uxs, i);
        store(uy, uys, i);
        let speed_squared = fma(ux, ux, uy * uy);
        if i + LANES <= n {
            fastest = fastest.max(speed_squared);
        } else {
            last = speed_squared.as_slice()[..n - i].iter().fold(0.0, |a: f64, &b| a.max(b));
        }
        let (x, y) = (fma(ux, dt, load(simd, xs, i)), fma(uy, dt, load(simd, ys, i)));
        store(x, xs, i);
        store(y, ys, i);
        if i > 0 {
            // The old edges there are no longer needed: this block was the last to read them.
            let arrays = [&mut *edge_x, &mut *edge_y, &mut *coefficient];
            cross = edges_behind::<S, LENGTH>(simd, law, (x_before, y_before), (x, y), arrays, i, cross);
        }
        (x_before, y_before) = (x, y);
        i += LANES;
    }
    ring.close();
    let first = (f64x8::splat(simd, ring.x[0]), f64x8::splat(simd, ring.y[0]));
    let arrays = [&mut *ring.edge_x, &mut *ring.edge_y, &mut *ring.coefficient];
    let here = (load(simd, &ring.x, long - LANES), load(simd, &ring.y, long - LANES));
    cross = edges_behind::<S, LENGTH>(simd, law, here, first, arrays, long, cross);
    close_seam(ring);
    (0.5 * sum_lanes(cross), max_lanes(fastest).max(last))
}

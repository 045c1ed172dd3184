//! The passes over a ring that its integrators share, eight vertices at a time.
//!
//! [`edge_pass`] makes edges, tension coefficients and area from positions. [`step_pass`] takes a Verlet step and leaves the edges of
//! the *new* positions behind: while a block is still in registers its edges cost two shuffles instead of four loads, and one loop
//! does what two did (linear tension at N_v = 256, AVX-512: 0.64 instead of 0.90 ns a vertex). The block after is needed for the
//! last edge of a block, so edges follow one block behind.

use super::verlet::RingEffects;
use crate::droplet::deformable::Ring;
use crate::effects::{Drag, EdgeForce, TensionLaw};
use crate::vector::{LANES, fma, inverse_sqrt, load, max_lanes, store, sum_lanes};
use fearless_simd::{f64x8, prelude::*};

/// `T/l_eps` of eight edges.
#[inline(always)]
fn coefficients<S: Simd>(simd: S, law: TensionLaw, eps_squared: f64, ex: f64x8<S>, ey: f64x8<S>) -> f64x8<S> {
    let length_squared = fma(ex, ex, fma(ey, ey, f64x8::splat(simd, eps_squared)));
    law.coefficient(simd, inverse_sqrt(simd, length_squared))
}

/// Adds `x_i y_{i+1} - y_i x_{i+1}` of eight edges.
#[inline(always)]
fn add_cross<S: Simd>(sum: f64x8<S>, x: f64x8<S>, y: f64x8<S>, ex: f64x8<S>, ey: f64x8<S>) -> f64x8<S> {
    fma(x, ey, fma(-y, ex, sum))
}

/// Edge vectors and their tension coefficients; returns the area.
#[inline(always)]
pub fn edge_pass<S: Simd, E: EdgeForce>(simd: S, ring: &mut Ring, edge: E, eps_squared: f64) -> f64 {
    let (n, long, law) = (ring.n, ring.ux.len(), edge.law());
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
        if E::NEEDS_LENGTH {
            store(coefficients(simd, law, eps_squared, ex, ey), coefficient, i + LANES);
        }
        i += LANES;
    }
    for edges in [edge_x, edge_y, coefficient] {
        edges[LANES - 1] = edges[LANES - 1 + n];
    }
    0.5 * sum_lanes(cross)
}

/// The forces that act on all vertices alike.
#[derive(Clone, Copy)]
pub struct Push {
    /// Half the pressure of the area.
    half_pressure: f64,
    /// Weight of a vertex.
    weight: f64,
    /// Tension over length of every edge; read only where it does not depend on the length.
    per_length: f64,
}

impl Push {
    /// At this half pressure.
    pub fn of<E: EdgeForce, D>(effects: &RingEffects<E, D>, half_pressure: f64) -> Self {
        Self { half_pressure, weight: effects.gravity.force(), per_length: effects.edge.law().per_length }
    }

    /// Sum of all forces but drag on the vertices `i..i + 8`.
    #[inline(always)]
    pub fn on<S: Simd, E: EdgeForce, const PUSHED: bool>(
        self,
        simd: S,
        ring: &Ring,
        i: usize,
    ) -> (f64x8<S>, f64x8<S>) {
        let arrays = Edges { x: &ring.edge_x, y: &ring.edge_y, coefficient: &ring.coefficient };
        self.at::<S, E, PUSHED>(simd, arrays, [&ring.force_x, &ring.force_y], i)
    }

    #[inline(always)]
    fn at<S: Simd, E: EdgeForce, const PUSHED: bool>(
        self,
        simd: S,
        edges: Edges<'_>,
        pushes: [&[f64]; 2],
        i: usize,
    ) -> (f64x8<S>, f64x8<S>) {
        let (ex, ey) = (load(simd, edges.x, i + LANES), load(simd, edges.y, i + LANES));
        let (back_x, back_y) = (load(simd, edges.x, i + LANES - 1), load(simd, edges.y, i + LANES - 1));
        let (pull_x, pull_y) = if E::NEEDS_LENGTH {
            let ahead = load(simd, edges.coefficient, i + LANES);
            let behind = load(simd, edges.coefficient, i + LANES - 1);
            (fma(ahead, ex, -(behind * back_x)), fma(ahead, ey, -(behind * back_y)))
        } else {
            ((ex - back_x) * self.per_length, (ey - back_y) * self.per_length)
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

/// The edge arrays of a ring.
#[derive(Clone, Copy)]
struct Edges<'a> {
    x: &'a [f64],
    y: &'a [f64],
    coefficient: &'a [f64],
}

/// A step of `dt`: new half-step velocities and positions, and the edges and tension coefficients there.
/// Needs the edges of the old positions, and their `area`. Returns the area and the largest squared speed.
#[inline(always)]
pub fn step_pass<S: Simd, E: EdgeForce, D: Drag, const PUSHED: bool>(
    simd: S,
    ring: &mut Ring,
    effects: &RingEffects<E, D>,
    area: f64,
    dt: f64,
) -> (f64, f64) {
    let (n, long, law, eps_squared) = (ring.n, ring.ux.len(), effects.edge.law(), effects.eps_squared);
    let push = Push::of(effects, 0.5 * effects.area.pressure(area));
    let (half_dt, kick) = (0.5 * dt, dt / ring.vertex_mass());
    let dt = f64x8::splat(simd, dt);
    let (xs, ys) = (&mut ring.x[..long + LANES], &mut ring.y[..long + LANES]);
    let (uxs, uys) = (&mut ring.ux[..long], &mut ring.uy[..long]);
    let edge_x = &mut ring.edge_x[..long + LANES];
    let edge_y = &mut ring.edge_y[..long + LANES];
    let coefficient = &mut ring.coefficient[..long + LANES];
    let pushes = [&ring.force_x[..long + LANES], &ring.force_y[..long + LANES]];
    let zero = f64x8::splat(simd, 0.0);
    let (mut cross, mut fastest, mut last) = (zero, zero, 0.0);
    let (mut x_before, mut y_before) = (zero, zero);
    let mut i = 0;
    while i + LANES <= long {
        let edges = Edges { x: edge_x, y: edge_y, coefficient };
        let (fx, fy) = push.at::<S, E, PUSHED>(simd, edges, pushes, i);
        let damping = effects.drag.rate(simd, i) * half_dt;
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
            let ahead = (simd.slide_f64x8::<1>(x_before, x), simd.slide_f64x8::<1>(y_before, y));
            let (ex, ey) = (ahead.0 - x_before, ahead.1 - y_before);
            cross = add_cross(cross, x_before, y_before, ex, ey);
            // These places are not read any more: the block after has taken its edge behind from the last of them.
            store(ex, edge_x, i);
            store(ey, edge_y, i);
            if E::NEEDS_LENGTH {
                store(coefficients(simd, law, eps_squared, ex, ey), coefficient, i);
            }
        }
        (x_before, y_before) = (x, y);
        i += LANES;
    }
    ring.close();
    let (xs, ys) = (&ring.x[..long + LANES], &ring.y[..long + LANES]);
    let (x, y) = (load(simd, xs, long - LANES), load(simd, ys, long - LANES));
    let (first_x, first_y) = (f64x8::splat(simd, xs[0]), f64x8::splat(simd, ys[0]));
    let (ex, ey) = (simd.slide_f64x8::<1>(x, first_x) - x, simd.slide_f64x8::<1>(y, first_y) - y);
    cross = add_cross(cross, x, y, ex, ey);
    store(ex, &mut ring.edge_x, long);
    store(ey, &mut ring.edge_y, long);
    if E::NEEDS_LENGTH {
        store(coefficients(simd, law, eps_squared, ex, ey), &mut ring.coefficient, long);
    }
    for edges in [&mut ring.edge_x, &mut ring.edge_y, &mut ring.coefficient] {
        edges[LANES - 1] = edges[LANES - 1 + n];
    }
    (0.5 * sum_lanes(cross), max_lanes(fastest).max(last))
}

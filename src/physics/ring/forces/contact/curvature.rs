//! Second derivatives of the energy `(k_w/2) o^2` of an overlap o: `k_w (do do + o d^2 o)`. Here `do = -n.w`, where
//! `w = (1 - q) da + q db` is the displacement of the material point that touches.
//!
//! If a vertex touches, the normal turns as it moves: `d^2 o = -c (t.w)^2`, with c the curvature and t perpendicular to
//! n. If an inner point of an edge e touches, it also moves along the edge, to the minimum over q of
//! `d(q) + beta (q - 1/2)^2`:
//!
//! ```text
//! d^2 o = -c (t.w)^2 + g [n.de + c (t.e) (t.w)]^2,     g = 1/[c (t.e)^2 + 2 beta]
//! ```
//!
//! A disc has beta = 0, a face has c = 0.

use crate::physics::ring::forces::stiffness::EdgeBlocks;
use crate::physics::walls::wall::{Edges, Touch};
use fearless_simd::{f64x8, prelude::*};

/// The blocks of eight edges that touch with stiffness `k_w`, where the normal turns by `curvature`.
#[inline(always)]
pub(super) fn second_derivatives<S: Simd>(
    simd: S,
    edges: Edges<S>,
    touch: Touch<S>,
    k_w: f64x8<S>,
    curvature: f64x8<S>,
    beta: f64,
) -> EdgeBlocks<S> {
    let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
    let Touch { q, overlap, nx, ny } = touch;
    // An edge that is held pulls, but it does not slide as an edge that is pushed.
    let stiffness = overlap.simd_eq(zero).select(zero, k_w);
    let push = stiffness * overlap.max(zero);
    let p = one - q;
    // t.e, and the second derivative in q.
    let along = nx * edges.ey - ny * edges.ex;
    let hold = curvature * along * along + 2.0 * beta;
    let inside = (p * q * hold).simd_gt(zero);
    let g = inside.select(one / hold.max(f64x8::splat(simd, 1e-300)), zero);
    let widen = push * g;
    let slide = push * curvature * (one - curvature * along * along * g);
    // No closures here: code that may not be inlined is compiled without vector instructions.
    let (nxx, nxy, nyy) = (nx * nx, nx * ny, ny * ny);
    let (m0, m1, m2) = (stiffness * nxx - slide * nyy, stiffness * nxy + slide * nxy, stiffness * nyy - slide * nxx);
    let (e0, e1, e2) = (widen * nxx, widen * nxy, widen * nyy);
    // The mixed part, n t^T by rows, and its symmetric sum for the diagonal blocks.
    let mixed = widen * curvature * along;
    let (txx, txy, tyx, tyy) = (-(mixed * nxy), mixed * nxx, -(mixed * nyy), mixed * nxy);
    let (sum_xx, sum_xy, sum_yy) = (txx + txx, txy + tyx, tyy + tyy);
    let (pp, qq, shared) = (p * p, q * q, p * q);
    EdgeBlocks {
        first: [pp * m0 - p * sum_xx + e0, pp * m1 - p * sum_xy + e1, pp * m2 - p * sum_yy + e2],
        between: [
            shared * m0 - q * txx + p * txx - e0,
            shared * m1 - q * txy + p * tyx - e1,
            shared * m1 - q * tyx + p * txy - e1,
            shared * m2 - q * tyy + p * tyy - e2,
        ],
        second: [qq * m0 + q * sum_xx + e0, qq * m1 + q * sum_xy + e1, qq * m2 + q * sum_yy + e2],
    }
}

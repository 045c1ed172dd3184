//! A flat wall across the droplet's way at `x = 0`, on which it comes to rest ([C24] Fig. 7b).
//!
//! The distance of a point at x from the half-plane beyond x0 is `x0 - x`. Along an edge it is linear in q, so the
//! nearest point is an end of the edge. With the term in beta ([`wall`](crate::physics::walls::wall)) it lies at
//! `q = 1/2 + e_x/(2 beta)`, clamped to [0, 1].

use crate::physics::walls::wall::{Edges, FACE_BETA, Obstacle, Touch, Walls};
use fearless_simd::{f64x8, prelude::*};

/// The plate, `x >= 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate;

impl Walls for Plate {
    type Obstacle = HalfPlane;

    fn surface(&self) -> f64 {
        0.0
    }

    fn for_each_near(&self, origin: [f64; 2], _: [f64; 4], mut visit: impl FnMut(HalfPlane)) {
        visit(HalfPlane { x: -origin[0] });
    }
}

/// Everything beyond `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfPlane {
    x: f64,
}

impl Obstacle for HalfPlane {
    const BETA: f64 = FACE_BETA;

    fn id(&self) -> u32 {
        0
    }

    #[inline(always)]
    fn distance<S: Simd>(&self, simd: S, edges: Edges<S>) -> f64x8<S> {
        self.x - edges.x - edges.ex.max(f64x8::splat(simd, 0.0))
    }

    #[inline(always)]
    fn distance_to<S: Simd>(&self, _: S, x: f64x8<S>, _: f64x8<S>) -> f64x8<S> {
        self.x - x
    }

    #[inline(always)]
    fn touch<S: Simd>(&self, simd: S, edges: Edges<S>, reach: f64) -> Option<Touch<S>> {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let q = (0.5 + edges.ex * (0.5 / FACE_BETA)).max(zero).min(one);
        let distance = self.x - edges.x - q * edges.ex + FACE_BETA * (q - 0.5) * (q - 0.5);
        let overlap = (reach - distance).max(zero);
        overlap.simd_gt(zero).any_true().then_some(Touch { q, overlap, nx: -one, ny: zero })
    }

    fn touch_point(&self, x: f64, _: f64, reach: f64) -> Option<(f64, [f64; 2])> {
        let overlap = reach - (self.x - x);
        (overlap > 0.0).then_some((overlap, [-1.0, 0.0]))
    }

    #[inline(always)]
    fn curvature<S: Simd>(&self, simd: S, _: f64x8<S>, _: f64x8<S>) -> f64x8<S> {
        f64x8::splat(simd, 0.0)
    }

    fn corner(&self) -> Option<[f64; 2]> {
        None
    }

    fn inner_point(&self) -> Option<[f64; 2]> {
        None
    }
}

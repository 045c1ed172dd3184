//! A disc. Its skeleton is its centre c, and its surface lies at its radius.
//!
//! The nearest point of an edge, which begins at p and has the vector e, lies at `q = -(p - c).e/e^2`, clamped to
//! [0, 1]. Distance and normal are length and direction of `p + q e - c`; the curvature is the inverse distance.

use crate::physics::walls::wall::{Edges, Obstacle, Touch};
use fearless_simd::{f64x8, prelude::*};

/// A disc near a droplet, in local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its number in its array.
    pub id: u32,
    /// x of its centre.
    pub x: f64,
    /// y of its centre.
    pub y: f64,
}

impl Obstacle for Disc {
    const BETA: f64 = 0.0;

    fn id(&self) -> u32 {
        self.id
    }

    #[inline(always)]
    fn distance<S: Simd>(&self, simd: S, edges: Edges<S>) -> f64x8<S> {
        let [_, px, py] = self.nearest(simd, edges);
        (px * px + py * py).sqrt()
    }

    #[inline(always)]
    fn distance_to<S: Simd>(&self, _: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let (rx, ry) = (x - self.x, y - self.y);
        (rx * rx + ry * ry).sqrt()
    }

    #[inline(always)]
    fn touch<S: Simd>(&self, simd: S, edges: Edges<S>, reach: f64) -> Option<Touch<S>> {
        let [q, px, py] = self.nearest(simd, edges);
        let squared = px * px + py * py;
        if !squared.simd_lt(f64x8::splat(simd, reach * reach)).any_true() {
            return None;
        }
        let distance = squared.max(f64x8::splat(simd, 1e-300)).sqrt();
        let overlap = (reach - distance).max(f64x8::splat(simd, 0.0));
        let inverse = 1.0 / distance;
        Some(Touch { q, overlap, nx: px * inverse, ny: py * inverse })
    }

    #[inline(always)]
    fn touch_point(&self, x: f64, y: f64, reach: f64) -> Option<(f64, [f64; 2])> {
        let (dx, dy) = (x - self.x, y - self.y);
        let squared = dx * dx + dy * dy;
        (squared < reach * reach).then(|| {
            let squared = squared.max(1e-300);
            let distance = squared.sqrt();
            (reach - distance, [dx / distance, dy / distance])
        })
    }

    /// Adds `k (R/d - 1) r`, where R is the reach, and r is the vector from the centre to the point, of length d.
    ///
    /// The time of a step of a soft particle is mostly that of `1/d`. So `1/d` is computed without root or division
    /// from its value y in the step before: `y (1 + e/2 + 3e^2/8 + 5e^3/16 + 35e^4/128)` with `e = 1 - d^2 y^2`. The
    /// series is used for `|e| < 5e-4`, where its error `63e^5/256` is below 1e-17.
    #[inline(always)]
    fn push_point(&self, at: [f64; 2], reach: f64, stiffness: f64, memory: &mut f64, force: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (at[0] - self.x, at[1] - self.y);
        let squared = dx.mul_add(dx, dy * dy);
        if squared >= reach * reach {
            return force;
        }
        let before = *memory;
        let e = (-squared).mul_add(before * before, 1.0);
        let inverse = if e.abs() < 5e-4 {
            let tail = e.mul_add(0.2734375, 0.3125);
            (before * e).mul_add((e * e).mul_add(tail, e.mul_add(0.375, 0.5)), before)
        } else {
            1.0 / squared.max(1e-300).sqrt()
        };
        *memory = inverse;
        let push = (stiffness * reach).mul_add(inverse, -stiffness);
        [push.mul_add(dx, force[0]), push.mul_add(dy, force[1])]
    }

    #[inline(always)]
    fn curvature<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let (rx, ry) = (x - self.x, y - self.y);
        1.0 / (rx * rx + ry * ry).max(f64x8::splat(simd, 1e-300)).sqrt()
    }

    fn corner(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }

    fn inner_point(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }
}

impl Disc {
    /// The place q of the nearest point on each edge, and that point relative to the centre.
    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, edges: Edges<S>) -> [f64x8<S>; 3] {
        let Edges { x, y, ex, ey } = edges;
        let (rx, ry) = (x - self.x, y - self.y);
        let length_squared = (ex * ex + ey * ey).max(f64x8::splat(simd, 1e-300));
        let q = -(rx * ex + ry * ey) / length_squared;
        let q = q.max(f64x8::splat(simd, 0.0)).min(f64x8::splat(simd, 1.0));
        [q, rx + q * ex, ry + q * ey]
    }
}

//! The solutions for both right sides, b and g, and the term of rank one that combines them.

use crate::physics::motion::implicit::cyclic::block::Block;
use crate::physics::simd::{Instructions, LANES, aligned::Aligned, fma, load, store, sum_lanes};
use fearless_simd::{f64x8, prelude::*};

/// By vertex: the x and y of the solution for b are `xx` and `yx`, those for g are `xy` and `yy`.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub(super) xx: Aligned,
    pub(super) xy: Aligned,
    pub(super) yx: Aligned,
    pub(super) yy: Aligned,
}

impl Solution {
    pub(super) fn new(n: usize) -> Self {
        let zeros = || Aligned::zeros(n);
        Self { xx: zeros(), xy: zeros(), yx: zeros(), yy: zeros() }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, vertex: usize, block: Block<f64>) {
        self.xx[vertex] = block.xx;
        self.xy[vertex] = block.xy;
        self.yx[vertex] = block.yx;
        self.yy[vertex] = block.yy;
    }

    /// Writes the solution with the term of rank one into `b`; returns `1 + k g z`.
    #[inline(always)]
    pub(super) fn combine<S: Instructions>(
        &self,
        simd: S,
        n: usize,
        k: f64,
        g: [&[f64]; 2],
        b: [&mut [f64]; 2],
    ) -> f64 {
        let [bx, by] = b;
        let zero = f64x8::splat(simd, 0.0);
        let (mut along, mut own) = (zero, zero);
        let whole = n / LANES * LANES;
        for i in (0..whole).step_by(LANES) {
            let (gx, gy) = (load(simd, g[0], i), load(simd, g[1], i));
            along = fma(gx, load(simd, &self.xx, i), fma(gy, load(simd, &self.yx, i), along));
            own = fma(gx, load(simd, &self.xy, i), fma(gy, load(simd, &self.yy, i), own));
        }
        let (mut along, mut own) = (sum_lanes(along), sum_lanes(own));
        for i in whole..n {
            along += g[0][i] * self.xx[i] + g[1][i] * self.yx[i];
            own += g[0][i] * self.xy[i] + g[1][i] * self.yy[i];
        }
        let share = k * along / (1.0 + k * own);
        for i in (0..whole).step_by(LANES) {
            store(load(simd, &self.xx, i) - load(simd, &self.xy, i) * share, bx, i);
            store(load(simd, &self.yx, i) - load(simd, &self.yy, i) * share, by, i);
        }
        for i in whole..n {
            bx[i] = self.xx[i] - share * self.xy[i];
            by[i] = self.yx[i] - share * self.yy[i];
        }
        1.0 + k * own
    }
}

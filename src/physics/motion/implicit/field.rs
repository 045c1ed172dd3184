//! A vector at each vertex of a ring, such as a displacement or a gradient.

use crate::on_instruction_set;
use crate::physics::simd::InstructionSet;
use crate::physics::simd::aligned::Aligned;
use crate::physics::simd::{Instructions, LANES, fma, load, max_lanes, padded, store, sum_lanes};
use fearless_simd::{f64x8, prelude::*};
use serde::{Deserialize, Serialize};

/// The components of the vectors, each `padded(n)` long, with zeros in the padding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Field {
    pub(super) x: Aligned,
    pub(super) y: Aligned,
}

impl Field {
    pub(super) fn zero(n: usize) -> Self {
        Self { x: Aligned::zeros(padded(n)), y: Aligned::zeros(padded(n)) }
    }

    #[inline(always)]
    pub(super) fn parts(&self) -> [&[f64]; 2] {
        [&self.x, &self.y]
    }

    #[inline(always)]
    pub(super) fn parts_mut(&mut self) -> [&mut [f64]; 2] {
        [&mut self.x, &mut self.y]
    }

    /// Length of the longest vector; not finite if a component is not.
    pub(super) fn largest(&self, instruction_set: InstructionSet) -> f64 {
        on_instruction_set!(instruction_set, simd => self.largest_with(simd))
    }

    #[inline(always)]
    fn largest_with<S: Simd>(&self, simd: S) -> f64 {
        let zero = f64x8::splat(simd, 0.0);
        let (mut largest, mut odd) = (zero, zero);
        let [x, y] = self.parts();
        for i in (0..x.len()).step_by(LANES) {
            let (x, y) = (load(simd, x, i), load(simd, y, i));
            let squared = x * x + y * y;
            largest = squared.simd_gt(largest).select(squared, largest);
            // Zero only for finite numbers, because a NaN must not pass for small.
            odd += squared * 0.0;
        }
        max_lanes(largest).sqrt() + sum_lanes(odd)
    }

    /// Sum of the squared differences from `other`, over vertices.
    #[inline(always)]
    pub(super) fn squared_distance<S: Instructions>(&self, simd: S, other: &Self) -> f64 {
        let mut sum = f64x8::splat(simd, 0.0);
        for (own, other) in self.parts().into_iter().zip(other.parts()) {
            for i in (0..own.len()).step_by(LANES) {
                let off = load(simd, own, i) - load(simd, other, i);
                sum = fma(off, off, sum);
            }
        }
        sum_lanes(sum)
    }

    #[inline(always)]
    pub(super) fn add<S: Instructions>(&mut self, simd: S, share: f64, by: &Self) {
        let share = f64x8::splat(simd, share);
        for (to, by) in self.parts_mut().into_iter().zip(by.parts()) {
            for i in (0..by.len()).step_by(LANES) {
                store(fma(load(simd, by, i), share, load(simd, to, i)), to, i);
            }
        }
    }

    /// Scalar product with `other`, summed over vertices.
    #[inline(always)]
    pub(super) fn dot<S: Instructions>(&self, simd: S, other: &Self) -> f64 {
        let mut sum = f64x8::splat(simd, 0.0);
        let ([x, y], [other_x, other_y]) = (self.parts(), other.parts());
        for i in (0..x.len()).step_by(LANES) {
            sum = fma(load(simd, x, i), load(simd, other_x, i), sum);
            sum = fma(load(simd, y, i), load(simd, other_y, i), sum);
        }
        sum_lanes(sum)
    }

    /// Sets the padding of `n` vertices to zero.
    pub(super) fn still_padding(&mut self, n: usize) {
        self.x[n..].fill(0.0);
        self.y[n..].fill(0.0);
    }
}

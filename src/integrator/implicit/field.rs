//! Vectors of all vertices of a ring.

use crate::on_level;
use crate::vector::aligned::Aligned;
use crate::vector::{LANES, load, max_lanes, padded, sum_lanes};
use fearless_simd::{Level, f64x8, prelude::*};
use serde::{Deserialize, Serialize};

/// Vectors of x and y for each vertex, zero in the padding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// x components, `padded(n)` long.
    pub x: Aligned,
    /// y components, likewise.
    pub y: Aligned,
}

impl Field {
    /// Zeros for `n` vertices.
    pub fn zero(n: usize) -> Self {
        Self { x: Aligned::zeros(padded(n)), y: Aligned::zeros(padded(n)) }
    }

    /// Largest length of a vector; not finite if one of them is not.
    pub fn largest(&self, level: Level) -> f64 {
        on_level!(level, simd => self.largest_with(simd))
    }

    #[inline(always)]
    fn largest_with<S: Simd>(&self, simd: S) -> f64 {
        let zero = f64x8::splat(simd, 0.0);
        let (mut largest, mut odd) = (zero, zero);
        for i in (0..self.x.len()).step_by(LANES) {
            let (x, y) = (load(simd, &self.x, i), load(simd, &self.y, i));
            let squared = x * x + y * y;
            largest = squared.simd_gt(largest).select(squared, largest);
            // Zero for a number, and for nothing else: a NaN must not pass for small.
            odd += squared * 0.0;
        }
        max_lanes(largest).sqrt() + sum_lanes(odd)
    }

    /// Sets the padding of `n` vertices to zero.
    pub fn still_padding(&mut self, n: usize) {
        self.x[n..].fill(0.0);
        self.y[n..].fill(0.0);
    }
}

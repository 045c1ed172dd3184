//! Blocks of 2 x 2 numbers, for one chain or for eight at once.

use crate::physics::simd::{Instructions, fma};
use fearless_simd::{f64x8, prelude::*};
use std::ops::{Add, Mul, Neg, Sub};

pub(super) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    fn inverse(self) -> Self;
    /// `x b + c`; for eight numbers it is rounded only once.
    fn times(self, b: Self, c: Self) -> Self;
    /// How many negative eigenvalues symmetric blocks have, all lanes together, with `first` in the corner and this
    /// determinant. What is not a number counts as negative.
    fn negative(first: Self, determinant: Self) -> usize;
}

impl Number for f64 {
    #[inline(always)]
    fn inverse(self) -> Self {
        1.0 / self
    }

    // Not `mul_add`, which is a slow call on machines without the instruction.
    #[inline(always)]
    fn times(self, b: Self, c: Self) -> Self {
        self * b + c
    }

    #[inline(always)]
    fn negative(first: Self, determinant: Self) -> usize {
        match (determinant > 0.0, first > 0.0) {
            (true, true) => 0,
            (true, false) => 2,
            (false, _) => 1,
        }
    }
}

impl<S: Instructions> Number for f64x8<S> {
    #[inline(always)]
    fn inverse(self) -> Self {
        1.0 / self
    }

    #[inline(always)]
    fn times(self, b: Self, c: Self) -> Self {
        fma(self, b, c)
    }

    #[inline(always)]
    fn negative(first: Self, determinant: Self) -> usize {
        if first.simd_gt(0.0).all_true() && determinant.simd_gt(0.0).all_true() {
            return 0;
        }
        first.as_slice().iter().zip(determinant.as_slice()).map(|(first, of)| f64::negative(*first, *of)).sum()
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Block<T> {
    pub(super) xx: T,
    pub(super) xy: T,
    pub(super) yx: T,
    pub(super) yy: T,
}

impl<T: Number> Block<T> {
    #[inline(always)]
    pub(super) fn transposed(self) -> Self {
        Self { xy: self.yx, yx: self.xy, ..self }
    }

    /// `self - a b`.
    #[inline(always)]
    pub(super) fn less(self, a: Self, b: Self) -> Self {
        let a = -a;
        Self {
            xx: a.xx.times(b.xx, a.xy.times(b.yx, self.xx)),
            xy: a.xx.times(b.xy, a.xy.times(b.yy, self.xy)),
            yx: a.yx.times(b.xx, a.yy.times(b.yx, self.yx)),
            yy: a.yx.times(b.xy, a.yy.times(b.yy, self.yy)),
        }
    }
}

impl<T: Number> Mul for Block<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self {
            xx: self.xx.times(b.xx, self.xy * b.yx),
            xy: self.xx.times(b.xy, self.xy * b.yy),
            yx: self.yx.times(b.xx, self.yy * b.yx),
            yy: self.yx.times(b.xy, self.yy * b.yy),
        }
    }
}

impl<T: Number> Add for Block<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { xx: self.xx + b.xx, xy: self.xy + b.xy, yx: self.yx + b.yx, yy: self.yy + b.yy }
    }
}

impl<T: Number> Sub for Block<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self { xx: self.xx - b.xx, xy: self.xy - b.xy, yx: self.yx - b.yx, yy: self.yy - b.yy }
    }
}

impl<T: Number> Neg for Block<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { xx: -self.xx, xy: -self.xy, yx: -self.yx, yy: -self.yy }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pivot<T> {
    pub(super) xx: T,
    pub(super) xy: T,
    pub(super) yy: T,
}

impl<T: Number> Pivot<T> {
    /// `self - a b` for a symmetric product.
    #[inline(always)]
    pub(super) fn less(self, a: Block<T>, b: Block<T>) -> Self {
        let a = -a;
        Self {
            xx: a.xx.times(b.xx, a.xy.times(b.yx, self.xx)),
            xy: a.xx.times(b.xy, a.xy.times(b.yy, self.xy)),
            yy: a.yx.times(b.xy, a.yy.times(b.yy, self.yy)),
        }
    }

    /// The inverse, and how many eigenvalues are negative.
    #[inline(always)]
    pub(super) fn inverse(self) -> (Block<T>, usize) {
        let determinant = self.xx.times(self.yy, -(self.xy * self.xy));
        let scale = determinant.inverse();
        let off = -(self.xy * scale);
        let inverse = Block { xx: self.yy * scale, xy: off, yx: off, yy: self.xx * scale };
        (inverse, T::negative(self.xx, determinant))
    }
}

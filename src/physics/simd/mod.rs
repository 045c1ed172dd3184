//! Vectors of eight numbers: the few operations that the kernels share.
//!
//! Every kernel is generic over the instruction set `S` and works on [`f64x8`], whatever the width of the hardware: one
//! AVX-512 register, two AVX2 registers, four NEON registers, or plain scalars. Kernels use only operations that IEEE
//! 754 rounds correctly (including the fused multiply-add), in a fixed order, so all instruction sets give the same
//! bits.

pub mod aligned;
pub(crate) mod functions;

pub use fearless_simd::Level as InstructionSet;
use fearless_simd::{f64x8, prelude::*};

/// Numbers in a vector. Arrays are padded to a multiple of it.
pub(crate) const LANES: usize = 8;

/// `1/sqrt(s)` to the last bit or two, for `s` between 1e-37 and 1e37.
///
/// From a single-precision guess (relative error 1e-7), one third-order step `y (1 + h/2 + 3h^2/8)`, `h = 1 - s y^2`,
/// whose error is `5h^3/16`, below 1e-20. Costs less than half of a double-precision root and division.
#[inline(always)]
pub(crate) fn inverse_sqrt<S: Instructions>(simd: S, s: f64x8<S>) -> f64x8<S> {
    let [one, half, three_eighths] = [f64x8::splat(simd, 1.0), f64x8::splat(simd, 0.5), f64x8::splat(simd, 0.375)];
    let single = 1.0 / simd.narrow_f64x8(s, s).sqrt();
    let (y, _) = simd.widen_f32x16(single);
    let h = fma(-(s * y), y, one);
    fma(y * h, fma(h, three_eighths, half), y)
}

/// An instruction set that kernels are compiled for ([`on_instruction_set`](crate::on_instruction_set)).
pub trait Instructions: Simd {
    /// `a b + c`, rounded once.
    fn fma(a: f64x8<Self>, b: f64x8<Self>, c: f64x8<Self>) -> f64x8<Self>;
}

/// Implements [`Instructions`] for sets with a fused multiply-add.
macro_rules! fused {
    ($($set:ty),+) => {
        $(impl Instructions for $set {
            #[inline(always)]
            fn fma(a: f64x8<Self>, b: f64x8<Self>, c: f64x8<Self>) -> f64x8<Self> {
                a.mul_add(b, c)
            }
        })+
    };
}
#[cfg(target_arch = "x86_64")]
fused!(fearless_simd::x86::Avx2, fearless_simd::x86::Avx512);
#[cfg(target_arch = "aarch64")]
fused!(fearless_simd::aarch64::Neon);

impl Instructions for fearless_simd::Fallback {
    // Not inlined, because the code that replaces the instruction is long.
    #[inline(never)]
    fn fma(a: f64x8<Self>, b: f64x8<Self>, c: f64x8<Self>) -> f64x8<Self> {
        let (x, y, z) = (a.as_slice(), b.as_slice(), c.as_slice());
        let lanes: [f64; LANES] = std::array::from_fn(|k| x[k].mul_add(y[k], z[k]));
        f64x8::from_slice(a.simd, &lanes)
    }
}

/// `a b + c`, rounded once.
#[inline(always)]
pub(crate) fn fma<S: Instructions>(a: f64x8<S>, b: f64x8<S>, c: f64x8<S>) -> f64x8<S> {
    S::fma(a, b, c)
}

/// Sum of the eight lanes, always in the same order.
#[inline(always)]
pub(crate) fn sum_lanes<S: Simd>(v: f64x8<S>) -> f64 {
    let l = v.as_slice();
    ((l[0] + l[1]) + (l[2] + l[3])) + ((l[4] + l[5]) + (l[6] + l[7]))
}

/// Largest of the eight lanes; NaN lanes are ignored unless all are.
#[inline(always)]
pub(crate) fn max_lanes<S: Simd>(v: f64x8<S>) -> f64 {
    v.as_slice().iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b))
}

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, values: &[f64], at: usize) -> f64x8<S> {
    f64x8::from_slice(simd, &values[at..at + LANES])
}

#[inline(always)]
pub(crate) fn store<S: Simd>(v: f64x8<S>, values: &mut [f64], at: usize) {
    v.store_slice(&mut values[at..at + LANES]);
}

/// `n` rounded up to a whole number of vectors.
pub(crate) const fn padded(n: usize) -> usize {
    n.div_ceil(LANES) * LANES
}

/// Runs `$body` with `$simd` for the instruction set `$instruction_set`, compiled with its features switched on.
///
/// Only instruction sets that are common on machines of the last ten years have their own code; others use scalars.
#[macro_export]
macro_rules! on_instruction_set {
    ($instruction_set:expr, $simd:ident => $body:expr) => {{
        use fearless_simd::Simd;
        let instruction_set: $crate::physics::simd::InstructionSet = $instruction_set;
        #[cfg(target_arch = "x86_64")]
        let result = if let Some($simd) = instruction_set.as_avx512() {
            $simd.vectorize(
                #[inline(always)]
                || $body,
            )
        } else if let Some($simd) = instruction_set.as_avx2() {
            $simd.vectorize(
                #[inline(always)]
                || $body,
            )
        } else {
            let $simd = fearless_simd::Fallback::new();
            $body
        };
        #[cfg(target_arch = "aarch64")]
        let result = if let Some($simd) = instruction_set.as_neon() {
            $simd.vectorize(
                #[inline(always)]
                || $body,
            )
        } else {
            let $simd = fearless_simd::Fallback::new();
            $body
        };
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let result = {
            let _ = instruction_set;
            let $simd = fearless_simd::Fallback::new();
            $body
        };
        result
    }};
}

/// The widest instruction set of this machine, or the plain scalar one if `MENISCUS_SIMD=scalar` asks for it.
pub fn best_instruction_set() -> InstructionSet {
    match std::env::var("MENISCUS_SIMD").as_deref() {
        Ok("scalar") => InstructionSet::fallback(),
        _ => InstructionSet::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_square_roots_are_right_to_two_units_in_the_last_place() {
        let mut s = 1e-30;
        while s < 1e30 {
            let got = on_instruction_set!(InstructionSet::new(), simd => inverse_sqrt(simd, f64x8::splat(simd, s)).as_slice()[3]);
            let want = 1.0 / s.sqrt();
            assert!((got / want - 1.0).abs() <= 2.0 * f64::EPSILON, "{s}: {got} {want}");
            s *= 1.37;
        }
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        for k in 1..1000 {
            let s = f64::from(k) * 1.234_567e-3;
            let at = |instruction_set: InstructionSet| on_instruction_set!(instruction_set, simd => inverse_sqrt(simd, f64x8::splat(simd, s)).as_slice()[0]);
            assert_eq!(at(InstructionSet::new()).to_bits(), at(InstructionSet::fallback()).to_bits());
        }
    }
}

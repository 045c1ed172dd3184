//! The logarithm and the angle of eight numbers at a time.
//!
//! Both are polynomials after an exact reduction, in a fixed order of correctly rounded operations. So all instruction
//! sets give the same bits. Errors are below three units in the last place.

use crate::physics::simd::{Instructions, fma};
use fearless_simd::{f64x8, i64x8, prelude::*};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, FRAC_PI_8, LN_2, PI, SQRT_2};

/// The natural logarithm of positive normal numbers.
///
/// With `x = 2^e m` and m between `sqrt(1/2)` and `sqrt(2)`: `e ln 2 + 2 artanh((m - 1)/(m + 1))`.
#[inline(always)]
pub(crate) fn ln<S: Instructions>(simd: S, x: f64x8<S>) -> f64x8<S> {
    let bits: i64x8<S> = x.bitcast();
    let exponent = (bits >> 52) - i64x8::splat(simd, 1023);
    let one_to_two: f64x8<S> = ((bits & i64x8::splat(simd, (1 << 52) - 1)) | i64x8::splat(simd, 1023 << 52)).bitcast();
    let (one, half) = (f64x8::splat(simd, 1.0), f64x8::splat(simd, 0.5));
    let high = one_to_two.simd_gt(f64x8::splat(simd, SQRT_2));
    let m = high.select(one_to_two * half, one_to_two);
    let e = simd.cvt_f64_i64x8(exponent);
    let e = high.select(e + one, e);
    let s = (m - one) / (m + one);
    let squared = s * s;
    let mut series = f64x8::splat(simd, 1.0 / 23.0);
    for k in (1..11).rev() {
        series = fma(series, squared, f64x8::splat(simd, 1.0 / f64::from(2 * k + 1)));
    }
    let twice = s + s;
    // ln 2 in two parts, so that its multiples are exact enough.
    let (coarse, fine) = (f64x8::splat(simd, LN_2_HIGH), f64x8::splat(simd, LN_2_LOW));
    fma(e, coarse, twice + fma(twice * squared, series, e * fine))
}

/// The first 42 bits of ln 2, and the rest.
const LN_2_HIGH: f64 = f64::from_bits(LN_2.to_bits() & !0x7ff);
const LN_2_LOW: f64 = LN_2 - LN_2_HIGH + 2.319_046_813_846_299_6e-17;

/// The angle of the vectors (x, y), between -pi and pi. A vector without length has the angle zero.
#[inline(always)]
pub(crate) fn atan2<S: Instructions>(simd: S, y: f64x8<S>, x: f64x8<S>) -> f64x8<S> {
    let splat = |value: f64| f64x8::splat(simd, value);
    let (zero, one) = (splat(0.0), splat(1.0));
    let (ax, ay) = (x.abs(), y.abs());
    let steep = ay.simd_gt(ax);
    let (low, high) = (steep.select(ax, ay), steep.select(ay, ax));
    let t = low / high.max(splat(1e-300));
    // atan t = atan c + atan((t - c)/(1 + t c)) with c = 0, tan(pi/8), or 1.
    let (middle, top) = (t.simd_gt(splat(0.198_912_367_379_658)), t.simd_gt(splat(0.668_178_637_919_299)));
    let c = top.select(one, middle.select(splat(SQRT_2 - 1.0), zero));
    let begin = top.select(splat(FRAC_PI_4), middle.select(splat(FRAC_PI_8), zero));
    let u = (t - c) / fma(t, c, one);
    let squared = u * u;
    let mut series = splat(1.0 / 25.0);
    for k in (1..12).rev() {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        series = fma(series, squared, splat(sign / f64::from(2 * k + 1)));
    }
    let angle = begin + fma(u * squared, series, u);
    let angle = steep.select(splat(FRAC_PI_2) - angle, angle);
    let angle = x.simd_lt(zero).select(splat(PI) - angle, angle);
    angle.copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_instruction_set;
    use crate::physics::simd::{InstructionSet, LANES};

    fn lanes(f: impl Fn(usize) -> f64) -> [f64; LANES] {
        std::array::from_fn(f)
    }

    fn ln_of(set: InstructionSet, x: [f64; LANES]) -> Vec<f64> {
        on_instruction_set!(set, simd => ln(simd, f64x8::from_slice(simd, &x)).as_slice().to_vec())
    }

    fn angle_of(set: InstructionSet, y: [f64; LANES], x: [f64; LANES]) -> Vec<f64> {
        on_instruction_set!(set, simd => {
            atan2(simd, f64x8::from_slice(simd, &y), f64x8::from_slice(simd, &x)).as_slice().to_vec()
        })
    }

    #[test]
    fn logarithms_are_right_and_the_same_on_all_instruction_sets() {
        for k in 0..4000 {
            let x = lanes(|lane| libm::exp(0.01 * f64::from(k) - 20.0 + 0.37 * lane as f64));
            let got = ln_of(InstructionSet::new(), x);
            assert_eq!(got, ln_of(InstructionSet::fallback(), x));
            for (x, got) in x.iter().zip(got) {
                let want = libm::log(*x);
                assert!((got - want).abs() <= 3.0 * f64::EPSILON * want.abs() + 1e-17, "{x}: {got} {want}");
            }
        }
    }

    #[test]
    fn angles_are_right_in_all_quadrants_and_the_same_on_all_instruction_sets() {
        for k in 0..4000 {
            let at = |lane: usize| 1.57e-3 * f64::from(k) - PI + 1e-4 * lane as f64;
            let length = |lane: usize| libm::exp(lane as f64 - 6.0);
            let (x, y) = (lanes(|l| length(l) * libm::cos(at(l))), lanes(|l| length(l) * libm::sin(at(l))));
            let got = angle_of(InstructionSet::new(), y, x);
            assert_eq!(got, angle_of(InstructionSet::fallback(), y, x));
            for lane in 0..LANES {
                let want = libm::atan2(y[lane], x[lane]);
                assert!((got[lane] - want).abs() <= 3.0 * f64::EPSILON * want.abs().max(0.5), "{want} {}", got[lane]);
            }
        }
        assert_eq!(angle_of(InstructionSet::new(), [0.0; 8], [0.0; 8]), [0.0; 8]);
    }
}

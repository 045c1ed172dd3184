//! Numbers with exact first and second derivatives.
//!
//! A [`Jet`] is the value, gradient and Hessian of a function of `M` variables at one point. Sums, products, roots and
//! angles of jets are jets again, by the chain rule. So a contact states its energy once, and its force and stiffness
//! follow without error. Only edges that touch something are computed this way. A [`Slope`] is the same without second
//! derivatives, which cost five times as much; a formula that is generic over [`Differentiable`] gives either.

use std::ops::{Add, Mul, Sub};

/// Value, gradient and Hessian of a function of `M` variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jet<const M: usize> {
    pub(crate) value: f64,
    pub(crate) gradient: [f64; M],
    pub(crate) hessian: [[f64; M]; M],
}

impl<const M: usize> Jet<M> {
    /// `f(self)`, from f and its first two derivatives.
    #[inline(always)]
    fn map(self, f: f64, slope: f64, curvature: f64) -> Self {
        let mut jet = Self::constant(f);
        for i in 0..M {
            jet.gradient[i] = slope * self.gradient[i];
            for j in 0..M {
                jet.hessian[i][j] = slope * self.hessian[i][j] + curvature * self.gradient[i] * self.gradient[j];
            }
        }
        jet
    }
}

/// Numbers with derivatives, of either kind.
pub(crate) trait Differentiable:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self>
{
    fn constant(value: f64) -> Self;
    /// The variable of number `k`, at `value`.
    fn variable(value: f64, k: usize) -> Self;
    fn value(&self) -> f64;
    /// The square root of a positive function.
    fn sqrt(self) -> Self;
    /// One over a function that is not zero.
    fn reciprocal(self) -> Self;
    /// The angle of the vector (x, y).
    fn atan2(y: Self, x: Self) -> Self;
}

impl<const M: usize> Differentiable for Jet<M> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, gradient: [0.0; M], hessian: [[0.0; M]; M] }
    }

    #[inline(always)]
    fn variable(value: f64, k: usize) -> Self {
        let mut jet = Self::constant(value);
        jet.gradient[k] = 1.0;
        jet
    }

    #[inline(always)]
    fn value(&self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.map(root, 0.5 / root, -0.25 / (root * self.value))
    }

    #[inline(always)]
    fn reciprocal(self) -> Self {
        let inverse = 1.0 / self.value;
        self.map(inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse)
    }

    #[inline(always)]
    fn atan2(y: Self, x: Self) -> Self {
        let squared = x.value * x.value + y.value * y.value;
        let (fx, fy) = (-y.value / squared, x.value / squared);
        let fourth = squared * squared;
        let fxx = 2.0 * x.value * y.value / fourth;
        let fxy = (y.value * y.value - x.value * x.value) / fourth;
        let mut jet = Self::constant(libm::atan2(y.value, x.value));
        for i in 0..M {
            jet.gradient[i] = fx * x.gradient[i] + fy * y.gradient[i];
            for j in 0..M {
                let second = fxx * (x.gradient[i] * x.gradient[j] - y.gradient[i] * y.gradient[j])
                    + fxy * (x.gradient[i] * y.gradient[j] + y.gradient[i] * x.gradient[j]);
                jet.hessian[i][j] = fx * x.hessian[i][j] + fy * y.hessian[i][j] + second;
            }
        }
        jet
    }
}

impl<const M: usize> Add for Jet<M> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut sum = self;
        sum.value += other.value;
        for i in 0..M {
            sum.gradient[i] += other.gradient[i];
            for j in 0..M {
                sum.hessian[i][j] += other.hessian[i][j];
            }
        }
        sum
    }
}

impl<const M: usize> Sub for Jet<M> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl<const M: usize> Mul<f64> for Jet<M> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.map(self.value * factor, factor, 0.0)
    }
}

impl<const M: usize> Mul for Jet<M> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self, other);
        let mut product = Self::constant(a.value * b.value);
        for i in 0..M {
            product.gradient[i] = a.value * b.gradient[i] + b.value * a.gradient[i];
            for j in 0..M {
                product.hessian[i][j] = a.value * b.hessian[i][j]
                    + b.value * a.hessian[i][j]
                    + a.gradient[i] * b.gradient[j]
                    + a.gradient[j] * b.gradient[i];
            }
        }
        product
    }
}

/// Value and gradient of a function of `M` variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slope<const M: usize> {
    pub(crate) value: f64,
    pub(crate) gradient: [f64; M],
}

impl<const M: usize> Slope<M> {
    /// `f(self)`, from f and its derivative.
    #[inline(always)]
    fn map(self, f: f64, slope: f64) -> Self {
        let mut gradient = self.gradient;
        for k in 0..M {
            gradient[k] *= slope;
        }
        Self { value: f, gradient }
    }

    /// `f(self, other)`, from f and its two derivatives.
    #[inline(always)]
    fn join(self, other: Self, f: f64, [a, b]: [f64; 2]) -> Self {
        let mut gradient = [0.0; M];
        for k in 0..M {
            gradient[k] = a * self.gradient[k] + b * other.gradient[k];
        }
        Self { value: f, gradient }
    }
}

impl<const M: usize> Differentiable for Slope<M> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value, gradient: [0.0; M] }
    }

    #[inline(always)]
    fn variable(value: f64, k: usize) -> Self {
        let mut slope = Self::constant(value);
        slope.gradient[k] = 1.0;
        slope
    }

    #[inline(always)]
    fn value(&self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.map(root, 0.5 / root)
    }

    #[inline(always)]
    fn reciprocal(self) -> Self {
        let inverse = 1.0 / self.value;
        self.map(inverse, -inverse * inverse)
    }

    #[inline(always)]
    fn atan2(y: Self, x: Self) -> Self {
        let squared = x.value * x.value + y.value * y.value;
        x.join(y, libm::atan2(y.value, x.value), [-y.value / squared, x.value / squared])
    }
}

impl<const M: usize> Add for Slope<M> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.join(other, self.value + other.value, [1.0, 1.0])
    }
}

impl<const M: usize> Sub for Slope<M> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.join(other, self.value - other.value, [1.0, -1.0])
    }
}

impl<const M: usize> Mul<f64> for Slope<M> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.map(self.value * factor, factor)
    }
}

impl<const M: usize> Mul for Slope<M> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.join(other, self.value * other.value, [other.value, self.value])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formula<N: Differentiable>(x: [f64; 2]) -> N {
        let [x, y] = [N::variable(x[0], 0), N::variable(x[1], 1)];
        N::atan2(x * y + N::constant(0.3), x - y * 2.0) * (x * x + y * y * y).sqrt() * (x + y).reciprocal()
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let (at, h) = ([1.2, 0.7], 1e-5);
        let here: Jet<2> = formula(at);
        let slope: Slope<2> = formula(at);
        assert_eq!(slope.value, here.value);
        for k in 0..2 {
            let moved = |step: f64| {
                let mut x = at;
                x[k] += step;
                formula::<Jet<2>>(x)
            };
            let (ahead, behind) = (moved(h), moved(-h));
            assert!(((ahead.value - behind.value) / (2.0 * h) - here.gradient[k]).abs() < 1e-8);
            assert!((slope.gradient[k] - here.gradient[k]).abs() < 1e-14);
            for j in 0..2 {
                let slope = (ahead.gradient[j] - behind.gradient[j]) / (2.0 * h);
                assert!((slope - here.hessian[j][k]).abs() < 1e-8);
            }
        }
    }
}

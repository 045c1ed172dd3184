//! Numbers with exact first and second derivatives.
//!
//! A [`Jet`] is the value, gradient and Hessian of a function of `M` variables at one point. Sums, products, roots and
//! angles of jets are jets again, by the chain rule. So a contact states its energy once, and its force and stiffness
//! follow without error. Only edges that touch something are computed this way.

use std::ops::{Add, Mul, Sub};

/// Value, gradient and Hessian of a function of `M` variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jet<const M: usize> {
    pub(crate) value: f64,
    pub(crate) gradient: [f64; M],
    pub(crate) hessian: [[f64; M]; M],
}

impl<const M: usize> Jet<M> {
    pub(crate) const fn constant(value: f64) -> Self {
        Self { value, gradient: [0.0; M], hessian: [[0.0; M]; M] }
    }

    /// The variable of number `k`, at `value`.
    pub(crate) const fn variable(value: f64, k: usize) -> Self {
        let mut jet = Self::constant(value);
        jet.gradient[k] = 1.0;
        jet
    }

    /// `f(self)`, from f and its first two derivatives.
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

    /// The square root of a positive function.
    pub(crate) fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.map(root, 0.5 / root, -0.25 / (root * self.value))
    }

    /// One over a function that is not zero.
    pub(crate) fn reciprocal(self) -> Self {
        let inverse = 1.0 / self.value;
        self.map(inverse, -inverse * inverse, 2.0 * inverse * inverse * inverse)
    }

    /// The angle of the vector (x, y).
    pub(crate) fn atan2(y: Self, x: Self) -> Self {
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
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl<const M: usize> Mul<f64> for Jet<M> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.map(self.value * factor, factor, 0.0)
    }
}

impl<const M: usize> Mul for Jet<M> {
    type Output = Self;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn formula(x: [f64; 2]) -> Jet<2> {
        let [x, y] = [Jet::variable(x[0], 0), Jet::variable(x[1], 1)];
        Jet::atan2(x * y + Jet::constant(0.3), x - y * 2.0) * (x * x + y * y * y).sqrt() * (x + y).reciprocal()
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let (at, h) = ([1.2, 0.7], 1e-5);
        let here = formula(at);
        for k in 0..2 {
            let moved = |step: f64| {
                let mut x = at;
                x[k] += step;
                formula(x)
            };
            let (ahead, behind) = (moved(h), moved(-h));
            assert!(((ahead.value - behind.value) / (2.0 * h) - here.gradient[k]).abs() < 1e-8);
            for j in 0..2 {
                let slope = (ahead.gradient[j] - behind.gradient[j]) / (2.0 * h);
                assert!((slope - here.hessian[j][k]).abs() < 1e-8);
            }
        }
    }
}

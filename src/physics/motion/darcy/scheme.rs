//! The time scheme: backward differences of second order with variable steps (BDF2).
//!
//! For a step h after one of length `h1 = h/r`, the velocity at its end is
//!
//! ```text
//! v = (alpha_0 x+ + alpha_1 x + alpha_2 x1)/h,  alpha_0 = (1 + 2r)/(1 + r), alpha_1 = -(1 + r), alpha_2 = r^2/(1 + r)
//! ```
//!
//! (Hairer, Norsett, Wanner, "Solving ODEs I", III.5). The first step, and one after a kink in time, is backward Euler.
//! A polynomial through the last shapes foresees the next one. The error of a step follows from its distance from what
//! was foreseen, because both errors are multiples of the same derivative.

/// The scheme of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scheme {
    h: f64,
    h1: f64,
    h2: f64,
    /// How many earlier shapes are known: 0, 1, or 2 and more.
    known: u32,
    /// alpha_0, alpha_1, alpha_2.
    pub(super) alpha: [f64; 3],
}

impl Scheme {
    /// A step of `h` after steps of `h1` and, before that, `h2`, where `known` earlier shapes are known.
    pub(super) fn new(h: f64, h1: f64, h2: f64, known: u32) -> Self {
        let alpha = if known >= 2 {
            let r = h / h1;
            [(1.0 + 2.0 * r) / (1.0 + r), -(1.0 + r), r * r / (1.0 + r)]
        } else {
            [1.0, -1.0, 0.0]
        };
        Self { h, h1, h2, known, alpha }
    }

    /// The order of the scheme: 1 or 2.
    pub(super) const fn order(&self) -> i32 {
        if self.known >= 2 { 2 } else { 1 }
    }

    /// One coordinate, as foreseen from its last three values.
    pub(super) fn foresee(&self, x: f64, x1: f64, x2: f64) -> f64 {
        if self.known == 0 {
            return x;
        }
        let first = (x - x1) / self.h1;
        if self.known == 1 {
            return x + self.h * first;
        }
        let second = (first - (x1 - x2) / self.h2) / (self.h1 + self.h2);
        x + self.h * first + self.h * (self.h + self.h1) * second
    }

    /// The error of the step over its distance from what was foreseen.
    pub(super) fn error_share(&self) -> f64 {
        let Self { h, h1, h2, .. } = *self;
        let (foreseen, own) = match self.known {
            0 => return 1.0,
            1 => (0.5 * h * (h + h1), 0.5 * h * h),
            _ => {
                let both = h + h1;
                (h * both * (both + h2) / 6.0, h * h * both * both / (6.0 * (h + both)))
            }
        };
        own / (own + foreseen)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_foreseen_and_its_slope_is_exact() {
        let x = |t: f64| 0.3 + 2.0 * t - 1.5 * t * t;
        let (h, h1, h2) = (0.4, 0.3, 0.7);
        let scheme = Scheme::new(h, h1, h2, 2);
        assert!((scheme.foresee(x(0.0), x(-h1), x(-h1 - h2)) - x(h)).abs() < 1e-14);
        let [a, b, c] = scheme.alpha;
        assert!(((a * x(h) + b * x(0.0) + c * x(-h1)) / h - (2.0 - 3.0 * h)).abs() < 1e-13);
    }

    #[test]
    fn the_share_gives_the_error_of_a_cubic() {
        // Of y' = 3 t^2 one step with exact values before is off by known multiples of y''' = 6.
        let (h, h1, h2) = (0.4, 0.3, 0.7);
        let scheme = Scheme::new(h, h1, h2, 2);
        let y = |t: f64| t * t * t;
        let [a, b, c] = scheme.alpha;
        let step = (h * 3.0 * h * h - b * y(0.0) - c * y(-h1)) / a;
        let foreseen = scheme.foresee(y(0.0), y(-h1), y(-h1 - h2));
        assert!(((step - foreseen).abs() * scheme.error_share() / (step - y(h)).abs() - 1.0).abs() < 1e-12);
    }
}

//! The paper's estimate of lambda: `exp(-r/lambda)` fitted to the survival curve itself ([C24] eq. 16).
//!
//! It minimises `Q(lambda) = sum (P_i - exp(-r_i/lambda))^2` over the steps of the Kaplan-Meier curve, where P_i is the
//! value just after the step. Steps are neither independent nor equally certain, so this estimate is only for
//! comparison and has no interval.
//!
//! A single step is fitted exactly: `exp(-3/lambda) = 1/e` at lambda = 3.
//!
//! ```
//! use meniscus::study::survival::{kaplan_meier::Step, least_squares::lambda};
//! let step = Step { r: 3.0, survival: (-1.0_f64).exp(), variance: None, at_risk: 1, events: 1 };
//! assert!((lambda(&[step]).unwrap() - 3.0).abs() < 1e-6);
//! ```

use crate::study::survival::kaplan_meier::Step;

/// Intervals of the first search. Each is much shorter than 1, the scale of `ln lambda` on which the exponential
/// varies.
const GRID: usize = 200;

/// Number of golden sections: 0.618^45 = 4e-10. Rounding hides the place of the minimum within about 1e-8.
const SECTIONS: usize = 45;

/// The lambda of least squares, in sigma.
///
/// `None` without a step at `r > 0` that leaves survivors: `Q` then has no minimum at a finite lambda > 0.
pub fn lambda(steps: &[Step]) -> Option<f64> {
    let open = || steps.iter().filter(|step| step.r > 0.0 && step.survival > 0.0);
    let first = open().next()?.r;
    // Beyond the lambda of the slowest step the exponential lies above every step, and Q grows with lambda.
    let slowest = open().map(|step| -step.r / libm::log(step.survival)).fold(0.0, f64::max);
    let square = |ln_lambda: f64| {
        let lambda = libm::exp(ln_lambda);
        steps.iter().map(|step| step.survival - libm::exp(-step.r / lambda)).map(|gap| gap * gap).sum::<f64>()
    };
    // At first/50 the exponential is below 1e-21 at every step, and Q falls with lambda.
    Some(libm::exp(minimum(square, libm::log(first / 50.0), libm::log(1.1 * slowest))))
}

/// Where `f` is smallest between `a` and `b`: the best of a grid, then golden sections around it.
///
/// The solvers of `argmin` stop at a tolerance and would change the last digits of fits that stores hold already.
fn minimum(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let spacing = (b - a) / GRID as f64;
    let at = |i: usize| a + spacing * i as f64;
    let values: Vec<f64> = (0..=GRID).map(|i| f(at(i))).collect();
    let best = (0..=GRID).min_by(|&i, &j| values[i].total_cmp(&values[j])).unwrap_or(0);
    let (mut left, mut right) = (at(best) - spacing, at(best) + spacing);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..SECTIONS {
        let step = golden * (right - left);
        if f(right - step) <= f(left + step) { right = left + step } else { left = right - step }
    }
    0.5 * (left + right)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(steps: &[(f64, f64)]) -> Vec<Step> {
        let step = |&(r, survival): &(f64, f64)| Step { r, survival, variance: None, at_risk: 1, events: 1 };
        steps.iter().map(step).collect()
    }

    #[test]
    fn a_curve_on_an_exponential_returns_its_lambda() {
        for truth in [1e-3, 24.0, 5e4] {
            let on = |x: f64| (truth * x, libm::exp(-x));
            let found = lambda(&curve(&[0.05, 0.3, 0.9, 2.5].map(on))).unwrap();
            assert!((found / truth - 1.0).abs() < 1e-7, "{found}");
        }
    }

    #[test]
    fn one_step_is_met_exactly() {
        let found = lambda(&curve(&[(30.0, 0.98)])).unwrap();
        assert!((found - -30.0 / libm::log(0.98)).abs() < 1e-4, "{found}");
    }

    #[test]
    fn the_derivative_of_the_sum_of_squares_vanishes_at_the_answer() {
        let steps = curve(&[(0.1, 0.8), (2.0, 0.6), (2.5, 0.4), (40.0, 0.2), (41.0, 0.0)]);
        let found = lambda(&steps).unwrap();
        let slope = |lambda: f64| {
            let term = |s: &Step| (libm::exp(-s.r / lambda) - s.survival) * libm::exp(-s.r / lambda) * s.r / lambda;
            steps.iter().map(term).sum::<f64>()
        };
        assert!(slope(found).abs() < 1e-7 && slope(0.9 * found) < 0.0 && slope(1.1 * found) > 0.0, "{found}");
    }

    #[test]
    fn a_curve_that_leaves_no_survivors_at_its_only_step_has_no_answer() {
        assert_eq!(lambda(&curve(&[])), None);
        assert_eq!(lambda(&curve(&[(3.0, 0.0)])), None);
        assert_eq!(lambda(&curve(&[(0.0, 0.5), (3.0, 0.0)])), None);
    }
}

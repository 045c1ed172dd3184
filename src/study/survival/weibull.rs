//! Survival with a memory: `P(r) = exp(-(r/b)^k)`, Weibull's distribution, by maximum likelihood.
//!
//! At k = 1 it is exponential. At k > 1 a droplet clogs the more easily the farther it has come, at k < 1 the less. The
//! shape k with its interval says in which direction survival is not exponential, which
//! [`goodness`](crate::study::survival::goodness) does not, and notices it more often: at k = 1.4 and 50 clogs in 89% of
//! all cases instead of 67%.
//!
//! With d clogs at `r_i`, all runs ending at `r_j`, and what lies before `r0` left out of account, the scale b that fits
//! best is `b^k = sum_j (r_j^k - r0^k)/d`. With it the log-likelihood of k is, but for a constant,
//!
//! ```text
//! L(k) = d ln k - d ln sum_j (r_j^k - r0^k) + (k - 1) sum_i ln r_i,
//! ```
//!
//! which is concave. The 95% interval holds every k whose L is within 1.92 of the largest.

use crate::study::bisection::bisect;
use crate::study::survival::decay_length::{HALF_CHI_SQUARED, Lifetimes};

/// With fewer clogs the interval of k is wider than anything it could be compared with.
const FEWEST_CLOGS: usize = 5;

/// Logarithms of the smallest and of the largest k that are looked at.
const RANGE: [f64; 2] = [-4.0, 5.0];

/// The shape k of Weibull's distribution, with its 95% interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// The estimate.
    pub k: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// The shape that fits best; `None` with fewer than five clogs, or where no shape fits best: a droplet that clogs where
/// it starts, or all clogs at one place.
///
/// ```
/// use meniscus::study::survival::{decay_length::{Lifetime, Lifetimes}, weibull::shape};
/// // Quantiles of a survival with k = 2.
/// let r = |i: u32| (-(1.0 - (f64::from(i) + 0.5) / 50.0_f64).ln()).sqrt();
/// let lifetimes = Lifetimes::new((0..50).map(|i| Lifetime { r: r(i), clogged: true }).collect());
/// let found = shape(&lifetimes).unwrap();
/// assert!((found.k - 2.0).abs() < 0.1 && found.low > 1.0 && found.high < 3.0);
/// ```
pub fn shape(lifetimes: &Lifetimes) -> Option<Shape> {
    if lifetimes.clogs() < FEWEST_CLOGS {
        return None;
    }
    let likelihood = Likelihood::of(lifetimes)?;
    let root = |f: &dyn Fn(f64) -> f64, [low, high]: [f64; 2]| {
        (f(low) > 0.0 && f(high) < 0.0).then(|| libm::exp(0.5 * bisect(f, low, high).iter().sum::<f64>()))
    };
    let k = root(&|u| likelihood.slope(libm::exp(u)), RANGE)?;
    let (top, best) = (likelihood.value(k), libm::log(k));
    let above = |u: f64| likelihood.value(libm::exp(u)) - top + HALF_CHI_SQUARED;
    let low = root(&|u| -above(u), [RANGE[0], best])?;
    let high = root(&above, [best, RANGE[1]])?;
    Some(Shape { k, low, high })
}

/// L, in units in which the longest way is 1.
struct Likelihood {
    clogs: f64,
    /// Logarithms of the ways of all runs, and of the way from which on they count.
    ways: Vec<f64>,
    from: f64,
    /// Sum of the logarithms of the ways of the clogs.
    sum: f64,
}

impl Likelihood {
    fn of(lifetimes: &Lifetimes) -> Option<Self> {
        let from = lifetimes.from();
        let lives = lifetimes.as_slice();
        let longest = lives.last().map(|life| from + life.r).filter(|way| *way > 0.0 && way.is_finite())?;
        let logarithm = |r: f64| libm::log((from + r) / longest);
        let clogged = lives.iter().filter(|life| life.clogged);
        let sum: f64 = clogged.map(|life| logarithm(life.r)).sum();
        let ways = lives.iter().map(|life| logarithm(life.r)).collect();
        sum.is_finite().then(|| Self { clogs: lifetimes.clogs() as f64, ways, from: logarithm(0.0), sum })
    }

    /// `sum_j (r_j^k - r0^k)`.
    fn total(&self, k: f64) -> f64 {
        let before = libm::exp(k * self.from);
        self.ways.iter().map(|way| libm::exp(k * way) - before).sum()
    }

    fn value(&self, k: f64) -> f64 {
        self.clogs * (libm::log(k) - libm::log(self.total(k))) + (k - 1.0) * self.sum
    }

    fn slope(&self, k: f64) -> f64 {
        // A way of zero has the logarithm of minus infinity, and weighs nothing.
        let weighed = |way: f64| if way.is_finite() { way * libm::exp(k * way) } else { 0.0 };
        let before = weighed(self.from);
        let moment: f64 = self.ways.iter().map(|way| weighed(*way) - before).sum();
        self.clogs / k - self.clogs * moment / self.total(k) + self.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::survival::lifetimes;

    #[test]
    fn the_shape_of_the_6_mp_arm_is_the_published_one() {
        // Freireich et al., Blood 21, 699 (1963); R's survreg gives the scale 0.7387, of which k is the inverse.
        let relapses = [6.0, 6.0, 6.0, 7.0, 10.0, 13.0, 16.0, 22.0, 23.0];
        let censored = [6.0, 9.0, 10.0, 11.0, 17.0, 19.0, 20.0, 25.0, 32.0, 32.0, 34.0, 35.0];
        let found = shape(&lifetimes(&relapses, &censored)).unwrap();
        assert!((found.k - 1.0 / 0.7387).abs() < 1e-3, "{found:?}");
        assert!(found.low < 1.0 && found.high > 1.0);
    }

    #[test]
    fn the_ends_lie_1_92_below_the_top_and_the_unit_of_length_does_not_matter() {
        let (short, long) = ([1.0, 2.5, 3.0, 4.5, 7.0, 11.0], [2.0, 9.0]);
        let found = shape(&lifetimes(&short, &long)).unwrap();
        let likelihood = Likelihood::of(&lifetimes(&short, &long)).unwrap();
        for end in [found.low, found.high] {
            assert!((likelihood.value(found.k) - likelihood.value(end) - HALF_CHI_SQUARED).abs() < 1e-9);
        }
        let hundredfold = shape(&lifetimes(&short.map(|r| 100.0 * r), &long.map(|r| 100.0 * r))).unwrap();
        assert!((found.k - hundredfold.k).abs() < 1e-12);
    }

    #[test]
    fn left_out_ways_do_not_bias_it() {
        // Quantiles of an exponential beyond 1: with the way before left out, k = 1 still.
        let clogs: Vec<f64> = (0..400).map(|i| 1.0 - libm::log(1.0 - (f64::from(i) + 0.5) / 400.0)).collect();
        let all = lifetimes(&clogs, &[]);
        let (whole, beyond) = (shape(&all).unwrap(), shape(&all.beyond(1.0)).unwrap());
        assert!((beyond.k - 1.0).abs() < 0.02, "{beyond:?}");
        assert!(whole.low > 1.2, "a dead zone looks like a memory: {whole:?}");
    }

    #[test]
    fn few_clogs_or_a_clog_at_the_start_or_all_at_one_place_have_no_shape() {
        assert_eq!(shape(&lifetimes(&[1.0, 2.0, 3.0, 4.0], &[9.0])), None);
        assert_eq!(shape(&lifetimes(&[0.0, 1.0, 2.0, 3.0, 4.0], &[])), None);
        assert_eq!(shape(&lifetimes(&[2.0; 8], &[])), None);
    }
}

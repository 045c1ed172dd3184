//! Exponential survival `P(r) = exp(-r/lambda)` ([C24] eq. 16) by maximum likelihood, with right censoring.
//!
//! A run that clogs contributes the density `exp(-r/lambda)/lambda`. Any other run contributes the probability
//! `exp(-r/lambda)` of getting at least as far as it did. With `S` the sum of all r and `d` the number of clogs, the
//! log-likelihood is
//!
//! ```text
//! L(lambda) = -d ln(lambda) - S/lambda,      largest at lambda = S/d.
//! ```
//!
//! The 95% interval holds every lambda whose L is within `chi2_1(0.95)/2 = 1.92` of the largest. With `x =
//! lambda/(S/d)` that is `d (ln x + 1/x - 1) <= 1.92`, so its relative ends depend only on d. If nothing clogs, the
//! one-sided bound is the lambda at which so long a distance without a clog has probability 5%: `exp(-S/lambda) =
//! 0.05`, that is `lambda = S/(-ln 0.05) = S/3.00`.
//!
//! ```
//! use meniscus::study::survival::decay_length::{DecayLength, Lifetime, Lifetimes, maximum_likelihood};
//! let life = |r, clogged| Lifetime { r, clogged };
//! let two_clogs = Lifetimes::new(vec![life(1.0, true), life(3.0, true), life(8.0, false)]);
//! assert!(matches!(maximum_likelihood(&two_clogs), DecayLength::Measured { lambda: 6.0, .. }));
//! let none = Lifetimes::new(vec![life(100.0, false), life(200.0, false)]);
//! // 300/2.9957
//! assert!(matches!(maximum_likelihood(&none), DecayLength::Above(bound) if (bound - 100.14).abs() < 0.01));
//! ```

use crate::results::fits::FinishedRun;
use crate::study::bisection::bisect;

/// Half the 95% quantile of chi-squared with one degree of freedom.
pub(super) const HALF_CHI_SQUARED: f64 = 3.841_458_820_694_124 / 2.0;

/// Number of clogs at which the interval is +-10%: `(1.96/0.1)^2`.
const CLOGS_FOR_TEN_PERCENT: f64 = 384.16;

/// How far one droplet moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lifetime {
    /// Displacement at the end, in sigma, not negative.
    pub r: f64,
    /// Whether it clogged there. If not, it would have moved on by an unknown distance.
    pub clogged: bool,
}

impl Lifetime {
    /// That of a finished run, which counts as cut off at `edge`.
    pub(super) fn of(run: &FinishedRun, edge: f64) -> Self {
        let (r, clogged) = run.stays_at().map_or((run.r_end, false), |r| (r, true));
        if r > edge { Self { r: edge, clogged: false } } else { Self { r, clogged }.not_negative() }
    }

    /// With 0 in the place of a negative displacement.
    fn not_negative(self) -> Self {
        // f64::max would turn a NaN into 0; it must stay, so that the result shows it.
        if self.r > 0.0 || self.r.is_nan() { self } else { Self { r: 0.0, ..self } }
    }
}

/// Lifetimes sorted by displacement; of equal displacements those with a clog come first.
#[derive(Clone, Debug, PartialEq)]
pub struct Lifetimes {
    lives: Vec<Lifetime>,
    /// The displacement from which on they count, in sigma. Those of `lives` begin there.
    from: f64,
}

impl Lifetimes {
    /// Sorts lifetimes. A negative displacement counts as 0.
    pub fn new(mut lifetimes: Vec<Lifetime>) -> Self {
        lifetimes.iter_mut().for_each(|life| *life = life.not_negative());
        lifetimes.sort_by(|a, b| a.r.total_cmp(&b.r).then(b.clogged.cmp(&a.clogged)));
        Self { lives: lifetimes, from: 0.0 }
    }

    /// What lies beyond the displacement `from`, as if droplets started there: those that did not get so far are left out
    /// (left truncation).
    ///
    /// ```
    /// use meniscus::study::survival::decay_length::{DecayLength, Lifetime, Lifetimes, maximum_likelihood};
    /// let clog = |r| Lifetime { r, clogged: true };
    /// let lifetimes = Lifetimes::new(vec![clog(0.5), clog(3.0), clog(5.0)]).beyond(1.0);
    /// assert!(matches!(maximum_likelihood(&lifetimes), DecayLength::Measured { lambda: 3.0, .. }));
    /// ```
    pub fn beyond(&self, from: f64) -> Self {
        let shift = from - self.from;
        if !(shift > 0.0) {
            return self.clone();
        }
        // A NaN stays, so that the result shows it.
        let rest = self.lives.iter().filter(|life| !(life.r <= shift));
        Self { lives: rest.map(|life| Lifetime { r: life.r - shift, ..*life }).collect(), from }
    }

    /// The displacement from which on lifetimes count, in sigma.
    pub(super) fn from(&self) -> f64 {
        self.from
    }

    /// The lifetimes of finished runs. A run that was arrested at its time limit clogs at its equilibrium; every other
    /// run that did not clog is censored at its displacement. Beyond `edge`, the side of the periodic box, droplets meet
    /// the same obstacles again, so there every run is censored.
    pub(super) fn of_runs(runs: &[FinishedRun], edge: f64) -> Self {
        Self::new(runs.iter().map(|run| Lifetime::of(run, edge)).collect())
    }

    pub(super) fn as_slice(&self) -> &[Lifetime] {
        &self.lives
    }

    /// Number of runs.
    pub fn len(&self) -> usize {
        self.lives.len()
    }

    /// Whether there is no run.
    pub fn is_empty(&self) -> bool {
        self.lives.is_empty()
    }

    /// d, the number of clogs.
    pub(super) fn clogs(&self) -> usize {
        self.lives.iter().filter(|life| life.clogged).count()
    }

    /// S, the sum of all displacements, in sigma.
    pub(super) fn total(&self) -> f64 {
        self.lives.iter().map(|life| life.r).sum()
    }
}

/// The decay length of one point, in sigma.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DecayLength {
    /// Something clogged: the estimate and its 95% profile-likelihood interval.
    Measured {
        /// The estimate S/d.
        lambda: f64,
        /// Lower end of the interval.
        low: f64,
        /// Upper end of the interval.
        high: f64,
    },
    /// Nothing clogged: lambda is larger than this, one-sided 95%.
    Above(f64),
    /// Nothing clogged and nothing moved.
    Unknown,
}

/// The decay length by maximum likelihood.
///
/// If all droplets clog where they start, lambda and both ends of its interval are 0.
pub fn maximum_likelihood(lifetimes: &Lifetimes) -> DecayLength {
    let (clogs, total) = (lifetimes.clogs(), lifetimes.total());
    if clogs > 0 {
        let lambda = total / clogs as f64;
        let (low, high) = relative_interval(clogs);
        DecayLength::Measured { lambda, low: low * lambda, high: high * lambda }
    } else if total > 0.0 {
        DecayLength::Above(total / -libm::log(0.05))
    } else {
        DecayLength::Unknown
    }
}

/// The decay length if so many runs had clogged where they were cut off; `None` if none did then.
pub(super) fn if_stuck(lifetimes: &Lifetimes, cut: u32) -> Option<f64> {
    let clogs = lifetimes.clogs() + cut as usize;
    (clogs > 0).then(|| lifetimes.total() / clogs as f64)
}

/// Ends of the 95% interval, divided by the estimate, for d > 0 clogs.
fn relative_interval(clogs: usize) -> (f64, f64) {
    // With u = ln x: u + exp(-u) - 1 = drop. The left side is at least u^2/2 for u < 0 and at least u - 1 for u > 0.
    let drop = HALF_CHI_SQUARED / clogs as f64;
    let excess = |u: f64| u + libm::expm1(-u) - drop;
    let root = |[a, b]: [f64; 2]| 0.5 * (a + b);
    let low = root(bisect(excess, -(2.0 * drop).sqrt(), 0.0));
    let high = root(bisect(excess, 0.0, drop + 1.0));
    (libm::exp(low), libm::exp(high))
}

/// Total number of runs for an interval of +-10%, at the present share of clogs; `None` without a clog.
pub(super) fn runs_for_ten_percent(runs: usize, clogs: usize) -> Option<u32> {
    // The conversion saturates at the largest u32.
    (clogs > 0).then(|| (CLOGS_FOR_TEN_PERCENT * runs as f64 / clogs as f64).ceil() as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::survival::lifetimes;

    #[test]
    fn lambda_is_all_distance_over_the_clogs_and_its_ends_lie_1_92_below_the_top() {
        let DecayLength::Measured { lambda, low, high } = maximum_likelihood(&lifetimes(&[1.0, 3.0], &[8.0])) else {
            panic!("two clogs measure lambda")
        };
        let likelihood = |lambda: f64| -2.0 * libm::log(lambda) - 12.0 / lambda;
        assert_eq!(lambda, 6.0);
        for end in [low, high] {
            assert!((likelihood(lambda) - likelihood(end) - 1.920_729_410_347_062).abs() < 1e-12);
        }
        assert!(low < lambda && lambda < high);
    }

    #[test]
    fn the_relative_interval_of_many_clogs_is_1_96_over_the_root() {
        let (low, high) = relative_interval(1_000_000);
        assert!((low - 0.998_041).abs() < 2e-6 && (high - 1.001_961).abs() < 2e-6, "{low} {high}");
        let (low, high) = relative_interval(1);
        // One clog, by hand: ln x + 1/x - 1 = 1.92073.
        for x in [low, high] {
            assert!((libm::log(x) + 1.0 / x - 2.920_729_41).abs() < 1e-8, "{x}");
        }
    }

    #[test]
    fn without_a_clog_the_bound_leaves_five_percent_to_get_so_far() {
        let DecayLength::Above(bound) = maximum_likelihood(&lifetimes(&[], &[100.0, 260.0])) else {
            panic!("no clog gives a bound")
        };
        assert!((libm::exp(-360.0 / bound) - 0.05).abs() < 1e-15);
    }

    #[test]
    fn no_runs_and_droplets_that_never_moved_say_nothing() {
        assert_eq!(maximum_likelihood(&lifetimes(&[], &[])), DecayLength::Unknown);
        assert_eq!(maximum_likelihood(&lifetimes(&[], &[0.0, -0.01])), DecayLength::Unknown);
    }

    #[test]
    fn a_droplet_that_fell_back_has_gone_no_distance() {
        let fit = maximum_likelihood(&lifetimes(&[-0.3, 5.0], &[]));
        assert!(matches!(fit, DecayLength::Measured { lambda: 2.5, .. }));
        let stuck = maximum_likelihood(&lifetimes(&[0.0, -0.3], &[]));
        assert_eq!(stuck, DecayLength::Measured { lambda: 0.0, low: 0.0, high: 0.0 });
    }

    #[test]
    fn a_displacement_that_is_not_a_number_shows_in_the_result() {
        let fit = maximum_likelihood(&lifetimes(&[f64::NAN, 1.0], &[]));
        assert!(matches!(fit, DecayLength::Measured { lambda, .. } if lambda.is_nan()));
    }

    #[test]
    fn ten_percent_takes_385_runs_if_all_clog_and_twice_the_clogs_if_half_do() {
        assert_eq!(runs_for_ten_percent(50, 50), Some(385));
        assert_eq!(runs_for_ten_percent(50, 25), Some(769));
        assert_eq!(runs_for_ten_percent(50, 0), None);
    }
}

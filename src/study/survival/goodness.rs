//! Is the survival exponential? Then a droplet has no memory: it clogs as easily after a hundred sigma as at its start.
//!
//! In that case clogs are spread evenly over the distance that all droplets travel together. Imagine that all droplets
//! start at the same time with the same speed. When one clogs at `r_i`, all together have travelled
//! `T_i = sum_j min(r_j, r_i)` of the total `S = sum_j r_j` (the "total time on test" of reliability theory). The `T_i/S`
//! are then distributed like uniform draws from [0, 1], wherever and for whatever reason the other runs were cut off.
//! If the run that went farthest clogged, its own `T = S` says nothing and is left out; the others are then exactly
//! uniform. Kolmogorov's test compares them with uniform draws.
//!
//! The distance of the Kaplan-Meier curve from the fit would be another test. It would need to know where the clogged
//! runs would have been cut off. When that was estimated from the other runs, a nominal 5% test gave 2% or 8% false
//! alarms if the time limit cut runs at different distances.

use crate::study::survival::decay_length::Lifetimes;

/// With fewer clogs hardly any curve can be distinguished from an exponential.
const FEWEST_CLOGS: usize = 5;

/// Number of terms `exp(-2 k^2 x^2)` of Kolmogorov's series; the last is below 1e-17 for `x > 0.2`.
const TERMS: i32 = 22;

/// Probability that clogs are spread as unevenly as these, or more so, if survival is exponential; `None` with fewer
/// than five clogs, or if nothing moved.
///
/// ```
/// use meniscus::study::survival::{decay_length::{Lifetime, Lifetimes}, goodness::p_exponential};
/// // Ten droplets that all clog at the same distance.
/// let lifetimes = Lifetimes::new(vec![Lifetime { r: 10.0, clogged: true }; 10]);
/// assert!(p_exponential(&lifetimes).is_some_and(|p| p < 1e-6));
/// ```
pub fn p_exponential(lifetimes: &Lifetimes) -> Option<f64> {
    let total = lifetimes.total();
    let moved = total > 0.0 && total.is_finite();
    if lifetimes.clogs() < FEWEST_CLOGS || !moved {
        return None;
    }
    let mut shares = shares_travelled(lifetimes, total);
    if lifetimes.as_slice().last().is_some_and(|life| life.clogged) {
        shares.pop();
    }
    Some(kolmogorov(largest_gap(&shares), shares.len()))
}

/// `T_i/S` of each clog, in order.
fn shares_travelled(lifetimes: &Lifetimes, total: f64) -> Vec<f64> {
    let lives = lifetimes.as_slice();
    let mut ended = 0.0;
    let mut shares = Vec::new();
    for (i, life) in lives.iter().enumerate() {
        if life.clogged {
            shares.push((ended + (lives.len() - i) as f64 * life.r) / total);
        }
        ended += life.r;
    }
    shares
}

/// Largest distance between the share of draws up to x and x itself, for ordered draws from [0, 1].
fn largest_gap(draws: &[f64]) -> f64 {
    let n = draws.len() as f64;
    let gap = |(i, x): (usize, &f64)| (x - i as f64 / n).max((i + 1) as f64 / n - x);
    draws.iter().enumerate().map(gap).fold(0.0, f64::max)
}

/// Probability that n uniform draws leave a larger gap: Kolmogorov's series, with the correction for small n of
/// Stephens, J. R. Stat. Soc. B 32, 115 (1970).
fn kolmogorov(gap: f64, n: usize) -> f64 {
    let root = (n as f64).sqrt();
    let x = gap * (root + 0.12 + 0.11 / root);
    // Below 0.2 the probability is 1 to twelve digits, and the series converges slowly.
    if x < 0.2 {
        return 1.0;
    }
    let term = |k: i32| if k % 2 == 1 { 2.0 } else { -2.0 } * libm::exp(-2.0 * f64::from(k * k) * x * x);
    (1..=TERMS).map(term).sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::survival::lifetimes;

    #[test]
    fn a_clog_falls_where_all_runs_together_had_got() {
        // At r = 1 three runs have covered 3, at r = 4 they have covered 1 + 4 + 4, of 1 + 4 + 5 in total.
        assert_eq!(shares_travelled(&lifetimes(&[1.0, 4.0], &[5.0]), 10.0), [0.3, 0.9]);
        // The run cut off at 2 covers no more from there on.
        assert_eq!(shares_travelled(&lifetimes(&[4.0], &[2.0, 4.0]), 10.0), [1.0]);
    }

    #[test]
    fn the_gap_of_uniform_draws_is_taken_on_both_sides_of_each() {
        assert_eq!(largest_gap(&[0.5]), 0.5);
        assert!((largest_gap(&[0.1, 0.2, 0.9]) - (2.0 / 3.0 - 0.2)).abs() < 1e-15);
        assert!((largest_gap(&[0.6, 0.7, 0.9]) - 0.6).abs() < 1e-15);
    }

    #[test]
    fn probabilities_are_those_of_kolmogorovs_tables() {
        // Critical gaps at 5% and 1%, Massey, J. Am. Stat. Assoc. 46, 68 (1951), and 1.358/sqrt(n) for large n.
        for (n, gap, p) in [(5, 0.565, 0.05), (10, 0.410, 0.05), (20, 0.294, 0.05), (10, 0.490, 0.01)] {
            assert!((kolmogorov(gap, n) / p - 1.0).abs() < 0.1, "{n}: {}", kolmogorov(gap, n));
        }
        assert!((kolmogorov(1.358_1e-3, 1_000_000) - 0.05).abs() < 1e-4);
        // T. Ferguson's calculator (UCLA): P(D_100 <= 0.1) = 0.74731.
        assert!((kolmogorov(0.1, 100) - 0.252_69).abs() < 5e-3);
        assert_eq!(kolmogorov(0.0, 10), 1.0);
        assert!((kolmogorov(0.2 / 10.131, 100) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn fewer_than_five_clogs_or_no_movement_give_no_answer() {
        assert_eq!(p_exponential(&lifetimes(&[1.0, 2.0, 3.0, 4.0], &[9.0])), None);
        assert!(p_exponential(&lifetimes(&[1.0, 2.0, 3.0, 4.0, 5.0], &[])).is_some());
        assert_eq!(p_exponential(&lifetimes(&[0.0; 9], &[])), None);
    }
}

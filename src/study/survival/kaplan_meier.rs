//! Survival curve without a model: the Kaplan-Meier product-limit estimator.
//!
//! At each displacement where `d` of the `n` droplets that are still moving clog, `P` falls by the factor `1 - d/n`. A
//! run that ends without a clog makes no step, but lowers the `n` of later steps. If it ends exactly where another run
//! clogs, it still counts at that step.
//!
//! Of three droplets two clog, at 1 and 3, and one is cut off at 2: P falls to 2/3, and then, with one droplet left, to
//! 0.
//!
//! ```
//! use meniscus::study::survival::{decay_length::{Lifetime, Lifetimes}, kaplan_meier::steps};
//! let life = |r, clogged| Lifetime { r, clogged };
//! let curve = steps(&Lifetimes::new(vec![life(1.0, true), life(2.0, false), life(3.0, true)]));
//! assert_eq!((curve[0].r, curve[0].at_risk, curve[0].survival), (1.0, 3, 2.0 / 3.0));
//! assert_eq!((curve[1].r, curve[1].at_risk, curve[1].survival), (3.0, 1, 0.0));
//! ```

use crate::study::survival::decay_length::Lifetimes;

/// The 97.5% quantile of the normal distribution.
const NORMAL: f64 = 1.959_963_984_540_054;

/// One step of the curve. Between steps `P` is constant, and before the first step it is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Displacement, in sigma.
    pub r: f64,
    /// `P` from here to the next step.
    pub survival: f64,
    /// Greenwood's variance, `P^2 sum d/(n (n - d))`; `None` once `P = 0`, where it is undefined.
    pub variance: Option<f64>,
    /// n, the number of droplets still moving just before.
    pub at_risk: usize,
    /// d, the number of droplets that clog here.
    pub events: usize,
}

impl Step {
    /// The 95% band of `P` here, `P^exp(+-1.96 s)` with s the standard error of `ln(-ln P)`. `None` where P is 0.
    ///
    /// This band stays within 0 and 1 and covers 95% also of few runs (Kalbfleisch and Prentice, "The Statistical Analysis
    /// of Failure Time Data", 1.4).
    pub fn band(&self) -> Option<[f64; 2]> {
        let error = self.variance?.sqrt() / (self.survival * libm::log(self.survival)).abs();
        Some([1.0, -1.0].map(|sign| libm::pow(self.survival, libm::exp(sign * NORMAL * error))))
    }
}

/// The steps of the curve, by displacement.
pub fn steps(lifetimes: &Lifetimes) -> Vec<Step> {
    let mut at_risk = lifetimes.len();
    let mut survival = 1.0;
    let mut greenwood = 0.0;
    let mut steps = Vec::new();
    for tied in lifetimes.as_slice().chunk_by(|a, b| a.r == b.r) {
        let events = tied.iter().filter(|life| life.clogged).count();
        if events > 0 {
            let (n, d) = (at_risk as f64, events as f64);
            survival *= (n - d) / n;
            greenwood += d / (n * (n - d));
            let variance = (events < at_risk).then_some(survival * survival * greenwood);
            steps.push(Step { r: tied[0].r, survival, variance, at_risk, events });
        }
        at_risk -= tied.len();
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::survival::decay_length::Lifetime;

    #[test]
    fn the_curve_of_the_6_mp_arm_is_the_published_one() {
        // Remission times in weeks, Freireich et al., Blood 21, 699 (1963); P and its standard error as tabulated
        // in textbooks, for instance Kleinbaum and Klein, "Survival Analysis", chapter 2.
        let relapses = [6, 6, 6, 7, 10, 13, 16, 22, 23];
        let censored = [6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35];
        let life = |weeks: &i32, clogged| Lifetime { r: f64::from(*weeks), clogged };
        let all = censored.iter().map(|t| life(t, false)).chain(relapses.iter().map(|t| life(t, true)));
        let published = [
            (6.0, 21, 3, 0.857, 0.0764),
            (7.0, 17, 1, 0.807, 0.0869),
            (10.0, 15, 1, 0.753, 0.0963),
            (13.0, 12, 1, 0.690, 0.1068),
            (16.0, 11, 1, 0.627, 0.1141),
            (22.0, 7, 1, 0.538, 0.1282),
            (23.0, 6, 1, 0.448, 0.1346),
        ];
        let curve = steps(&Lifetimes::new(all.collect()));
        assert_eq!(curve.len(), published.len());
        for (step, (r, at_risk, events, survival, error)) in curve.iter().zip(published) {
            assert_eq!((step.r, step.at_risk, step.events), (r, at_risk, events));
            assert!((step.survival - survival).abs() < 6e-4, "{step:?}");
            assert!((step.variance.unwrap().sqrt() - error).abs() < 6e-5, "{step:?}");
        }
        // Of the first step by hand: ln(-ln(18/21)) = -1.8698, its standard error 0.5785.
        let [low, high] = curve[0].band().unwrap();
        assert!((low - 0.6197).abs() < 1e-3 && (high - 0.9516).abs() < 1e-3, "{low} {high}");
    }

    #[test]
    fn without_censoring_the_curve_is_the_share_still_under_way() {
        let all = [3.0, 1.0, 2.0, 2.0].map(|r| Lifetime { r, clogged: true });
        let curve = steps(&Lifetimes::new(all.to_vec()));
        let shares: Vec<f64> = curve.iter().map(|step| step.survival).collect();
        assert_eq!(shares, [0.75, 0.25, 0.0]);
        // Greenwood's variance is then the binomial P (1 - P)/n.
        assert!((curve[1].variance.unwrap() - 0.25 * 0.75 / 4.0).abs() < 1e-15);
        assert_eq!((curve[2].variance, curve[2].band()), (None, None));
    }

    #[test]
    fn no_runs_or_no_clogs_give_no_steps() {
        assert!(steps(&Lifetimes::new(vec![])).is_empty());
        assert!(steps(&Lifetimes::new(vec![Lifetime { r: 5.0, clogged: false }])).is_empty());
    }
}

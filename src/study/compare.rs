//! How much two grid points differ: the ratio of their decay lengths, or of their mean speeds, over common seeds.
//!
//! Points whose arrays have the same parameters share the array and the start of a seed. So most of what chance does to one
//! it does to the other too, and the ratio is known better than either number. Along `w_ob`, `sigma_ob`, `density` or
//! `box_size` little is common. An estimate is a ratio of two sums over seeds. Lambda is the sum of all
//! displacements over the number of clogs; a mean speed is the sum of the speeds over their number, where droplets flow at
//! both points. Let seed i add `a_i` and `b_i` to these sums. With its influence on the logarithm of each estimate,
//!
//! ```text
//! psi_i = a_i/mean(a) - b_i/mean(b),
//! ```
//!
//! the logarithm of the ratio has the standard error `e = sqrt(sum (psi_i - psi'_i)^2/(n (n - 1)))`, and z is the
//! logarithm over e. Its interval comes from the studentised bootstrap over seeds, as that of mean speeds does
//! ([`crate::study::speed`]).

use crate::parameters::Scene;
use crate::results::fits::{FinishedRun, PointRuns};
use crate::study::studentised::Deviations;
use crate::study::survival::lifetime_of;

/// A comparison needs at least this many common seeds: of ten, the interval holds the truth in 82% of all cases only.
const FEWEST_SEEDS: usize = 20;

/// At least this many seeds have to carry the difference. Where nearly all droplets of two points end in the same places, the
/// others are too few to say how sure the ratio is.
const FEWEST_CARRIERS: f64 = 4.0;

/// Seed of the bootstrap.
const SEED: u64 = 0x0072_6174_696f;

/// The ratio of an estimate at one point over that at another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Common seeds that count.
    pub seeds: u32,
    /// The ratio.
    pub ratio: f64,
    /// Lower end of its 95% interval.
    pub low: f64,
    /// Upper end of its 95% interval.
    pub high: f64,
    /// Its logarithm over the standard error of that.
    pub z: f64,
    /// Two-sided p of a ratio of 1, from the resamples of the interval; at least 2e-4.
    pub p: f64,
}

/// What one seed adds to the sums of both points: `[a, b, a', b']`.
type Share = [f64; 4];

/// The ratio of the decay lengths beyond `from`, of `other` over `point`. `None` with fewer than twenty common seeds, or so
/// few clogs that a resample may have none, where fewer than four seeds carry the difference, or elsewhere
/// than in arrays of obstacles.
pub fn lambda_ratio(point: &PointRuns, other: &PointRuns, from: f64) -> Option<Ratio> {
    if ![point, other].iter().all(|point| matches!(point.point.scene, Scene::Obstacles(_))) {
        return None;
    }
    let share = |runs: &PointRuns, run: &FinishedRun| {
        let life = lifetime_of(runs, run);
        let way = (life.r - from).max(0.0);
        [way, f64::from(u8::from(life.clogged && life.r > from))]
    };
    ratio(&common(point, other, |a, b| Some((share(point, a), share(other, b)))))
}

/// The ratio of the mean speeds of the droplets that flow at both points, of `other` over `point`. `None` with fewer than
/// twenty common seeds.
pub fn speed_ratio(point: &PointRuns, other: &PointRuns) -> Option<Ratio> {
    ratio(&common(point, other, |a, b| Some(([a.flowing_speed()?, 1.0], [b.flowing_speed()?, 1.0]))))
}

/// The shares of the seeds that both points have; runs are ordered by seed.
fn common(
    point: &PointRuns,
    other: &PointRuns,
    shares: impl Fn(&FinishedRun, &FinishedRun) -> Option<([f64; 2], [f64; 2])>,
) -> Vec<Share> {
    let partner = |run: &FinishedRun| {
        let at = other.runs.binary_search_by_key(&run.seed, |run| run.seed).ok()?;
        let ([a, b], [c, d]) = shares(run, &other.runs[at])?;
        Some([a, b, c, d])
    };
    point.runs.iter().filter_map(partner).collect()
}

fn ratio(shares: &[Share]) -> Option<Ratio> {
    if shares.len() < FEWEST_SEEDS {
        return None;
    }
    let (logarithm, error) = estimate(shares.iter())?;
    if carriers(shares) < FEWEST_CARRIERS {
        return None;
    }
    let deviations = Deviations::of(shares.len(), SEED, |drawn| {
        let (resampled, own) = estimate(drawn.iter().map(|&seed| &shares[seed]))?;
        Some((resampled - logarithm) / own)
    })?;
    let (low, high) = deviations.interval(logarithm, error);
    let z = logarithm / error;
    Some(Ratio {
        seeds: shares.len() as u32,
        ratio: libm::exp(logarithm),
        low: libm::exp(low),
        high: libm::exp(high),
        z,
        p: deviations.p(z),
    })
}

/// How many seeds carry the difference: `(sum psi^2)^2/sum psi^4`, which is n if all do alike.
fn carriers(shares: &[Share]) -> f64 {
    let sums = sums(shares.iter());
    let squares = shares.iter().map(|share| influence(share, &sums)).map(|psi| psi * psi);
    let (second, fourth) =
        squares.fold((0.0, 0.0), |(second, fourth), square| (second + square, fourth + square * square));
    second * second / fourth
}

/// The sums over seeds.
fn sums<'a>(shares: impl Iterator<Item = &'a Share>) -> Share {
    shares.fold([0.0; 4], |mut sums, share| {
        sums.iter_mut().zip(share).for_each(|(sum, value)| *sum += value);
        sums
    })
}

/// The influence of a seed on the logarithm of the ratio, over the number of seeds.
fn influence([a, b, c, d]: &Share, sums: &Share) -> f64 {
    c / sums[2] - d / sums[3] - a / sums[0] + b / sums[1]
}

/// The logarithm of the ratio, and its standard error; `None` where a sum is zero or nothing varies.
fn estimate<'a>(shares: impl Iterator<Item = &'a Share> + Clone) -> Option<(f64, f64)> {
    let (sums, n) = (sums(shares.clone()), shares.clone().count() as f64);
    if !sums.iter().all(|&sum| sum > 0.0) {
        return None;
    }
    let squares: f64 = shares.map(|share| influence(share, &sums)).map(|psi| psi * psi).sum();
    let error = (squares * n / (n - 1.0)).sqrt();
    let logarithm = libm::log(sums[2] / sums[3]) - libm::log(sums[0] / sums[1]);
    (error > 1e-9).then_some((logarithm, error))
}

/// Probabilities of several comparisons, adjusted so that the chance of one or more below 5% is at most 5% if no two
/// points differ (Holm, Scand. J. Stat. 6, 65 (1979)).
///
/// ```
/// use meniscus::study::compare::holm;
/// let adjusted = holm(&[0.01, 0.04, 0.03]);
/// assert!((adjusted[0] - 0.03).abs() < 1e-15 && adjusted[1] == adjusted[2] && (adjusted[1] - 0.06).abs() < 1e-15);
/// ```
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let (mut adjusted, mut largest) = (vec![0.0; p.len()], 0.0_f64);
    for (place, &at) in order.iter().enumerate() {
        largest = largest.max(p[at] * (p.len() - place) as f64).min(1.0);
        adjusted[at] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::random::uniform;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// Displacements of two points that share most of their chance; the second goes `ratio` times as far.
    fn paired(random: &mut ChaCha8Rng, n: usize, ratio: f64, own: f64) -> Vec<Share> {
        let mut exponential = || -libm::log(uniform(random));
        (0..n)
            .map(|_| {
                let common = exponential();
                let mut way = |lambda: f64| lambda * ((1.0 - own) * common + own * exponential());
                let (a, c) = (way(1.0), way(ratio));
                [a, 1.0, c, 1.0]
            })
            .collect()
    }

    #[test]
    fn common_chance_cancels() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let [alike, alone] = [0.2, 1.0].map(|own| ratio(&paired(&mut random, 50, 0.75, own)).unwrap());
        assert!(alike.z < -3.0 && alike.p < 0.01 && alike.low < 0.75 && alike.high < 1.0, "{alike:?}");
        assert!((alike.high / alike.low) < (alone.high / alone.low).sqrt(), "{alike:?} {alone:?}");
    }

    #[test]
    fn the_standard_error_without_pairs_is_that_of_the_clogs() {
        // Of independent exponential displacements without censoring: 1/d + 1/d'.
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let shares = paired(&mut random, 4000, 1.0, 1.0);
        let (_, error) = estimate(shares.iter()).unwrap();
        assert!((error / (2.0_f64 / 4000.0).sqrt() - 1.0).abs() < 0.03, "{error}");
    }

    #[test]
    #[ignore = "coverage takes a minute; `cargo test --release --lib compare -- --ignored --nocapture`"]
    fn intervals_of_ratios_cover_what_they_promise() {
        for (n, own) in [(20, 0.3), (30, 0.3), (50, 0.3), (50, 1.0)] {
            let mut random = ChaCha8Rng::seed_from_u64(3);
            let sets = 1000;
            let covers = |_: &u32| {
                let found = ratio(&paired(&mut random, n, 0.75, own));
                found.is_some_and(|found| found.low <= 0.75 && found.high >= 0.75)
            };
            let covered = (0..sets).filter(covers).count();
            let share = covered as f64 / f64::from(sets);
            println!("{n} seeds, own chance {own}: {share}");
            assert!((0.92..0.975).contains(&share), "{n} {own}: {share}");
        }
    }

    #[test]
    fn few_seeds_or_no_clogs_give_no_ratio() {
        assert_eq!(ratio(&[[1.0, 1.0, 2.0, 1.0]; 19]), None);
        assert_eq!(ratio(&[[1.0, 0.0, 2.0, 1.0]; 30]), None);
        assert_eq!(ratio(&[[1.0, 1.0, 2.0, 1.0]; 30]), None, "nothing varies");
    }
}

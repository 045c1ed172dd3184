//! Does the decay length only rise, or only fall, along an axis? The paper's headline is that lambda(Gamma) does neither.
//!
//! For each two points i before j the hypothesis is that lambda does not rise from i to j. With d clogs on the total way S,
//! the hazard of a point is d/S. There are two tests:
//!
//! - **Common seeds.** If both points were alike, the two runs of a seed could change places. The probability is the share
//!   of random exchanges that bring the hazards as far apart, in standard errors of counts. This is exact where runs of
//!   both points are cut off alike.
//! - **Else.** Given the clogs of both points together, those of j are binomial with the share `S_j/(S_i + S_j)`. This errs
//!   to the safe side, because ways are random too.
//!
//! Of all pairs that one is tested whose hazards lie furthest apart, in standard errors of counts. Its probability times the
//! number of pairs is the p of a rise; likewise for a fall. Where lambda is monotonic it has no rise or no fall, so the larger
//! of both is below 0.05 in at most 5% of all cases.

use crate::parameters::Scene;
use crate::results::fits::PointRuns;
use crate::study::random::uniform;
use crate::study::series::Series;
use crate::study::survival::decay_length::Lifetime;
use crate::study::survival::lifetime_of;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use statrs::distribution::{Binomial, DiscreteCDF};

/// With fewer common seeds, points are compared without them.
const FEWEST_SEEDS: usize = 10;

/// Number of random exchanges.
const EXCHANGES: usize = 9999;

/// Seed of the exchanges.
const SEED: u64 = 0x006d_6f6e_6f74;

/// The steepest rise, or the steepest fall, along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slope {
    /// Values of the axis at both points, in its order.
    pub between: [f64; 2],
    /// Probability of such a slope somewhere on the axis if there is none, adjusted for the choice of the pair.
    pub p: f64,
}

/// Whether lambda is monotonic along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monotonic {
    /// The most certain rise.
    pub rise: Slope,
    /// The most certain fall.
    pub fall: Slope,
}

impl Monotonic {
    /// Probability of rises and falls as certain as these if lambda is monotonic.
    pub fn p(&self) -> f64 {
        self.rise.p.max(self.fall.p)
    }
}

/// The most certain rise and fall of lambda along a series, from what lies beyond `from`. Points where no droplet gets so far
/// are left out. `None` elsewhere than in arrays of obstacles, and if fewer than two points have a clog.
pub fn monotonic(series: &Series<'_>, from: f64) -> Option<Monotonic> {
    if !series.0.iter().all(|(_, point)| matches!(point.point.scene, Scene::Obstacles(_))) {
        return None;
    }
    let (mut values, mut lives, mut totals) = (Vec::new(), Vec::new(), Vec::new());
    for (value, point) in &series.0 {
        let beyond = lifetimes(point, from);
        let total = Total::of(beyond.iter().map(|(_, life)| *life));
        if total.way > 0.0 {
            values.push(*value);
            lives.push(beyond);
            totals.push(total);
        }
    }
    if totals.iter().filter(|total| total.clogs > 0.0).count() < 2 {
        return None;
    }
    let pairs = (totals.len() * (totals.len() - 1) / 2) as f64;
    let steepest = |falls: bool| {
        let ordered = (0..totals.len()).flat_map(|i| (i + 1..totals.len()).map(move |j| (i, j)));
        let (i, j) = ordered.max_by(|a, b| certainty(&totals, *a, falls).total_cmp(&certainty(&totals, *b, falls)))?;
        // A fall from i to j is a rise from j to i.
        let (low, high) = if falls { (j, i) } else { (i, j) };
        let p = rises([&lives[low], &lives[high]], [totals[low], totals[high]]);
        Some(Slope { between: [values[i], values[j]], p: (p * pairs).min(1.0) })
    };
    Some(Monotonic { rise: steepest(false)?, fall: steepest(true)? })
}

/// Clogs, and the way of all runs together.
#[derive(Clone, Copy, Debug)]
struct Total {
    clogs: f64,
    way: f64,
}

impl Total {
    fn of(lives: impl Iterator<Item = Lifetime>) -> Self {
        lives.fold(Self { clogs: 0.0, way: 0.0 }, |total, life| Self {
            clogs: total.clogs + f64::from(u8::from(life.clogged)),
            way: total.way + life.r,
        })
    }

    fn hazard(&self) -> f64 {
        self.clogs / self.way
    }
}

/// The lifetimes beyond `from`, by seed.
fn lifetimes(point: &PointRuns, from: f64) -> Vec<(u64, Lifetime)> {
    let beyond = |life: Lifetime| Lifetime { r: life.r - from, ..life };
    let all = point.runs.iter().map(|run| (run.seed, beyond(lifetime_of(point, run))));
    all.filter(|(_, life)| life.r > 0.0 || from == 0.0).collect()
}

/// How far the hazards of a pair lie apart, in standard errors of counts; positive where lambda rises, or `falls`.
fn certainty(totals: &[Total], (i, j): (usize, usize), falls: bool) -> f64 {
    let apart = apart(totals[i], totals[j]);
    if falls { -apart } else { apart }
}

/// The hazard of `a` less that of `b`, in standard errors of counts.
fn apart(a: Total, b: Total) -> f64 {
    let error = (a.clogs.max(1.0) / (a.way * a.way) + b.clogs.max(1.0) / (b.way * b.way)).sqrt();
    (a.hazard() - b.hazard()) / error
}

/// Probability of hazards that fall as much from the first point to the second, or more, if they are alike.
fn rises(lives: [&[(u64, Lifetime)]; 2], [first, second]: [Total; 2]) -> f64 {
    let pairs: Vec<[Lifetime; 2]> = lives[0]
        .iter()
        .filter_map(|(seed, life)| {
            let at = lives[1].binary_search_by_key(seed, |(seed, _)| *seed).ok()?;
            Some([*life, lives[1][at].1])
        })
        .collect();
    if pairs.len() >= FEWEST_SEEDS { exchanged(&pairs) } else { conditional(first, second) }
}

fn exchanged(pairs: &[[Lifetime; 2]]) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut difference = |exchanges: bool| {
        let mut totals = [Total { clogs: 0.0, way: 0.0 }; 2];
        for pair in pairs {
            let swapped = exchanges && uniform(&mut random) < 0.5;
            for (side, life) in pair.iter().enumerate() {
                let total = &mut totals[if swapped { 1 - side } else { side }];
                total.clogs += f64::from(u8::from(life.clogged));
                total.way += life.r;
            }
        }
        let [a, b] = totals;
        // Where one side has no way at all, nothing is apart.
        if a.way > 0.0 && b.way > 0.0 { apart(a, b) } else { 0.0 }
    };
    let seen = difference(false);
    // Exchanges that change nothing give the same difference, but for rounding.
    let rounding = 1e-12 * seen.abs();
    let as_large = (0..EXCHANGES).filter(|_| difference(true) >= seen - rounding).count();
    (1 + as_large) as f64 / (1 + EXCHANGES) as f64
}

fn conditional(first: Total, second: Total) -> f64 {
    let clogs = (first.clogs + second.clogs) as u64;
    let share = second.way / (first.way + second.way);
    Binomial::new(share, clogs).map_or(1.0, |binomial| binomial.cdf(second.clogs as u64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, Model, ObstacleField, Point, Soft};
    use crate::results::fits::FinishedRun;
    use crate::results::trajectory::Outcome;

    /// Points with these decay lengths, exponential, of so many seeds.
    fn points(lambdas: &[f64], seeds: u64, random: &mut ChaCha8Rng, common: bool) -> Vec<PointRuns> {
        let array = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 5000.0 };
        let made = lambdas.iter().enumerate().map(|(k, lambda)| {
            let point = Point::new(Model::Soft(Soft { e_w: 1.0 + k as f64 }), Scene::Obstacles(array.clone()));
            let first = if common { 0 } else { 1000 * k as u64 };
            let run = |seed| FinishedRun {
                seed,
                outcome: Outcome::Clogged,
                r_end: -lambda * libm::log(uniform(random)),
                t_end: 1.0,
                v_g_mean: None,
                mechanism: None,
                arrested: None,
            };
            PointRuns { point_id: point.id(), point, runs: (first..first + seeds).map(run).collect() }
        });
        made.collect()
    }

    fn of(points: &[PointRuns]) -> Monotonic {
        let along = points.iter().enumerate().map(|(k, point)| (k as f64, point)).collect();
        monotonic(&Series(along), 0.0).unwrap()
    }

    #[test]
    fn a_rise_and_a_fall_are_found_with_and_without_common_seeds() {
        for common in [true, false] {
            let mut random = ChaCha8Rng::seed_from_u64(7);
            let found = of(&points(&[5.0, 20.0, 20.0, 5.0], 60, &mut random, common));
            assert!(found.p() < 0.01, "{found:?}");
            assert_eq!((found.rise.between[0], found.fall.between[1]), (0.0, 3.0));
            let rises = of(&points(&[5.0, 10.0, 20.0, 40.0], 60, &mut random, common));
            assert!(rises.rise.p < 0.01 && rises.fall.p > 0.5, "{rises:?}");
        }
    }

    #[test]
    fn a_decay_length_that_does_not_change_is_rarely_called_a_rise() {
        for common in [false, true] {
            let mut random = ChaCha8Rng::seed_from_u64(8);
            let alarms = (0..60).filter(|_| of(&points(&[9.0; 4], 20, &mut random, common)).rise.p < 0.05).count();
            assert!(alarms <= 8, "{alarms} of 60 at 5%, common seeds: {common}");
        }
    }

    #[test]
    fn the_conditional_test_is_the_binomial_one() {
        // Of two clogs none on the half of the way: 1/4.
        let p = conditional(Total { clogs: 2.0, way: 10.0 }, Total { clogs: 0.0, way: 10.0 });
        assert!((p - 0.25).abs() < 1e-12, "{p}");
    }
}

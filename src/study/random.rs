//! Uniform draws for the bootstrap, the same on every platform.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

/// A uniform draw strictly between 0 and 1: the middle of one of 2^52 equal cells.
pub(super) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    let cell = random.next_u64() >> 12;
    (cell as f64 + 0.5) / (1_u64 << 52) as f64
}

/// A uniform draw from `0..n`, for `n > 0`.
pub(super) fn index(random: &mut ChaCha8Rng, n: usize) -> usize {
    // The product may be rounded up to n.
    ((uniform(random) * n as f64) as usize).min(n - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn draws_fill_the_open_interval_evenly() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let draws: Vec<f64> = (0..10_000).map(|_| uniform(&mut random)).collect();
        assert!(draws.iter().all(|&u| 0.0 < u && u < 1.0));
        let mean = draws.iter().sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
    }

    #[test]
    fn an_index_takes_every_value_and_no_other() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut seen = [0; 3];
        (0..3000).for_each(|_| seen[index(&mut random, 3)] += 1);
        assert!(seen.iter().all(|&n| (900..1100).contains(&n)), "{seen:?}");
    }
}

//! Boxes around blocks of eight edges, `[x_min, x_max, y_min, y_max]`. Edges in boxes far apart need not be compared.

use crate::physics::ring::Ring;
use crate::physics::simd::{LANES, padded};

pub(super) fn block_boxes(ring: &Ring) -> Vec<[f64; 4]> {
    let ends = |v: &[f64]| v.iter().fold([f64::MAX, f64::MIN], |[lo, hi], &c| [lo.min(c), hi.max(c)]);
    let block_box = |start: usize| {
        let ([x0, x1], [y0, y1]) = (ends(&ring.x[start..=start + LANES]), ends(&ring.y[start..=start + LANES]));
        [x0, x1, y0, y1]
    };
    (0..padded(ring.n)).step_by(LANES).map(block_box).collect()
}

/// Whether two boxes lie further apart than `distance`, along x or along y.
pub(super) fn lie_apart(a: [f64; 4], b: [f64; 4], distance: f64) -> bool {
    let apart = |low: usize, high: usize| a[low] > b[high] + distance || b[low] > a[high] + distance;
    apart(0, 1) || apart(2, 3)
}

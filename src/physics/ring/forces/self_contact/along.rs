//! Whether vertices and edges lie apart along the ring, eight vertices at a time.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::self_contact::apart::{Apart, WAY, places_within};
use crate::physics::simd::{load, padded};
use fearless_simd::{f64x8, mask64x8, prelude::*};

/// Positions of the vertices along the ring.
#[derive(Clone, Debug)]
pub(super) struct Along {
    /// Number of each vertex; NaN in the padding, which is never apart from an edge.
    number: Vec<f64>,
    /// Way along the ring from vertex 0 to each vertex, when it was last measured.
    pub(super) way: Vec<f64>,
    pub(super) whole_way: f64,
    /// A vertex and an edge lie apart if the way between them is longer than this.
    least_way: f64,
    /// If set, they also lie apart if their numbers differ by more than this.
    most_places: Option<f64>,
}

impl Along {
    /// For a ring of `n` vertices; its ways are not yet measured.
    pub(super) fn new(n: usize, delta: f64, apart: Apart) -> Self {
        let number = |i: usize| if i < n { i as f64 } else { f64::NAN };
        Self {
            number: (0..padded(n)).map(number).collect(),
            way: vec![f64::NAN; padded(n)],
            whole_way: 0.0,
            least_way: WAY * delta,
            most_places: (apart == Apart::Places).then(|| places_within(n, delta) as f64),
        }
    }

    pub(super) fn measure(&mut self, ring: &Ring) {
        let mut way = 0.0;
        for i in 0..ring.n {
            self.way[i] = way;
            let (ex, ey) = (ring.x[i + 1] - ring.x[i], ring.y[i + 1] - ring.y[i]);
            way += (ex * ex + ey * ey).sqrt();
        }
        self.whole_way = way;
    }

    /// Which of the eight vertices from `vertices` on lie apart from edge `j` of a ring of `n` vertices. They must lie
    /// apart from both of its ends, because a vertex next to either end is a neighbour, however long the edge is.
    #[inline(always)]
    pub(super) fn apart<S: Simd>(&self, simd: S, vertices: usize, j: usize, n: usize) -> mask64x8<S> {
        let next = if j + 1 == n { 0 } else { j + 1 };
        let way = load(simd, &self.way, vertices);
        let mut apart = farther(simd, way, self.way[j], self.whole_way, self.least_way)
            & farther(simd, way, if next == 0 { 0.0 } else { self.way[next] }, self.whole_way, self.least_way);
        if let Some(most) = self.most_places {
            let (number, round) = (load(simd, &self.number, vertices), n as f64);
            apart |= farther(simd, number, j as f64, round, most) & farther(simd, number, next as f64, round, most);
        }
        apart
    }
}

/// Which of eight places along a ring lie farther than `least` from the place `from`; once round the ring is `round`.
// No closure: code that may not be inlined is compiled without vector instructions.
#[inline(always)]
fn farther<S: Simd>(simd: S, places: f64x8<S>, from: f64, round: f64, least: f64) -> mask64x8<S> {
    let between = (places - from).abs();
    between.min(round - between).simd_gt(f64x8::splat(simd, least))
}

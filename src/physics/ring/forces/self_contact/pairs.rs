//! Which vertices and edges of a ring may touch: pairs of a block of eight vertices and an edge.

use crate::on_instruction_set;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::self_contact::SelfContact;
use crate::physics::ring::forces::self_contact::boxes::{block_boxes, lie_apart};
use crate::physics::simd::LANES;

/// Eight vertices, from `vertices` on, and an edge that one of them may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) vertices: usize,
    pub(super) edge: usize,
}

/// Where the vertices were when the list of pairs was made, relative to their mean.
#[derive(Clone, Debug)]
pub(super) struct Listed {
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
}

impl Listed {
    /// For `n` vertices, before the first list is made.
    pub(super) fn nowhere(n: usize) -> Self {
        Self { x: vec![f64::INFINITY; n], y: vec![f64::INFINITY; n] }
    }

    fn note(&mut self, ring: &Ring) {
        let [mx, my] = mean(ring);
        for i in 0..ring.n {
            (self.x[i], self.y[i]) = (ring.x[i] - mx, ring.y[i] - my);
        }
    }

    /// Twice the largest movement of a vertex since then, not counting the movement of the ring as a whole.
    pub(super) fn deformation(&self, ring: &Ring) -> f64 {
        let [mx, my] = mean(ring);
        let squared = |i: usize| {
            let (dx, dy) = (ring.x[i] - mx - self.x[i], ring.y[i] - my - self.y[i]);
            dx * dx + dy * dy
        };
        2.0 * (0..ring.n).map(squared).fold(0.0, f64::max).sqrt()
    }
}

fn mean(ring: &Ring) -> [f64; 2] {
    [&ring.x, &ring.y].map(|v| v[..ring.n].iter().sum::<f64>() / ring.n as f64)
}

impl SelfContact {
    /// Makes the list of pairs: each block of vertices with each edge that comes within delta plus skin of it.
    #[inline(never)]
    pub(super) fn list(&mut self, ring: &Ring) {
        self.near.renew(ring.origin);
        let mut pairs = std::mem::take(&mut self.near.items);
        self.listed.note(ring);
        self.along.measure(ring);
        let boxes = block_boxes(ring);
        let far = self.delta + self.near.skin.width;
        on_instruction_set!(self.instruction_set, simd => {
            for (a, &vertices) in boxes.iter().enumerate() {
                for (b, &edges) in boxes.iter().enumerate() {
                    if lie_apart(vertices, edges, far) {
                        continue;
                    }
                    for edge in b * LANES..((b + 1) * LANES).min(ring.n) {
                        if self.overlap(simd, ring, a * LANES, edge, far).is_some() {
                            pairs.push(Pair { vertices: a * LANES, edge });
                        }
                    }
                }
            }
        });
        self.near.items = pairs;
    }
}

//! Whether a ring crosses itself: what no droplet does.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::self_contact::apart::{Apart, WAY, places_within};
use crate::physics::ring::forces::self_contact::block_box;
use crate::physics::simd::{LANES, padded};

/// Whether two edges of the ring cross; those that `apart` takes for neighbours in a pile may.
pub fn crosses(ring: &Ring, delta: f64, apart: Apart) -> bool {
    let boxes: Vec<[f64; 4]> = (0..padded(ring.n)).step_by(LANES).map(|start| block_box(ring, start)).collect();
    let edge = |i: usize| [ring.x[i], ring.y[i], ring.x[i + 1], ring.y[i + 1]];
    let block = |k: usize| k * LANES..((k + 1) * LANES).min(ring.n);
    let reach = match apart {
        Apart::Way => 1,
        Apart::Places => places_within(ring.n, delta),
    };
    // Edges that all lead the same way cannot cross: told by the straight line from the first to the last.
    let straight = |a: usize, b: usize| {
        let [start, end] = [block(a).start, block(b).end];
        let (wx, wy) = (ring.x[end] - ring.x[start], ring.y[end] - ring.y[start]);
        (start..end).all(|i| {
            let [x0, y0, x1, y1] = edge(i);
            (x1 - x0) * wx + (y1 - y0) * wy > 0.0
        })
    };
    (0..boxes.len()).any(|a| {
        (a..boxes.len()).any(|b| {
            let (p, q) = (boxes[a], boxes[b]);
            let apart = p[0] > q[1] || q[0] > p[1] || p[2] > q[3] || q[2] > p[3];
            !(apart || (b <= a + 1 && straight(a, b)))
                && block(a).any(|i| {
                    let next = |j: usize| j <= i + 1 || i + ring.n - j <= 1;
                    let near = |j: usize| j <= i + reach || i + ring.n - j <= reach;
                    // Long edges are no pile.
                    let short = |j: usize| {
                        let [a, b, ..] = edge(i);
                        let [c, d, ..] = edge(j);
                        (c - a).abs().max((d - b).abs()) < WAY * delta
                    };
                    let neighbours = |j: usize| next(j) || (near(j) && short(j));
                    block(b).any(|j| !neighbours(j) && cross(edge(i), edge(j)))
                })
        })
    })
}

/// Whether two segments `[x, y, x', y']` cross properly.
fn cross(a: [f64; 4], b: [f64; 4]) -> bool {
    let side = |s: [f64; 4], x: f64, y: f64| (s[2] - s[0]) * (y - s[1]) - (s[3] - s[1]) * (x - s[0]);
    side(a, b[0], b[1]) * side(a, b[2], b[3]) < 0.0 && side(b, a[0], a[1]) * side(b, a[2], a[3]) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ring::forces::self_contact::tests::dumb_bell;

    #[test]
    fn crossing_edges_are_found() {
        assert!(!crosses(&Ring::regular(64, [0.0, 0.0], 0.5), 0.0123, Apart::Way));
        assert!(!crosses(&dumb_bell(64, 0.002), 0.0123, Apart::Way));
        assert!(crosses(&dumb_bell(64, -0.01), 0.0123, Apart::Way));
    }

    #[test]
    fn two_vertices_that_changed_places_are_found_anywhere() {
        let n = 61;
        for i in 0..n {
            let mut ring = Ring::regular(n, [0.0, 0.0], 0.5);
            ring.x.swap(i, (i + 1) % n);
            ring.y.swap(i, (i + 1) % n);
            ring.close();
            assert!(crosses(&ring, 0.0123, Apart::Way), "vertex {i}");
        }
    }
}

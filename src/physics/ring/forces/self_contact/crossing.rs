//! Whether a ring crosses itself, which no droplet does.
//!
//! Edges are examined in blocks of eight. Two blocks cannot cross if their boxes lie apart. Nor can a block cross
//! itself or the next block if all their edges lead in the same direction. The remaining blocks are compared edge by
//! edge.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::self_contact::apart::{Apart, WAY, places_within};
use crate::physics::ring::forces::self_contact::boxes::{block_boxes, lie_apart};
use crate::physics::simd::LANES;
use std::ops::Range;

/// Whether two edges of the ring cross. Edges that `apart` takes for neighbours in a pile may cross.
pub(crate) fn crosses(ring: &Ring, delta: f64, apart: Apart) -> bool {
    let boxes = block_boxes(ring);
    let pile = match apart {
        Apart::Way => 1,
        Apart::Places => places_within(ring.n, delta),
    };
    (0..boxes.len()).any(|a| {
        (a..boxes.len()).any(|b| {
            let cannot = lie_apart(boxes[a], boxes[b], 0.0) || (b <= a + 1 && is_straight(ring, a, b));
            !cannot && blocks_cross(ring, a, b, pile, delta)
        })
    })
}

fn block(ring: &Ring, k: usize) -> Range<usize> {
    k * LANES..((k + 1) * LANES).min(ring.n)
}

/// Edge `i` from end to end, `[x, y, x', y']`.
fn edge(ring: &Ring, i: usize) -> [f64; 4] {
    [ring.x[i], ring.y[i], ring.x[i + 1], ring.y[i + 1]]
}

/// Whether all edges of the blocks from `a` to `b` lead forwards along the line from the first vertex to the last.
fn is_straight(ring: &Ring, a: usize, b: usize) -> bool {
    let [start, end] = [block(ring, a).start, block(ring, b).end];
    let (wx, wy) = (ring.x[end] - ring.x[start], ring.y[end] - ring.y[start]);
    (start..end).all(|i| {
        let [x0, y0, x1, y1] = edge(ring, i);
        (x1 - x0) * wx + (y1 - y0) * wy > 0.0
    })
}

/// Whether an edge of block `a` crosses one of block `b`. Short edges at most `pile` places apart may cross, and an
/// edge cannot cross the next one.
fn blocks_cross(ring: &Ring, a: usize, b: usize, pile: usize, delta: f64) -> bool {
    block(ring, a).any(|i| {
        let within = |j: usize, places: usize| j <= i + places || i + ring.n - j <= places;
        // Long edges form no pile.
        let is_short = |j: usize| {
            let ([a, b, ..], [c, d, ..]) = (edge(ring, i), edge(ring, j));
            (c - a).abs().max((d - b).abs()) < WAY * delta
        };
        let neighbours = |j: usize| within(j, 1) || (within(j, pile) && is_short(j));
        block(ring, b).any(|j| !neighbours(j) && cross(edge(ring, i), edge(ring, j)))
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

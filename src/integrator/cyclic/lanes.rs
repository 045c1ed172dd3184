//! Most of a ring eliminated in eight chains at once, one in each lane.
//!
//! Vertices `0, L, 2L ... 7L` with `L = n/8` (rounded down) cut the ring into eight chains of L - 1 vertices. They, and the few
//! left over when 8 does not divide n, are what remains when the chains are eliminated: a ring of 8 to 15 vertices of the
//! same kind, in which vertex k stands for `kL`.

use super::block::{Block, Pivot};
use super::{Front, Solution, System, Zero};
use crate::effects::stiffness::Stiffness;
use crate::vector::LANES;
use fearless_simd::{f64x8, prelude::*};

/// What is kept of eight vertices, one of each chain: blocks `ahead`, `to_zero` and `right`, entry by entry.
type Kept = [[f64; LANES]; 12];

/// The chains of a ring, and the ring that remains of it.
#[derive(Clone, Debug)]
pub(super) struct Lanes {
    kept: Vec<Kept>,
    /// The ring that remains.
    pub(super) matrix: Stiffness,
    /// Its right sides: x and y of b, then of g.
    right: [Vec<f64>; 4],
}

/// Entries `j, L + j ... 7L + j`.
#[inline(always)]
fn gather<S: Simd>(simd: S, values: &[f64], length: usize, j: usize) -> f64x8<S> {
    let mut lanes = [0.0; LANES];
    for k in 0..LANES {
        lanes[k] = values[k * length + j];
    }
    f64x8::from_slice(simd, &lanes)
}

/// Vertices `j, L + j ... 7L + j`: their blocks and right sides.
#[inline(always)]
fn vertices<S: Simd>(simd: S, system: &System<'_>, length: usize, j: usize) -> (Pivot<f64x8<S>>, Block<f64x8<S>>) {
    let (m, [bx, by], [gx, gy]) = (system.matrix, system.b, system.g);
    let own = Pivot {
        xx: gather(simd, &m.own_xx, length, j),
        xy: gather(simd, &m.own_xy, length, j),
        yy: gather(simd, &m.own_yy, length, j),
    };
    let right = Block {
        xx: gather(simd, bx, length, j),
        xy: gather(simd, gx, length, j),
        yx: gather(simd, by, length, j),
        yy: gather(simd, gy, length, j),
    };
    (own, right)
}

/// The blocks that couple them to the next ones.
#[inline(always)]
fn edges<S: Simd>(simd: S, system: &System<'_>, length: usize, j: usize) -> Block<f64x8<S>> {
    let m = system.matrix;
    Block {
        xx: gather(simd, &m.next_xx, length, j),
        xy: gather(simd, &m.next_xy, length, j),
        yx: gather(simd, &m.next_yx, length, j),
        yy: gather(simd, &m.next_yy, length, j),
    }
}

#[inline(always)]
fn keep<S: Simd>(to: &mut [[f64; LANES]], block: Block<f64x8<S>>) {
    to[0].copy_from_slice(block.xx.as_slice());
    to[1].copy_from_slice(block.xy.as_slice());
    to[2].copy_from_slice(block.yx.as_slice());
    to[3].copy_from_slice(block.yy.as_slice());
}

#[inline(always)]
fn kept_block<S: Simd>(simd: S, from: &[[f64; LANES]]) -> Block<f64x8<S>> {
    Block {
        xx: f64x8::from_slice(simd, &from[0]),
        xy: f64x8::from_slice(simd, &from[1]),
        yx: f64x8::from_slice(simd, &from[2]),
        yy: f64x8::from_slice(simd, &from[3]),
    }
}

impl Lanes {
    /// Work space for rings of up to `n` vertices.
    pub(super) fn new(n: usize) -> Self {
        let rest = || vec![0.0; 2 * LANES];
        Self {
            kept: vec![[[0.0; LANES]; 12]; n / LANES],
            matrix: Stiffness::new(2 * LANES),
            right: [rest(), rest(), rest(), rest()],
        }
    }

    /// The system that remains.
    pub(super) fn system(&self) -> System<'_> {
        let [bx, by, gx, gy] = &self.right;
        System { matrix: &self.matrix, b: [bx, by], g: [gx, gy] }
    }

    /// Eliminates the chains of a ring of `n >= 16` vertices; false if it met no positive pivot.
    #[inline(always)]
    pub(super) fn reduce<S: Simd>(&mut self, simd: S, system: &System<'_>, n: usize) -> bool {
        let length = n / LANES;
        let zero = f64x8::splat(simd, 0.0);
        let nothing = (Pivot { xx: zero, xy: zero, yy: zero }, Block { xx: zero, xy: zero, yx: zero, yy: zero });
        let (pivot, right) = vertices(simd, system, length, 1);
        let mut front = Front { pivot, right, to_zero: edges(simd, system, length, 0) };
        let (pivot, right) = vertices(simd, system, length, 0);
        let mut first = Zero { pivot, right, positive: true };
        for j in 1..length {
            // The vertex behind the chain is another's first: what is taken off it is added there.
            let next = if j + 1 < length { vertices(simd, system, length, j + 1) } else { nothing };
            let (on, row) = front.eliminate(edges(simd, system, length, j), next, &mut first);
            front = on;
            let kept = &mut self.kept[j];
            keep(&mut kept[0..4], row.ahead);
            keep(&mut kept[4..8], row.to_zero);
            keep(&mut kept[8..12], row.right);
        }
        self.remains(system, n, first, front);
        first.positive
    }

    /// Puts the ring together that remains, from the first vertices of the chains and what was taken off those behind them.
    #[inline(always)]
    fn remains<S: Simd>(&mut self, system: &System<'_>, n: usize, first: Zero<f64x8<S>>, behind: Front<f64x8<S>>) {
        let (length, m) = (n / LANES, &mut self.matrix);
        m.n = n - LANES * (length - 1);
        let lane = |entry: f64x8<S>, k: usize| entry.as_slice()[k];
        for k in 0..m.n {
            let (own, right, next) = if k < LANES {
                let own =
                    Pivot { xx: lane(first.pivot.xx, k), xy: lane(first.pivot.xy, k), yy: lane(first.pivot.yy, k) };
                let [right, next] = [first.right, behind.to_zero].map(|b| Block {
                    xx: lane(b.xx, k),
                    xy: lane(b.xy, k),
                    yx: lane(b.yx, k),
                    yy: lane(b.yy, k),
                });
                (own, right, next)
            } else {
                let left_over = k + LANES * (length - 1);
                let (own, right) = system.vertex(left_over);
                (own, right, system.edge(left_over))
            };
            (m.own_xx[k], m.own_xy[k], m.own_yy[k]) = (own.xx, own.xy, own.yy);
            (m.next_xx[k], m.next_xy[k], m.next_yx[k], m.next_yy[k]) = (next.xx, next.xy, next.yx, next.yy);
            let [bx, by, gx, gy] = &mut self.right;
            (bx[k], by[k], gx[k], gy[k]) = (right.xx, right.yx, right.xy, right.yy);
        }
        for k in 0..LANES {
            let to = (k + 1) % m.n;
            m.own_xx[to] += lane(behind.pivot.xx, k);
            m.own_xy[to] += lane(behind.pivot.xy, k);
            m.own_yy[to] += lane(behind.pivot.yy, k);
            let [bx, by, gx, gy] = &mut self.right;
            bx[to] += lane(behind.right.xx, k);
            by[to] += lane(behind.right.yx, k);
            gx[to] += lane(behind.right.xy, k);
            gy[to] += lane(behind.right.yy, k);
        }
    }

    /// The solution of the whole ring from that of the ring that remains, back along the chains; both by vertex.
    #[inline(always)]
    pub(super) fn substitute<S: Simd>(&self, simd: S, n: usize, rest: &[Block<f64>], solved: &mut Solution) {
        let length = n / LANES;
        // The solutions at the first vertices of the chains, and at those behind them.
        let mut ends = [[[0.0; LANES]; 4]; 2];
        for (shift, end) in ends.iter_mut().enumerate() {
            for k in 0..LANES {
                let at = rest[(k + shift) % rest.len()];
                (end[0][k], end[1][k], end[2][k], end[3][k]) = (at.xx, at.xy, at.yx, at.yy);
            }
        }
        let (at_first, mut next) = (kept_block(simd, &ends[0]), kept_block(simd, &ends[1]));
        for j in (1..length).rev() {
            let kept = &self.kept[j];
            let (ahead, to_zero) = (kept_block(simd, &kept[0..4]), kept_block(simd, &kept[4..8]));
            next = kept_block(simd, &kept[8..12]) - to_zero * at_first - ahead * next;
            let entries = [
                (next.xx, &mut solved.xx),
                (next.xy, &mut solved.xy),
                (next.yx, &mut solved.yx),
                (next.yy, &mut solved.yy),
            ];
            for (values, to) in entries {
                for (k, &value) in values.as_slice().iter().enumerate() {
                    to[k * length + j] = value;
                }
            }
        }
        for (k, solution) in rest.iter().enumerate() {
            let vertex = if k < LANES { k * length } else { k + LANES * (length - 1) };
            solved.set(vertex, *solution);
        }
    }
}

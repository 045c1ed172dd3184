//! Eliminates most of a long ring in eight chains at once, one in each lane.
//!
//! Vertices `0, L, 2L ... 7L` with `L = n/8` (rounded down) cut the ring into eight chains of L - 1 vertices. When the
//! chains are eliminated, these eight vertices remain, and the few left over if 8 does not divide n. They form a ring
//! of 8 to 15 vertices with a matrix of the same form, in which vertex k stands for `kL`.

use crate::physics::motion::implicit::cyclic::block::{Block, Pivot};
use crate::physics::motion::implicit::cyclic::chains::{Line, by_vertex, side_by_side};
use crate::physics::motion::implicit::cyclic::elimination::{Front, System, Zero};
use crate::physics::motion::implicit::cyclic::solution::Solution;
use crate::physics::ring::forces::stiffness::Stiffness;
use crate::physics::simd::{Instructions, LANES, load, store};
use fearless_simd::{f64x8, prelude::*};

/// What is read of eight vertices, one of each chain: diagonal blocks (3 numbers), right sides (4), and the blocks that
/// couple them to the next vertices (4).
type Read = [Line; 11];

/// The blocks `ahead`, `to_zero` and `right` of eight eliminated vertices. In the end `right` holds the solution.
type Kept = [Line; 12];

/// The chains of a ring, and the ring that remains of it.
#[derive(Clone, Debug)]
pub(super) struct Lanes {
    kept: Vec<Kept>,
    pub(super) matrix: Stiffness,
    /// Its right sides: x and y of b, then of g.
    right: [Vec<f64>; 4],
}

#[inline(always)]
fn block<S: Instructions>(simd: S, from: &[Line]) -> Block<f64x8<S>> {
    Block {
        xx: load(simd, &from[0].0, 0),
        xy: load(simd, &from[1].0, 0),
        yx: load(simd, &from[2].0, 0),
        yy: load(simd, &from[3].0, 0),
    }
}

#[inline(always)]
fn lane<S: Instructions>(entry: f64x8<S>, k: usize) -> f64 {
    entry.as_slice()[k]
}

#[inline(always)]
fn keep<S: Instructions>(to: &mut [Line], block: Block<f64x8<S>>) {
    store(block.xx, &mut to[0].0, 0);
    store(block.xy, &mut to[1].0, 0);
    store(block.yx, &mut to[2].0, 0);
    store(block.yy, &mut to[3].0, 0);
}

/// Reads up to eight rows from row `from` on.
#[inline(always)]
fn read_rows<S: Instructions>(simd: S, system: &System<'_>, length: usize, from: usize, read: &mut [Read; LANES]) {
    let (m, [bx, by], [gx, gy]) = (system.matrix, system.b, system.g);
    let columns: [&[f64]; 11] =
        [&m.own_xx, &m.own_xy, &m.own_yy, bx, gx, by, gy, &m.next_xx, &m.next_xy, &m.next_yx, &m.next_yy];
    for column in 0..columns.len() {
        side_by_side(simd, columns[column], length, from, read, column);
    }
}

/// The diagonal blocks and right sides of eight vertices.
#[inline(always)]
fn vertices<S: Instructions>(simd: S, read: &Read) -> (Pivot<f64x8<S>>, Block<f64x8<S>>) {
    let own = Pivot { xx: load(simd, &read[0].0, 0), xy: load(simd, &read[1].0, 0), yy: load(simd, &read[2].0, 0) };
    (own, block(simd, &read[3..7]))
}

/// The blocks that couple eight vertices to the next ones.
#[inline(always)]
fn edges<S: Instructions>(simd: S, read: &Read) -> Block<f64x8<S>> {
    block(simd, &read[7..11])
}

impl Lanes {
    pub(super) fn new(n: usize) -> Self {
        let rest = || vec![0.0; 2 * LANES];
        Self {
            kept: vec![[Line::default(); 12]; n / LANES],
            matrix: Stiffness::new(2 * LANES),
            right: [rest(), rest(), rest(), rest()],
        }
    }

    pub(super) fn system(&self) -> System<'_> {
        let [bx, by, gx, gy] = &self.right;
        System { matrix: &self.matrix, b: [bx, by], g: [gx, gy] }
    }

    /// Eliminates the chains of a ring of `n >= 16` vertices. Returns how many of their eigenvalues are
    /// negative.
    #[inline(always)]
    pub(super) fn reduce<S: Instructions>(&mut self, simd: S, system: &System<'_>, n: usize) -> usize {
        let length = n / LANES;
        let mut read = [[Line::default(); 11]; LANES];
        read_rows(simd, system, length, 0, &mut read);
        let (pivot, right) = vertices(simd, &read[0]);
        let mut first = Zero { pivot, right, negative: 0 };
        let (pivot, right) = vertices(simd, &read[1]);
        let mut front = Front { pivot, right, to_zero: edges(simd, &read[0]) };
        let mut edge = edges(simd, &read[1]);
        for j in 2..length {
            if j % LANES == 0 {
                read_rows(simd, system, length, j, &mut read);
            }
            let read = &read[j % LANES];
            front = self.eliminate(j - 1, front, edge, vertices(simd, read), &mut first);
            edge = edges(simd, read);
        }
        // The vertex behind a chain is the first of the next chain. Its changes are collected here and added there
        // later.
        let zero = f64x8::splat(simd, 0.0);
        let nothing = (Pivot { xx: zero, xy: zero, yy: zero }, Block { xx: zero, xy: zero, yx: zero, yy: zero });
        front = self.eliminate(length - 1, front, edge, nothing, &mut first);
        self.remains(system, n, first, front);
        first.negative
    }

    /// Eliminates the vertices of row `j`, and keeps what the way back needs.
    #[inline(always)]
    fn eliminate<S: Instructions>(
        &mut self,
        j: usize,
        front: Front<f64x8<S>>,
        edge: Block<f64x8<S>>,
        next: (Pivot<f64x8<S>>, Block<f64x8<S>>),
        first: &mut Zero<f64x8<S>>,
    ) -> Front<f64x8<S>> {
        let (front, row) = front.eliminate(edge, next, first);
        let kept = &mut self.kept[j];
        keep(&mut kept[0..4], row.ahead);
        keep(&mut kept[4..8], row.to_zero);
        keep(&mut kept[8..12], row.right);
        front
    }

    /// Puts together the ring that remains, from the first vertices of the chains and the changes of the vertices
    /// behind them.
    #[inline(always)]
    fn remains<S: Instructions>(
        &mut self,
        system: &System<'_>,
        n: usize,
        first: Zero<f64x8<S>>,
        behind: Front<f64x8<S>>,
    ) {
        let (length, m) = (n / LANES, &mut self.matrix);
        m.n = n - LANES * (length - 1);
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
        self.add_behind(behind);
    }

    /// Adds the changes of the vertices behind the chains; each is the first vertex of the next chain.
    #[inline(always)]
    fn add_behind<S: Instructions>(&mut self, behind: Front<f64x8<S>>) {
        let m = &mut self.matrix;
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

    /// The solution of the whole ring, from the solution `rest` of the ring that remains, back along the chains.
    #[inline(always)]
    pub(super) fn substitute<S: Instructions>(
        &mut self,
        simd: S,
        n: usize,
        rest: &[Block<f64>],
        solved: &mut Solution,
    ) {
        let length = n / LANES;
        // The solutions at the first vertices of the chains, and at those behind them.
        let mut ends = [[Line::default(); 4]; 2];
        for (shift, end) in ends.iter_mut().enumerate() {
            for k in 0..LANES {
                let at = rest[(k + shift) % rest.len()];
                (end[0].0[k], end[1].0[k], end[2].0[k], end[3].0[k]) = (at.xx, at.xy, at.yx, at.yy);
            }
        }
        let (at_first, mut next) = (block(simd, &ends[0]), block(simd, &ends[1]));
        for j in (1..length).rev() {
            let kept = &mut self.kept[j];
            let (ahead, to_zero) = (block(simd, &kept[0..4]), block(simd, &kept[4..8]));
            next = block(simd, &kept[8..12]).less(to_zero, at_first).less(ahead, next);
            keep(&mut kept[8..12], next);
        }
        let kept = &self.kept[..length];
        by_vertex(simd, kept, 8, &mut solved.xx);
        by_vertex(simd, kept, 9, &mut solved.xy);
        by_vertex(simd, kept, 10, &mut solved.yx);
        by_vertex(simd, kept, 11, &mut solved.yy);
        for (k, solution) in rest.iter().enumerate() {
            let vertex = if k < LANES { k * length } else { k + LANES * (length - 1) };
            solved.set(vertex, *solution);
        }
    }
}

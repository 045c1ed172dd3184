//! Second derivatives of the energy of a ring: a symmetric matrix that couples each vertex to its two neighbours.
//!
//! It is cyclic block-tridiagonal with 2 x 2 blocks. Block `(i, i)` is symmetric; block `(i, i + 1)` is not, and block
//! `(i + 1, i)` is its transpose. The area's `K_a grad a grad a^T`, which couples all vertices, is kept apart.
//!
//! # Writing your own
//! An effect adds its second derivatives, or an upper bound of them, in
//! [`RingForce::add_stiffness`](crate::physics::ring::forces::RingForce::add_stiffness). The matrix cannot hold the
//! coupling of vertices u and w that are not neighbours, but it can hold the bound
//! `k (u - w)(u - w)^T <= 2k (u u^T + w w^T)`.

use crate::physics::simd::{LANES, aligned::Aligned, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

/// Which parts of the second derivatives are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parts {
    /// All: Newton's method then converges quadratically.
    All,
    /// Only parts that are positive semi-definite, without compressed edges and the turning of normals.
    Positive,
}

/// The matrix, an array for each entry of a block.
#[derive(Clone, Debug)]
pub struct Stiffness {
    pub(crate) n: usize,
    // Block `(i, i)`, `padded(n) + 8` long; entry `n` is to be added to vertex 0.
    pub(crate) own_xx: Aligned,
    pub(crate) own_xy: Aligned,
    pub(crate) own_yy: Aligned,
    // Block `(i, i + 1)`, `padded(n) + 8` long; rows belong to vertex i, columns to vertex i + 1.
    pub(crate) next_xx: Aligned,
    pub(crate) next_xy: Aligned,
    pub(crate) next_yx: Aligned,
    pub(crate) next_yy: Aligned,
}

impl Stiffness {
    pub(crate) fn new(n: usize) -> Self {
        let zeros = || Aligned::zeros(padded(n) + LANES);
        Self {
            n,
            own_xx: zeros(),
            own_xy: zeros(),
            own_yy: zeros(),
            next_xx: zeros(),
            next_xy: zeros(),
            next_yx: zeros(),
            next_yy: zeros(),
        }
    }

    /// Adds entry `n` to vertex 0.
    pub(crate) fn fold(&mut self) {
        for own in [&mut self.own_xx, &mut self.own_xy, &mut self.own_yy] {
            own[0] += own[self.n];
            own[self.n] = 0.0;
        }
    }
}

/// Second derivatives of the energies of eight edges, each with respect to its two vertices.
#[derive(Clone, Copy)]
pub(crate) struct EdgeBlocks<S: Simd> {
    /// First vertex with itself: xx, xy, yy.
    pub(crate) first: [f64x8<S>; 3],
    /// First vertex (rows) with second (columns): xx, xy, yx, yy.
    pub(crate) between: [f64x8<S>; 4],
    /// Second vertex with itself: xx, xy, yy.
    pub(crate) second: [f64x8<S>; 3],
}

impl<S: Simd> EdgeBlocks<S> {
    /// Adds the blocks of the edges `i..i + 8`.
    #[inline(always)]
    pub(crate) fn add_to(self, simd: S, stiffness: &mut Stiffness, i: usize) {
        let add = |values: &mut [f64], at: usize, term: f64x8<S>| store(load(simd, values, at) + term, values, at);
        let Stiffness { own_xx, own_xy, own_yy, next_xx, next_xy, next_yx, next_yy, .. } = stiffness;
        for (own, k) in [own_xx, own_xy, own_yy].into_iter().zip(0..3) {
            add(own, i, self.first[k]);
            add(own, i + 1, self.second[k]);
        }
        for (next, k) in [next_xx, next_xy, next_yx, next_yy].into_iter().zip(0..4) {
            add(next, i, self.between[k]);
        }
    }
}

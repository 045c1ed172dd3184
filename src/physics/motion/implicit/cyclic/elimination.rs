//! How one vertex, or eight at once, is eliminated, and the system that is solved.

use crate::physics::motion::implicit::cyclic::block::{Block, Number, Pivot};
use crate::physics::ring::forces::stiffness::Stiffness;

/// What the way back needs of an eliminated vertex: G, H and Y of the [module](super). The first column of a right side
/// belongs to `b`, the second to `g`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row<T> {
    pub(super) ahead: Block<T>,
    pub(super) to_zero: Block<T>,
    pub(super) right: Block<T>,
}

/// The vertex of a chain that is eliminated next.
#[derive(Clone, Copy)]
pub(super) struct Front<T> {
    /// Its diagonal block, changed by earlier eliminations.
    pub(super) pivot: Pivot<T>,
    /// Its right sides, changed by earlier eliminations.
    pub(super) right: Block<T>,
    /// C, the coupling of vertex 0 to it.
    pub(super) to_zero: Block<T>,
}

/// Vertex 0 while the chains are eliminated.
#[derive(Clone, Copy)]
pub(super) struct Zero<T> {
    pub(super) pivot: Pivot<T>,
    pub(super) right: Block<T>,
    /// How many eigenvalues of the pivots so far are negative: as many as of the matrix that they make up (Sylvester).
    pub(super) negative: usize,
}

impl<T: Number> Front<T> {
    /// Eliminates the vertex. `edge` couples it to the next one, whose diagonal block and right sides are `next`.
    #[inline(always)]
    pub(super) fn eliminate(self, edge: Block<T>, next: (Pivot<T>, Block<T>), zero: &mut Zero<T>) -> (Self, Row<T>) {
        let (inverse, negative) = self.pivot.inverse();
        let row =
            Row { ahead: inverse * edge, to_zero: inverse * self.to_zero.transposed(), right: inverse * self.right };
        zero.negative += negative;
        zero.pivot = zero.pivot.less(self.to_zero, row.to_zero);
        zero.right = zero.right.less(self.to_zero, row.right);
        let back = edge.transposed();
        let front = Self {
            pivot: next.0.less(back, row.ahead),
            right: next.1.less(back, row.right),
            to_zero: -(self.to_zero * row.ahead),
        };
        (front, row)
    }
}

pub(super) struct System<'a> {
    pub(super) matrix: &'a Stiffness,
    pub(super) b: [&'a [f64]; 2],
    pub(super) g: [&'a [f64]; 2],
}

impl System<'_> {
    #[inline(always)]
    pub(super) fn vertex(&self, i: usize) -> (Pivot<f64>, Block<f64>) {
        let m = self.matrix;
        let own = Pivot { xx: m.own_xx[i], xy: m.own_xy[i], yy: m.own_yy[i] };
        (own, Block { xx: self.b[0][i], xy: self.g[0][i], yx: self.b[1][i], yy: self.g[1][i] })
    }

    /// Block `(i, i + 1)`.
    #[inline(always)]
    pub(super) fn edge(&self, i: usize) -> Block<f64> {
        let m = self.matrix;
        Block { xx: m.next_xx[i], xy: m.next_xy[i], yx: m.next_yx[i], yy: m.next_yy[i] }
    }
}

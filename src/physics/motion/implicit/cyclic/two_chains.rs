//! Eliminates a short ring, or what remains of a long one, in two chains at once.
//!
//! Vertices 0 and `h = n/2` cut the ring into two chains. Both are eliminated from vertex 0 towards `h` at the same
//! time, which halves the latency of the recursion. The solution is then substituted back from h.

use crate::physics::motion::implicit::cyclic::block::{Block, Pivot};
use crate::physics::motion::implicit::cyclic::elimination::{Front, Row, System, Zero};

/// Solves the systems without the term of rank one.
#[derive(Clone, Debug)]
pub(super) struct RingSolver {
    rows: Vec<Row<f64>>,
}

impl RingSolver {
    /// Work space for rings of up to `n` vertices.
    pub(super) fn new(n: usize) -> Self {
        Self { rows: vec![Row::default(); n] }
    }

    /// How many eigenvalues of B are negative, and the rows by vertex, whose right sides are the solutions for b and g.
    pub(super) fn solve(&mut self, system: &System<'_>) -> (usize, &[Row<f64>]) {
        let (n, half) = (system.matrix.n, system.matrix.n / 2);
        let (negative, ends) = self.eliminate(system, n, half);
        self.substitute(n, half, ends);
        (negative, &self.rows[..n])
    }

    /// Eliminates both chains, then vertex h. Returns how many eigenvalues are negative, and the solution at vertices 0
    /// and h.
    #[inline(always)]
    fn eliminate(&mut self, system: &System<'_>, n: usize, half: usize) -> (usize, [Block<f64>; 2]) {
        let rows = &mut self.rows[..n];
        let front = |i: usize, to_zero: Block<f64>| {
            let (pivot, right) = system.vertex(i);
            Front { pivot, right, to_zero }
        };
        let (pivot, right) = system.vertex(0);
        let mut zero = Zero { pivot, right, negative: 0 };
        let mut up = front(1, system.edge(0));
        let mut down = front(n - 1, system.edge(n - 1).transposed());
        // Vertices 1, 2 ... h - 1 and n - 1, n - 2 ... h + 1; for odd n the second chain is longer by one.
        for k in 1..half {
            (up, rows[k]) = up.eliminate(system.edge(k), system.vertex(k + 1), &mut zero);
            let v = n - k;
            (down, rows[v]) = down.eliminate(system.edge(v - 1).transposed(), system.vertex(v - 1), &mut zero);
        }
        if n % 2 == 1 {
            let v = half + 1;
            (down, rows[v]) = down.eliminate(system.edge(half).transposed(), system.vertex(half), &mut zero);
        }
        // Both fronts now hold vertex h, each changed by its own chain. Add the two changes.
        let (own, right) = system.vertex(half);
        let last = Front {
            pivot: Pivot {
                xx: up.pivot.xx + (down.pivot.xx - own.xx),
                xy: up.pivot.xy + (down.pivot.xy - own.xy),
                yy: up.pivot.yy + (down.pivot.yy - own.yy),
            },
            right: down.right - (right - up.right),
            to_zero: up.to_zero - (-down.to_zero),
        };
        let nothing = (Pivot::default(), Block::default());
        let (_, row) = last.eliminate(Block::default(), nothing, &mut zero);
        let (inverse, negative) = zero.pivot.inverse();
        let at_zero = inverse * zero.right;
        (zero.negative + negative, [at_zero, row.right.less(row.to_zero, at_zero)])
    }

    /// Replaces the right sides by the solution, from vertex h back to vertex 0 along both chains.
    #[inline(always)]
    fn substitute(&mut self, n: usize, half: usize, [at_zero, at_half]: [Block<f64>; 2]) {
        let rows = &mut self.rows[..n];
        rows[0].right = at_zero;
        rows[half].right = at_half;
        let mut back = |v: usize, next: Block<f64>| {
            let row = &mut rows[v];
            row.right = row.right.less(row.to_zero, at_zero).less(row.ahead, next);
            row.right
        };
        let (mut up, mut down) = (at_half, at_half);
        if n % 2 == 1 {
            down = back(half + 1, down);
        }
        for k in (1..half).rev() {
            up = back(k, up);
            down = back(n - k, down);
        }
    }
}

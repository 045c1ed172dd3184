//! Solves `(B + k g g^T) x = b` for a cyclic block-tridiagonal `B` of 2 x 2 blocks, symmetric and positive definite, in O(n).
//!
//! Vertices 0 and `h = n/2` cut the ring into two chains. Both are eliminated at once from vertex 0 towards `h`, which
//! halves the latency of the recursion. Eliminating vertex `v` before its neighbour `w`, with `E = B_vw` and `C` the
//! coupling of vertex 0 to `v` that earlier eliminations left behind,
//!
//! ```text
//! G = D_v^-1 E,   H = D_v^-1 C^T,   Y = D_v^-1 b_v
//! D_w -= E^T G,   b_w -= E^T Y,     C <- -C G,     D_0 -= C H,   b_0 -= C Y
//! ```
//!
//! leaves a system of vertices 0 and `h`, and `x_v = Y - H x_0 - G x_w` on the way back. A long ring is first cut into eight chains, which
//! are eliminated in eight lanes ([`lanes`]) by the same formulas. The term of rank one is dealt with by
//! Sherman and Morrison: `x = y - z k (g y)/(1 + k g z)` with `B y = b`, `B z = g` solved for together.

mod block;
mod chains;
mod lanes;

use crate::on_instruction_set;
use crate::physics::ring::forces::stiffness::Stiffness;
use crate::physics::simd::InstructionSet;
use crate::physics::simd::aligned::Aligned;
use crate::physics::simd::{Instructions, LANES, fma, load, store, sum_lanes};
use block::{Block, Number, Pivot};
use fearless_simd::{f64x8, prelude::*};
use lanes::Lanes;

/// Fewest vertices of a ring that is cut into eight chains.
const LONG: usize = 4 * LANES;

/// One vertex, or eight, eliminated. Right sides are the columns of a block: x and y of `b` in the first, of `g` in the second.
#[derive(Clone, Copy, Debug, Default)]
struct Row<T> {
    ahead: Block<T>,
    to_zero: Block<T>,
    right: Block<T>,
}

/// The matrix met no positive pivot: it is not positive definite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix of the implicit step is not positive definite; leave out the negative parts or shorten the step")]
pub struct NotPositiveDefinite;

/// Work space for rings of up to `n` vertices.
#[derive(Clone, Debug)]
pub struct CyclicSolver {
    ring: RingSolver,
    lanes: Lanes,
    solved: Solution,
}

/// A chain on its way from vertex 0 to vertex h.
#[derive(Clone, Copy)]
struct Front<T> {
    /// Diagonal block of the vertex that comes next, less what was eliminated.
    pivot: Pivot<T>,
    /// Its right sides.
    right: Block<T>,
    /// Coupling of vertex 0 to it.
    to_zero: Block<T>,
}

/// Vertex 0 while the chains are eliminated.
#[derive(Clone, Copy)]
struct Zero<T> {
    pivot: Pivot<T>,
    right: Block<T>,
    positive: bool,
}

impl<T: Number> Front<T> {
    /// Eliminates its vertex; `edge` couples that to the next one, whose own block and right sides are given.
    #[inline(always)]
    fn eliminate(self, edge: Block<T>, next: (Pivot<T>, Block<T>), zero: &mut Zero<T>) -> (Self, Row<T>) {
        let (inverse, positive) = self.pivot.inverse();
        let row =
            Row { ahead: inverse * edge, to_zero: inverse * self.to_zero.transposed(), right: inverse * self.right };
        zero.positive &= positive;
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

/// The system as the elimination reads it.
struct System<'a> {
    matrix: &'a Stiffness,
    b: [&'a [f64]; 2],
    g: [&'a [f64]; 2],
}

impl System<'_> {
    #[inline(always)]
    fn vertex(&self, i: usize) -> (Pivot<f64>, Block<f64>) {
        let m = self.matrix;
        let own = Pivot { xx: m.own_xx[i], xy: m.own_xy[i], yy: m.own_yy[i] };
        (own, Block { xx: self.b[0][i], xy: self.g[0][i], yx: self.b[1][i], yy: self.g[1][i] })
    }

    /// Block `(i, i + 1)`.
    #[inline(always)]
    fn edge(&self, i: usize) -> Block<f64> {
        let m = self.matrix;
        Block { xx: m.next_xx[i], xy: m.next_xy[i], yx: m.next_yx[i], yy: m.next_yy[i] }
    }
}

impl CyclicSolver {
    /// Work space for `n >= 3` vertices.
    pub fn new(n: usize) -> Self {
        let ring = RingSolver { rows: vec![Row::default(); n.max(2 * LANES)] };
        Self { ring, lanes: Lanes::new(n), solved: Solution::new(n) }
    }

    /// Overwrites `b` by the solution x of `(B + k g g^T) x = b`, for `k >= 0`; entries from `n` on are left alone.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`], with `b` untouched.
    pub fn solve(
        &mut self,
        instruction_set: InstructionSet,
        matrix: &Stiffness,
        k: f64,
        g: [&[f64]; 2],
        b: [&mut [f64]; 2],
    ) -> Result<(), NotPositiveDefinite> {
        let n = matrix.n;
        let [bx, by] = b;
        let system = System { matrix, b: [&*bx, &*by], g };
        let solved = &mut self.solved;
        if n < LONG {
            self.ring.solve(&system)?.iter().enumerate().for_each(|(vertex, row)| solved.set(vertex, row.right));
        } else {
            let (lanes, mut rest) = (&mut self.lanes, [Block::default(); 2 * LANES]);
            if !on_instruction_set!(instruction_set, simd => lanes.reduce(simd, &system, n)) {
                return Err(NotPositiveDefinite);
            }
            let rest = &mut rest[..lanes.matrix.n];
            let solution = self.ring.solve(&lanes.system())?;
            rest.iter_mut().zip(solution).for_each(|(rest, row)| *rest = row.right);
            on_instruction_set!(instruction_set, simd => lanes.substitute(simd, n, rest, solved));
        }
        on_instruction_set!(instruction_set, simd => solved.combine(simd, n, k, g, [bx, by]));
        Ok(())
    }
}

/// Solutions for b and g: entries of the blocks by vertex.
#[derive(Clone, Debug)]
struct Solution {
    xx: Aligned,
    xy: Aligned,
    yx: Aligned,
    yy: Aligned,
}

impl Solution {
    fn new(n: usize) -> Self {
        let zeros = || Aligned::zeros(n);
        Self { xx: zeros(), xy: zeros(), yx: zeros(), yy: zeros() }
    }

    #[inline(always)]
    fn set(&mut self, vertex: usize, block: Block<f64>) {
        self.xx[vertex] = block.xx;
        self.xy[vertex] = block.xy;
        self.yx[vertex] = block.yx;
        self.yy[vertex] = block.yy;
    }

    /// The solution with the term of rank one, into `b`.
    #[inline(always)]
    fn combine<S: Instructions>(&self, simd: S, n: usize, k: f64, g: [&[f64]; 2], b: [&mut [f64]; 2]) {
        let [bx, by] = b;
        let zero = f64x8::splat(simd, 0.0);
        let (mut along, mut own) = (zero, zero);
        let whole = n / LANES * LANES;
        for i in (0..whole).step_by(LANES) {
            let (gx, gy) = (load(simd, g[0], i), load(simd, g[1], i));
            along = fma(gx, load(simd, &self.xx, i), fma(gy, load(simd, &self.yx, i), along));
            own = fma(gx, load(simd, &self.xy, i), fma(gy, load(simd, &self.yy, i), own));
        }
        let (mut along, mut own) = (sum_lanes(along), sum_lanes(own));
        for i in whole..n {
            along += g[0][i] * self.xx[i] + g[1][i] * self.yx[i];
            own += g[0][i] * self.xy[i] + g[1][i] * self.yy[i];
        }
        let share = k * along / (1.0 + k * own);
        for i in (0..whole).step_by(LANES) {
            store(load(simd, &self.xx, i) - load(simd, &self.xy, i) * share, bx, i);
            store(load(simd, &self.yx, i) - load(simd, &self.yy, i) * share, by, i);
        }
        for i in whole..n {
            bx[i] = self.xx[i] - share * self.xy[i];
            by[i] = self.yx[i] - share * self.yy[i];
        }
    }
}

/// Solves with B alone, for a whole ring or for what remains of a long one.
#[derive(Clone, Debug)]
struct RingSolver {
    rows: Vec<Row<f64>>,
}

impl RingSolver {
    /// The rows by vertex, with the solutions for b and g as right sides.
    fn solve(&mut self, system: &System<'_>) -> Result<&[Row<f64>], NotPositiveDefinite> {
        let (n, half) = (system.matrix.n, system.matrix.n / 2);
        let ends = self.eliminate(system, n, half).ok_or(NotPositiveDefinite)?;
        self.substitute(n, half, ends);
        Ok(&self.rows[..n])
    }

    /// Eliminates both chains, then vertex h; returns the solution at vertices 0 and h.
    #[inline(always)]
    fn eliminate(&mut self, system: &System<'_>, n: usize, half: usize) -> Option<[Block<f64>; 2]> {
        let rows = &mut self.rows[..n];
        let front = |i: usize, to_zero: Block<f64>| {
            let (pivot, right) = system.vertex(i);
            Front { pivot, right, to_zero }
        };
        let (pivot, right) = system.vertex(0);
        let mut zero = Zero { pivot, right, positive: true };
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
        // Both fronts now hold vertex h, each with its own chain taken off: add up what they took.
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
        let (inverse, positive) = zero.pivot.inverse();
        let at_zero = inverse * zero.right;
        (zero.positive && positive).then(|| [at_zero, row.right.less(row.to_zero, at_zero)])
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// Random entries in [-1, 1], the diagonal shifted by `shift`.
    fn matrix(n: usize, shift: f64, mut entry: impl FnMut() -> f64) -> Stiffness {
        let mut m = Stiffness::new(n);
        for i in 0..n {
            m.own_xx[i] = shift + entry();
            m.own_xy[i] = entry();
            m.own_yy[i] = shift + entry();
            for next in [&mut m.next_xx, &mut m.next_xy, &mut m.next_yx, &mut m.next_yy] {
                next[i] = entry();
            }
        }
        m
    }

    /// The dense matrix, row `2i` for x of vertex i and `2i + 1` for y.
    fn dense(m: &Stiffness, k: f64, g: [&[f64]; 2]) -> DMatrix<f64> {
        let n = m.n;
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        for i in 0..n {
            let j = (i + 1) % n;
            a[(2 * i, 2 * i)] += m.own_xx[i];
            a[(2 * i, 2 * i + 1)] += m.own_xy[i];
            a[(2 * i + 1, 2 * i)] += m.own_xy[i];
            a[(2 * i + 1, 2 * i + 1)] += m.own_yy[i];
            let between = [[m.next_xx[i], m.next_xy[i]], [m.next_yx[i], m.next_yy[i]]];
            for (r, c) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                a[(2 * i + r, 2 * j + c)] += between[r][c];
                a[(2 * j + c, 2 * i + r)] += between[r][c];
            }
        }
        let v = DVector::from_fn(2 * n, |row, _| g[row % 2][row / 2]);
        a + k * &v * v.transpose()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn the_solution_is_that_of_dense_elimination(
            n in 3_usize..=70, k in prop_oneof![Just(0.0), 0.0..1e6_f64],
            numbers in proptest::collection::vec(-1.0..1.0_f64, 11 * 70),
        ) {
            let mut numbers = numbers.into_iter();
            let mut entry = || numbers.next().unwrap();
            let m = matrix(n, 5.5, &mut entry);
            let mut vector = || -> Vec<f64> { (0..n).map(|_| entry()).collect() };
            let (gx, gy, bx, by) = (vector(), vector(), vector(), vector());
            let (mut x, mut y) = (bx.clone(), by.clone());
            CyclicSolver::new(n).solve(InstructionSet::new(), &m, k, [&gx, &gy], [&mut x, &mut y]).unwrap();
            let a = dense(&m, k, [&gx, &gy]);
            let b = DVector::from_fn(2 * n, |row, _| [&bx, &by][row % 2][row / 2]);
            let got = DVector::from_fn(2 * n, |row, _| [&x, &y][row % 2][row / 2]);
            let want = a.clone().lu().solve(&b).unwrap();
            prop_assert!((&got - &want).norm() < 1e-10 * want.norm());
            prop_assert!((&a * &got - &b).norm() < 1e-10 * (a.norm() * got.norm() + b.norm()));
        }

        #[test]
        fn a_matrix_is_refused_exactly_if_it_has_a_negative_eigenvalue(
            n in 3_usize..=12, shift in 0.0..5.0_f64,
            numbers in proptest::collection::vec(-1.0..1.0_f64, 7 * 12),
        ) {
            let mut numbers = numbers.into_iter();
            let m = matrix(n, shift, || numbers.next().unwrap());
            let zero = vec![0.0; n];
            let lowest = dense(&m, 0.0, [&zero, &zero]).symmetric_eigenvalues().min();
            prop_assume!(lowest.abs() > 1e-9);
            let (mut x, mut y) = (vec![1.0; n], vec![1.0; n]);
            let solved = CyclicSolver::new(n).solve(InstructionSet::new(), &m, 0.0, [&zero, &zero], [&mut x, &mut y]);
            prop_assert_eq!(solved.is_ok(), lowest > 0.0);
        }
    }
}

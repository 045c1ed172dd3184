//! Solves `(B + k g g^T) x = b` for a symmetric, cyclic, block-tridiagonal `B` of 2 x 2 blocks in O(n), and tells whether
//! the matrix is positive definite.
//!
//! The ring is cut into chains, which are eliminated vertex by vertex. Eliminating vertex `v` before its neighbour `w`,
//! with `E = B_vw` and `C` the coupling of vertex 0 to `v` that earlier eliminations left behind,
//!
//! ```text
//! G = D_v^-1 E,   H = D_v^-1 C^T,   Y = D_v^-1 b_v
//! D_w -= E^T G,   b_w -= E^T Y,     C <- -C G,     D_0 -= C H,   b_0 -= C Y
//! ```
//!
//! and `x_v = Y - H x_0 - G x_w` on the way back. A short ring is cut into [`two_chains`]. A long one is first cut into
//! eight, which are eliminated in eight [`lanes`] by the same formulas. The term of rank one is handled by the
//! Sherman-Morrison formula, `x = y - z k (g y)/(1 + k g z)`, where `B y = b` and `B z = g` are solved together.

mod block;
mod chains;
mod elimination;
mod lanes;
mod solution;
mod two_chains;

use crate::on_instruction_set;
use crate::physics::ring::forces::stiffness::Stiffness;
use crate::physics::simd::{InstructionSet, LANES};
use block::Block;
use elimination::System;
use lanes::Lanes;
use solution::Solution;
use two_chains::RingSolver;

/// Rings of at least this many vertices are cut into eight chains.
const LONG: usize = 4 * LANES;

/// A pivot was not positive, so the matrix is not positive definite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotPositiveDefinite;

/// The term of rank one, `k g g^T`.
#[derive(Clone, Copy)]
pub(super) struct Outer<'a> {
    pub(super) k: f64,
    pub(super) g: [&'a [f64]; 2],
    /// Whether B may be indefinite without it. The pressure in a ring makes it so in long steps: without the stiffness of
    /// its area the ring would shrink.
    pub(super) is_needed: bool,
}

/// Work space for rings of up to `n` vertices.
#[derive(Clone, Debug)]
pub(super) struct CyclicSolver {
    ring: RingSolver,
    lanes: Lanes,
    solved: Solution,
}

impl CyclicSolver {
    /// Work space for `n >= 3` vertices.
    pub(super) fn new(n: usize) -> Self {
        Self { ring: RingSolver::new(n.max(2 * LANES)), lanes: Lanes::new(n), solved: Solution::new(n) }
    }

    /// Overwrites `b` by the solution x of `(B + k g g^T) x = b`, for `k >= 0`. Entries from `n` on do not change.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]. Where the term of rank one is not needed, it says that B is not positive definite, and `b`
    /// is untouched; else that `B + k g g^T` is not.
    pub(super) fn solve(
        &mut self,
        instruction_set: InstructionSet,
        matrix: &Stiffness,
        Outer { k, g, is_needed }: Outer<'_>,
        b: [&mut [f64]; 2],
    ) -> Result<(), NotPositiveDefinite> {
        let n = matrix.n;
        let [bx, by] = b;
        let system = System { matrix, b: [&*bx, &*by], g };
        let solved = &mut self.solved;
        let negative = if n < LONG {
            let (negative, rows) = self.ring.solve(&system);
            rows.iter().enumerate().for_each(|(vertex, row)| solved.set(vertex, row.right));
            negative
        } else {
            let lanes = &mut self.lanes;
            let of_chains = on_instruction_set!(instruction_set, simd => lanes.reduce(simd, &system, n));
            if of_chains > 0 && !is_needed {
                return Err(NotPositiveDefinite);
            }
            let (of_rest, rows) = self.ring.solve(&lanes.system());
            let mut rest = [Block::default(); 2 * LANES];
            let rest = &mut rest[..lanes.matrix.n];
            rest.iter_mut().zip(rows).for_each(|(rest, row)| *rest = row.right);
            on_instruction_set!(instruction_set, simd => lanes.substitute(simd, n, rest, solved));
            of_chains + of_rest
        };
        if negative > 0 && !is_needed {
            return Err(NotPositiveDefinite);
        }
        let bordered = on_instruction_set!(instruction_set, simd => solved.combine(simd, n, k, g, [bx, by]));
        if negative == usize::from(bordered < 0.0) { Ok(()) } else { Err(NotPositiveDefinite) }
    }

    /// Overwrites `b` by the solution x of `(B + k g g^T) x = b` for `k > 0` and any B, and returns how many
    /// eigenvalues of `B + k g g^T` are negative. It is slower than [`solve`](Self::solve), because it takes no chains side
    /// by side.
    ///
    /// The bordered matrix `[B, g; g^T, -1/k]` has as many negative eigenvalues as B and `-1/k - g B^-1 g` together,
    /// and as `-1/k` and `B + k g g^T` together (Haynsworth). So the term of rank one takes one away where `1 + k g z <
    /// 0`.
    pub(super) fn solve_counting(
        &mut self,
        instruction_set: InstructionSet,
        matrix: &Stiffness,
        k: f64,
        g: [&[f64]; 2],
        b: [&mut [f64]; 2],
    ) -> usize {
        let n = matrix.n;
        let [bx, by] = b;
        let solved = &mut self.solved;
        let (negative, rows) = self.ring.solve(&System { matrix, b: [&*bx, &*by], g });
        rows.iter().enumerate().for_each(|(vertex, row)| solved.set(vertex, row.right));
        let bordered = on_instruction_set!(instruction_set, simd => solved.combine(simd, n, k, g, [bx, by]));
        if bordered < 0.0 { negative.saturating_sub(1) } else { negative }
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
            let outer = Outer { k, g: [&gx, &gy], is_needed: false };
            CyclicSolver::new(n).solve(InstructionSet::new(), &m, outer, [&mut x, &mut y]).unwrap();
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
            let outer = Outer { k: 0.0, g: [&zero, &zero], is_needed: false };
            let solved = CyclicSolver::new(n).solve(InstructionSet::new(), &m, outer, [&mut x, &mut y]);
            prop_assert_eq!(solved.is_ok(), lowest > 0.0);
        }

        #[test]
        fn a_matrix_that_the_term_of_rank_one_makes_positive_definite_is_solved(
            n in 8_usize..=70, pull in 0.0..3.0_f64,
            numbers in proptest::collection::vec(-1.0..1.0_f64, 7 * 70),
        ) {
            // B has the eigenvalue 1 - pull for the vector of ones, which is also g.
            let mut numbers = numbers.into_iter();
            let mut entry = || 0.1 * numbers.next().unwrap();
            let mut m = matrix(n, 2.0 + 1.0 - pull, &mut entry);
            m.next_xx.fill(-1.0);
            m.next_yy.fill(-1.0);
            let ones = vec![1.0; n];
            let a = dense(&m, 10.0, [&ones, &ones]);
            let lowest = a.symmetric_eigenvalues().min();
            let alone = dense(&m, 0.0, [&ones, &ones]).symmetric_eigenvalues();
            prop_assume!(lowest.abs() > 1e-6 && alone.iter().all(|value| value.abs() > 1e-3));
            let (mut x, mut y) = (ones.clone(), vec![-2.0; n]);
            let outer = Outer { k: 10.0, g: [&ones, &ones], is_needed: true };
            let solved = CyclicSolver::new(n).solve(InstructionSet::new(), &m, outer, [&mut x, &mut y]);
            prop_assert_eq!(solved.is_ok(), lowest > 0.0);
            if solved.is_ok() {
                let got = DVector::from_fn(2 * n, |row, _| [&x, &y][row % 2][row / 2]);
                let b = DVector::from_fn(2 * n, |row, _| [1.0, -2.0][row % 2]);
                prop_assert!((&a * &got - &b).norm() < 1e-6 * (a.norm() * got.norm() + b.norm()));
            }
        }

        #[test]
        fn negative_eigenvalues_are_counted_and_the_solution_is_right_all_the_same(
            n in 3_usize..=40, shift in -2.0..5.0_f64, k in prop_oneof![1e-3..1.0_f64, 1.0..1e4_f64],
            numbers in proptest::collection::vec(-1.0..1.0_f64, 9 * 40),
        ) {
            let mut numbers = numbers.into_iter();
            let mut entry = || numbers.next().unwrap();
            let m = matrix(n, shift, &mut entry);
            let mut vector = || -> Vec<f64> { (0..n).map(|_| entry()).collect() };
            let (gx, gy) = (vector(), vector());
            let a = dense(&m, k, [&gx, &gy]);
            let eigenvalues = a.symmetric_eigenvalues();
            prop_assume!(eigenvalues.iter().all(|value| value.abs() > 1e-6));
            let (mut x, mut y) = (vec![1.0; n], vec![-2.0; n]);
            let counted =
                CyclicSolver::new(n).solve_counting(InstructionSet::new(), &m, k, [&gx, &gy], [&mut x, &mut y]);
            prop_assert_eq!(counted, eigenvalues.iter().filter(|value| **value < 0.0).count());
            let got = DVector::from_fn(2 * n, |row, _| [&x, &y][row % 2][row / 2]);
            let b = DVector::from_fn(2 * n, |row, _| [1.0, -2.0][row % 2]);
            prop_assert!((&a * &got - &b).norm() < 1e-4 * (a.norm() * got.norm() + b.norm()));
        }
    }
}

//! Dense matrices of a few hundred rows: solutions of linear equations.
//!
//! Matrices are stored by rows of equal width, a multiple of eight. All loops run along rows, eight numbers at a time
//! and in a fixed order, so results are the same on any instruction set.

use crate::on_instruction_set;
use crate::physics::simd::{InstructionSet, Instructions, LANES, fma, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

/// Rows of equal width.
#[derive(Clone, Debug, Default)]
pub(crate) struct Matrix {
    /// Numbers in a row, a multiple of eight. Those beyond the last column mean nothing.
    pub(crate) width: usize,
    pub(crate) values: Vec<f64>,
}

impl Matrix {
    /// A matrix of zeros.
    pub(crate) fn new(rows: usize, columns: usize) -> Self {
        let width = padded(columns);
        Self { width, values: vec![0.0; rows * width] }
    }

    /// Row `i`.
    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.width..(i + 1) * self.width]
    }

    /// Row `i`, to change it.
    pub(crate) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.width..(i + 1) * self.width]
    }

    /// Two different rows, the second to change it.
    fn rows(&mut self, read: usize, write: usize) -> (&[f64], &mut [f64]) {
        let width = self.width;
        if read < write {
            let (low, high) = self.values.split_at_mut(write * width);
            (&low[read * width..(read + 1) * width], &mut high[..width])
        } else {
            let (low, high) = self.values.split_at_mut(read * width);
            (&high[..width], &mut low[write * width..(write + 1) * width])
        }
    }
}

/// `y += factor x` from column `from` on, which is rounded down to a multiple of eight.
#[inline(always)]
fn add_scaled<S: Instructions>(simd: S, factor: f64, x: &[f64], y: &mut [f64], from: usize) {
    let factor = f64x8::splat(simd, factor);
    for k in (from / LANES * LANES..y.len()).step_by(LANES) {
        store(fma(factor, load(simd, x, k), load(simd, y, k)), y, k);
    }
}

/// Solves `A z = b` for a symmetric positive definite A of `n` rows, of which the upper triangle is read and destroyed;
/// `b` becomes z. False if A is not positive definite.
///
/// This is the factorisation `A = U^T D^-1 U` by rows: row k times `a_ki/a_kk` is taken from row i.
pub(crate) fn solve_symmetric(set: InstructionSet, a: &mut Matrix, n: usize, b: &mut [f64]) -> bool {
    on_instruction_set!(set, simd => solve_symmetric_with(simd, a, n, b))
}

#[inline(always)]
fn solve_symmetric_with<S: Instructions>(simd: S, a: &mut Matrix, n: usize, b: &mut [f64]) -> bool {
    for k in 0..n {
        let pivot = a.row(k)[k];
        if !(pivot > 0.0) {
            return false;
        }
        let inverse = 1.0 / pivot;
        for i in k + 1..n {
            let factor = -a.row(k)[i] * inverse;
            if factor != 0.0 {
                let (from, to) = a.rows(k, i);
                add_scaled(simd, factor, from, to, i);
                b[i] += factor * b[k];
            }
        }
    }
    for i in (0..n).rev() {
        let row = a.row(i);
        let mut rest = b[i];
        for k in i + 1..n {
            rest -= row[k] * b[k];
        }
        b[i] = rest / row[i];
    }
    true
}

/// Solves `A Z = B` for a general A of `n` rows, which is destroyed; B becomes Z. False if A is singular.
///
/// Gauss's elimination with the largest pivot of each column.
pub(crate) fn solve_many(set: InstructionSet, a: &mut Matrix, n: usize, b: &mut Matrix) -> bool {
    on_instruction_set!(set, simd => solve_many_with(simd, a, n, b))
}

#[inline(always)]
fn solve_many_with<S: Instructions>(simd: S, a: &mut Matrix, n: usize, b: &mut Matrix) -> bool {
    for k in 0..n {
        let mut best = k;
        for i in k + 1..n {
            if a.row(i)[k].abs() > a.row(best)[k].abs() {
                best = i;
            }
        }
        if best != k {
            swap_rows(a, k, best);
            swap_rows(b, k, best);
        }
        let pivot = a.row(k)[k];
        if !(pivot.abs() > 0.0) {
            return false;
        }
        let inverse = 1.0 / pivot;
        for i in k + 1..n {
            let factor = -a.row(i)[k] * inverse;
            let (from, to) = a.rows(k, i);
            add_scaled(simd, factor, from, to, k);
            let (from, to) = b.rows(k, i);
            add_scaled(simd, factor, from, to, 0);
        }
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            let factor = -a.row(i)[k];
            let (from, to) = b.rows(k, i);
            add_scaled(simd, factor, from, to, 0);
        }
        let inverse = f64x8::splat(simd, 1.0 / a.row(i)[i]);
        let row = b.row_mut(i);
        for k in (0..row.len()).step_by(LANES) {
            store(load(simd, row, k) * inverse, row, k);
        }
    }
    true
}

fn swap_rows(a: &mut Matrix, i: usize, j: usize) {
    let width = a.width;
    for k in 0..width {
        a.values.swap(i * width + k, j * width + k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(n: usize, f: impl Fn(usize, usize) -> f64) -> Matrix {
        let mut matrix = Matrix::new(n, n);
        for i in 0..n {
            for j in 0..n {
                matrix.row_mut(i)[j] = f(i, j);
            }
        }
        matrix
    }

    fn entry(i: usize, j: usize) -> f64 {
        libm::sin(1.3 * i as f64 + 0.7 * j as f64 + 0.1 * (i * j) as f64)
    }

    /// `G^T G + 1`, which is positive definite.
    fn positive(n: usize) -> Matrix {
        filled(n, |i, j| (0..n).map(|k| entry(k, i) * entry(k, j)).sum::<f64>() + f64::from(u8::from(i == j)))
    }

    #[test]
    fn symmetric_equations_are_solved_with_the_same_bits_on_all_instruction_sets() {
        for n in [5, 16, 37] {
            let a = positive(n);
            let b: Vec<f64> = (0..n).map(|i| entry(i, 3)).collect();
            let solve = |set: InstructionSet| {
                let mut z = b.clone();
                assert!(solve_symmetric(set, &mut a.clone(), n, &mut z));
                z
            };
            let z = solve(InstructionSet::new());
            assert_eq!(z, solve(InstructionSet::fallback()));
            for i in 0..n {
                let product: f64 = (0..n).map(|j| a.row(i)[j] * z[j]).sum();
                assert!((product - b[i]).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_noticed() {
        let mut a = positive(12);
        a.row_mut(7)[7] -= 1e3;
        assert!(!solve_symmetric(InstructionSet::new(), &mut a, 12, &mut [1.0; 12]));
    }

    #[test]
    fn general_equations_are_solved_for_many_right_hand_sides() {
        let n = 29;
        let a = filled(n, |i, j| entry(i, j) + if (i + 3) % n == j { 9.0 } else { 0.0 });
        let b = filled(n, |i, j| entry(j, i + 2));
        let solve = |set: InstructionSet| {
            let mut z = b.clone();
            assert!(solve_many(set, &mut a.clone(), n, &mut z));
            z.values
        };
        let z = solve(InstructionSet::new());
        assert_eq!(z, solve(InstructionSet::fallback()));
        for i in 0..n {
            for j in 0..n {
                let product: f64 = (0..n).map(|k| a.row(i)[k] * z[k * b.width + j]).sum();
                assert!((product - b.row(i)[j]).abs() < 1e-10);
            }
        }
        let mut singular = filled(4, |i, _| i as f64);
        assert!(!solve_many(InstructionSet::new(), &mut singular, 4, &mut Matrix::new(4, 4)));
    }
}

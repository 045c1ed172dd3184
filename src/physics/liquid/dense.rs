//! Dense matrices of a few hundred rows: solutions of linear equations.
//!
//! Matrices are stored by rows of equal width, a multiple of eight. All loops run along rows, eight numbers at a time
//! and in a fixed order, so results are the same on any instruction set.

use crate::physics::simd::{Instructions, LANES, fma, load, padded, store, sum_lanes};
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

/// Rows that are eliminated together: each number of the rest is then read and written once for eight products. It is
/// the width of a vector, so that the columns of a panel begin and end with vectors.
const PANEL: usize = LANES;

/// `y += f_0 x_0 + f_1 x_1 + ...` from column `from` on, which is rounded down to a multiple of eight.
#[inline(always)]
fn add_rows<S: Instructions, const P: usize>(simd: S, factors: [f64; P], x: [&[f64]; P], y: &mut [f64], from: usize) {
    // Loops, because code in a closure is compiled without vector instructions.
    let mut wide = [f64x8::splat(simd, 0.0); P];
    for p in 0..P {
        wide[p] = f64x8::splat(simd, factors[p]);
    }
    let first = from / LANES * LANES;
    for k in (first..y.len()).step_by(LANES) {
        let mut sum = load(simd, y, k);
        for p in 0..P {
            sum = fma(wide[p], load(simd, x[p], k), sum);
        }
        store(sum, y, k);
    }
}

/// `sum_k x_k y_k`, in eight running sums.
#[inline(always)]
pub(crate) fn dot<S: Instructions>(simd: S, x: &[f64], y: &[f64]) -> f64 {
    let mut sums = f64x8::splat(simd, 0.0);
    let whole = x.len() / LANES * LANES;
    for k in (0..whole).step_by(LANES) {
        sums = fma(load(simd, x, k), load(simd, y, k), sums);
    }
    let mut sum = sum_lanes(sums);
    for k in whole..x.len() {
        sum += x[k] * y[k];
    }
    sum
}

/// Factorises a symmetric positive definite matrix of `n` rows, of which the upper triangle is read: `A = U^T D^-1 U`,
/// with the diagonal D of U. U takes the place of the upper triangle. False if A is not positive definite.
#[inline(always)]
pub(crate) fn factorise<S: Instructions>(simd: S, a: &mut Matrix, n: usize) -> bool {
    let width = a.width;
    for k in (0..n).step_by(PANEL) {
        let size = PANEL.min(n - k);
        let (head, rest) = a.values[k * width..n * width].split_at_mut(size * width);
        for p in 0..size {
            let (above, row) = head.split_at_mut(p * width);
            for q in 0..p {
                let earlier = &above[q * width..(q + 1) * width];
                add_rows(simd, [-earlier[k + p] / earlier[k + q]], [earlier], &mut row[..width], k + p);
            }
            if !(row[k + p] > 0.0) {
                return false;
            }
        }
        if size == PANEL {
            let panel: [&[f64]; PANEL] = std::array::from_fn(|p| &head[p * width..(p + 1) * width]);
            let inverse: [f64; PANEL] = std::array::from_fn(|p| -1.0 / panel[p][k + p]);
            for (at, row) in rest.chunks_exact_mut(width).enumerate() {
                let i = k + PANEL + at;
                let factors: [f64; PANEL] = std::array::from_fn(|p| panel[p][i] * inverse[p]);
                add_rows(simd, factors, panel, row, i);
            }
        }
    }
    true
}

/// Solves `A z = b` for a matrix that [`factorise`] has factorised; `b` becomes z.
#[inline(always)]
pub(crate) fn solve_factorised<S: Instructions>(simd: S, a: &Matrix, n: usize, b: &mut [f64]) {
    for k in 0..n {
        let row = &a.row(k)[..n];
        let factor = -b[k] / row[k];
        for i in k + 1..n {
            b[i] += factor * row[i];
        }
    }
    for i in (0..n).rev() {
        let row = &a.row(i)[..n];
        b[i] = (b[i] - dot(simd, &row[i + 1..], &b[i + 1..n])) / row[i];
    }
}

/// Solves `A Z = B` for a general A of `n` rows, which is destroyed; B becomes Z. False if A is singular.
///
/// Gauss's elimination with the largest pivot of each column.
#[inline(always)]
pub(crate) fn solve_many<S: Instructions>(simd: S, a: &mut Matrix, n: usize, b: &mut Matrix) -> bool {
    for k in (0..n).step_by(PANEL) {
        let size = PANEL.min(n - k);
        if !factorise_panel(simd, a, b, n, k, size) {
            return false;
        }
        if size == PANEL {
            let (a_head, a_rest) = a.values[k * a.width..n * a.width].split_at_mut(PANEL * a.width);
            let (b_head, b_rest) = b.values[k * b.width..n * b.width].split_at_mut(PANEL * b.width);
            let a_panel: [&[f64]; PANEL] = std::array::from_fn(|p| &a_head[p * a.width..(p + 1) * a.width]);
            let b_panel: [&[f64]; PANEL] = std::array::from_fn(|p| &b_head[p * b.width..(p + 1) * b.width]);
            for (a_row, b_row) in a_rest.chunks_exact_mut(a.width).zip(b_rest.chunks_exact_mut(b.width)) {
                let factors: [f64; PANEL] = std::array::from_fn(|p| -a_row[k + p]);
                add_rows(simd, factors, a_panel, a_row, k + PANEL);
                add_rows(simd, factors, b_panel, b_row, 0);
            }
        }
    }
    for i in (0..n).rev() {
        let (head, below) = b.values.split_at_mut((i + 1) * b.width);
        let (row, factors) = (&mut head[i * b.width..], &a.row(i)[..n]);
        let inverse = f64x8::splat(simd, 1.0 / factors[i]);
        for j in (0..b.width).step_by(LANES) {
            let mut sum = load(simd, row, j);
            for k in i + 1..n {
                sum = fma(f64x8::splat(simd, -factors[k]), load(simd, below, (k - i - 1) * b.width + j), sum);
            }
            store(sum * inverse, row, j);
        }
    }
    true
}

/// Eliminates the columns `k .. k + size` below their pivots, where the factors of the rows stay, and finishes the rows
/// of the pivots.
#[inline(always)]
fn factorise_panel<S: Instructions>(simd: S, a: &mut Matrix, b: &mut Matrix, n: usize, k: usize, size: usize) -> bool {
    let width = a.width;
    for column in k..k + size {
        let mut best = column;
        for i in column..n {
            let mut value = a.values[i * width + column];
            for q in k..column {
                value -= a.values[i * width + q] * a.values[q * width + column];
            }
            a.values[i * width + column] = value;
            if value.abs() > a.values[best * width + column].abs() {
                best = i;
            }
        }
        if best != column {
            swap_rows(a, column, best);
            swap_rows(b, column, best);
        }
        let pivot = a.values[column * width + column];
        if !(pivot.abs() > 0.0) {
            return false;
        }
        let inverse = 1.0 / pivot;
        for i in column + 1..n {
            a.values[i * width + column] *= inverse;
        }
        for q in k..column {
            let factor = -a.values[column * width + q];
            for j in column + 1..k + size {
                a.values[column * width + j] += factor * a.values[q * width + j];
            }
            let (from, to) = a.rows(q, column);
            add_rows(simd, [factor], [from], to, k + PANEL);
            let (from, to) = b.rows(q, column);
            add_rows(simd, [factor], [from], to, 0);
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
    use crate::on_instruction_set;
    use crate::physics::simd::InstructionSet;

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
                let (mut z, mut factors) = (b.clone(), a.clone());
                on_instruction_set!(set, simd => {
                    assert!(factorise(simd, &mut factors, n));
                    solve_factorised(simd, &factors, n, &mut z);
                });
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
        assert!(!on_instruction_set!(InstructionSet::new(), simd => factorise(simd, &mut a, 12)));
    }

    #[test]
    fn general_equations_are_solved_for_many_right_hand_sides() {
        let n = 29;
        let a = filled(n, |i, j| entry(i, j) + if (i + 3) % n == j { 9.0 } else { 0.0 });
        let b = filled(n, |i, j| entry(j, i + 2));
        let solve = |set: InstructionSet| {
            let mut z = b.clone();
            assert!(on_instruction_set!(set, simd => solve_many(simd, &mut a.clone(), n, &mut z)));
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
        let mut right = Matrix::new(4, 4);
        assert!(!on_instruction_set!(InstructionSet::new(), simd => solve_many(simd, &mut singular, 4, &mut right)));
    }
}

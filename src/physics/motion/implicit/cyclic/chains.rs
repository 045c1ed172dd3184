//! Puts the numbers of eight chains of vertices side by side, vertex `kL + j` in lane k of row j, and puts them back.
//!
//! To pick eight numbers that lie L apart takes a shuffle for each number. Eight rows together are the transpose of an
//! eight by eight square, which takes only three shuffles per row.

use crate::physics::simd::{Instructions, LANES, load, store};
use fearless_simd::{f64x8, prelude::*};

/// The transpose of an eight by eight square.
#[inline(always)]
fn transposed<S: Instructions>(rows: [f64x8<S>; LANES]) -> [f64x8<S>; LANES] {
    let mut square = rows;
    // Each round moves one bit of the row number to the lane number.
    for _ in 0..3 {
        let [a, b, c, d, e, f, g, h] = square;
        square = [
            a.zip_low(e),
            a.zip_high(e),
            b.zip_low(f),
            b.zip_high(f),
            c.zip_low(g),
            c.zip_high(g),
            d.zip_low(h),
            d.zip_high(h),
        ];
    }
    square
}

/// Eight numbers that fill a cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Line(pub(super) [f64; LANES]);

/// Copies numbers by vertex, in chains of `length`, into column `column` of up to eight rows from row `from` on.
#[inline(always)]
pub(super) fn side_by_side<S: Instructions, const N: usize>(
    simd: S,
    values: &[f64],
    length: usize,
    from: usize,
    rows: &mut [[Line; N]; LANES],
    column: usize,
) {
    if from + LANES <= length {
        let mut square = [load(simd, values, from); LANES];
        for k in 1..LANES {
            square[k] = load(simd, values, k * length + from);
        }
        let square = transposed(square);
        for k in 0..LANES {
            store(square[k], &mut rows[k][column].0, 0);
        }
    } else {
        for j in from..length {
            for k in 0..LANES {
                rows[j - from][column].0[k] = values[k * length + j];
            }
        }
    }
}

/// Copies column `column` of all rows back into numbers by vertex.
#[inline(always)]
pub(super) fn by_vertex<S: Instructions, const N: usize>(
    simd: S,
    rows: &[[Line; N]],
    column: usize,
    values: &mut [f64],
) {
    let length = rows.len();
    let whole = length / LANES * LANES;
    for j in (0..whole).step_by(LANES) {
        let mut square = [load(simd, &rows[j][column].0, 0); LANES];
        for k in 1..LANES {
            square[k] = load(simd, &rows[j + k][column].0, 0);
        }
        let square = transposed(square);
        for k in 0..LANES {
            store(square[k], values, k * length + j);
        }
    }
    for j in whole..length {
        for k in 0..LANES {
            values[k * length + j] = rows[j][column].0[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_instruction_set;
    use crate::physics::simd::InstructionSet;

    #[test]
    fn every_vertex_stands_in_the_lane_of_its_chain_and_comes_back() {
        for length in [1, 7, 8, 19, 32] {
            let values: Vec<f64> = (0..length * LANES).map(|vertex| vertex as f64).collect();
            let mut rows = vec![[Line::default(); 2]; length];
            for from in (0..length).step_by(LANES) {
                let mut eight = [[Line::default(); 2]; LANES];
                on_instruction_set!(InstructionSet::new(), simd => side_by_side(simd, &values, length, from, &mut eight, 1));
                rows[from..].iter_mut().zip(eight).for_each(|(row, read)| *row = read);
            }
            for (j, [empty, row]) in rows.iter().enumerate() {
                assert_eq!(empty.0, [0.0; LANES]);
                assert_eq!(row.0, std::array::from_fn(|k| (k * length + j) as f64));
            }
            let mut back = vec![-1.0; length * LANES];
            on_instruction_set!(InstructionSet::new(), simd => by_vertex(simd, &rows, 1, &mut back));
            assert_eq!(back, values);
        }
    }
}

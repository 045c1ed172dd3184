//! Motion of the outline along its normals that keeps its edges even.
//!
//! Vertex `i` moves by `nu_i n_i + tau_i t_i` with the tangent `t_i` that halves the angle of its two edges. The normal
//! parts `nu` are the unknowns. The tangential parts follow from them: all edges grow by the same length. With the sine
//! `s_i` and the cosine `c_i` of half the angle by which the outline turns at vertex `i`, and `sigma_i = c_i tau_i`,
//!
//! ```text
//! growth of edge i:    sigma_{i+1} - sigma_i + s_i nu_i + s_{i+1} nu_{i+1} = (2/N) sum s_j nu_j
//! no turning of labels:                                      sum sigma_i   = 0
//! ```
//!
//! so `sigma` is a running sum. A rigid shift of an even polygon is such a motion, exactly. The energy falls along
//! these motions as along any others; vertices never gather, and no force is needed to keep them apart.

use crate::physics::liquid::dense::Matrix;
use crate::physics::liquid::polygon::{Edges, Polygon, following, preceding};
use crate::physics::simd::{Instructions, LANES, fma, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

/// Cosines are not taken to be smaller than this. An outline that turns by more than 168 degrees at one vertex is a
/// film.
const SMALLEST_COSINE: f64 = 0.1;

/// The directions of the vertices of one shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct Even {
    pub(crate) tx: Vec<f64>,
    pub(crate) ty: Vec<f64>,
    sine: Vec<f64>,
    cosine: Vec<f64>,
    /// S, if it was computed.
    spread: Matrix,
    mean: Vec<f64>,
    growth: Vec<f64>,
}

impl Even {
    /// Measures the directions of the outline with these edges.
    pub(crate) fn measure(&mut self, edges: &Edges) {
        let n = edges.length.len();
        for column in [&mut self.tx, &mut self.ty, &mut self.sine, &mut self.cosine] {
            column.resize(n, 0.0);
        }
        for i in 0..n {
            let k = preceding(i, n);
            let (ux, uy) = (edges.x[k] / edges.length[k], edges.y[k] / edges.length[k]);
            let (vx, vy) = (edges.x[i] / edges.length[i], edges.y[i] / edges.length[i]);
            let (sx, sy) = (ux + vx, uy + vy);
            let inverse = 1.0 / (sx * sx + sy * sy).sqrt().max(1e-12);
            let (tx, ty) = (sx * inverse, sy * inverse);
            (self.tx[i], self.ty[i]) = (tx, ty);
            self.cosine[i] = (tx * vx + ty * vy).max(SMALLEST_COSINE);
            self.sine[i] = tx * vy - ty * vx;
        }
    }

    /// The displacement of the vertices (x and y in turn) for normal parts `nu`.
    pub(crate) fn displace(&self, nu: &[f64], out: &mut [f64]) {
        let n = self.tx.len();
        let growth = 2.0 / n as f64 * (0..n).map(|i| self.sine[i] * nu[i]).sum::<f64>();
        let mean = self.run(
            |i| {
                let j = following(i, n);
                growth - self.sine[i] * nu[i] - self.sine[j] * nu[j]
            },
            out,
        );
        for i in 0..n {
            let tau = (out[2 * i] - mean) / self.cosine[i];
            out[2 * i] = nu[i] * self.ty[i] + tau * self.tx[i];
            out[2 * i + 1] = -nu[i] * self.tx[i] + tau * self.ty[i];
        }
    }

    /// Adds to `shape` the motion along the tangents that makes the edges even, in the share `share`, and that takes
    /// back what labels have turned since `before`.
    pub(crate) fn space(&self, shape: &mut Polygon, edges: &Edges, share: f64, before: &Polygon, scratch: &mut [f64]) {
        let n = self.tx.len();
        let even = edges.perimeter / n as f64;
        let turned = (0..n)
            .map(|i| {
                let along = self.tx[i] * (shape.x[i] - before.x[i]) + self.ty[i] * (shape.y[i] - before.y[i]);
                self.cosine[i] * along
            })
            .sum::<f64>()
            / n as f64;
        let mean = self.run(|i| share * (even - edges.length[i]), scratch);
        for i in 0..n {
            let tau = (scratch[2 * i] - mean - turned) / self.cosine[i];
            shape.x[i] += tau * self.tx[i];
            shape.y[i] += tau * self.ty[i];
        }
    }

    /// The largest distance along the normals between two shapes.
    pub(crate) fn largest_normal(&self, a: &Polygon, b: &Polygon) -> f64 {
        let along = |i: usize| (a.x[i] - b.x[i]) * self.ty[i] - (a.y[i] - b.y[i]) * self.tx[i];
        (0..a.len()).map(|i| along(i).abs()).fold(0.0, f64::max)
    }

    /// Puts the running sums of `steps` into every second entry of `out`; returns their mean.
    fn run(&self, steps: impl Fn(usize) -> f64, out: &mut [f64]) -> f64 {
        let n = self.tx.len();
        let (mut sigma, mut sum) = (0.0, 0.0);
        for i in 0..n {
            out[2 * i] = sigma;
            sum += sigma;
            sigma += steps(i);
        }
        sum / n as f64
    }

    /// `J^T f`: the forces along the motions of `nu`, from forces on the vertices.
    pub(crate) fn reduce(&self, force: &[f64], out: &mut [f64]) {
        let n = self.tx.len();
        let (mut after, mut weighted) = (0.0, 0.0);
        for i in (0..n).rev() {
            let along = (self.tx[i] * force[2 * i] + self.ty[i] * force[2 * i + 1]) / self.cosine[i];
            let normal = self.ty[i] * force[2 * i] - self.tx[i] * force[2 * i + 1];
            out[i] = normal - self.sine[i] * (2.0 * after + along);
            after += along;
            weighted += 2.0 / n as f64 * i as f64 * along;
        }
        for (i, out) in out.iter_mut().enumerate().take(n) {
            let mean = (2.0 * i as f64 - n as f64) / n as f64;
            *out += self.sine[i] * (weighted - mean * after);
        }
    }

    /// Computes the matrix of `sigma = S nu` by its rows: each follows from the one before it.
    #[inline(always)]
    pub(crate) fn spread<S: Instructions>(&mut self, simd: S) {
        let n = self.tx.len();
        let share = 2.0 / n as f64;
        let Self { sine, spread, mean, growth, .. } = self;
        if spread.values.len() != n * padded(n) {
            *spread = Matrix::new(n, n);
            *mean = vec![0.0; padded(n)];
            *growth = vec![0.0; padded(n)];
        }
        for i in 0..n {
            growth[i] = share * sine[i];
        }
        mean.fill(0.0);
        let width = spread.width;
        spread.values[..width].fill(0.0);
        for i in 0..n - 1 {
            let (from, to) = (i * width, (i + 1) * width);
            for k in (0..width).step_by(LANES) {
                let row = load(simd, &spread.values, from + k) + load(simd, growth, k);
                store(row, &mut spread.values, to + k);
            }
            spread.values[to + i] -= sine[i];
            spread.values[to + i + 1] -= sine[i + 1];
            for k in (0..width).step_by(LANES) {
                store(load(simd, mean, k) + load(simd, &spread.values, to + k), mean, k);
            }
        }
        let inverse = f64x8::splat(simd, -1.0 / n as f64);
        for k in (0..width).step_by(LANES) {
            store(load(simd, mean, k) * inverse, mean, k);
        }
        for i in 0..n {
            for k in (0..width).step_by(LANES) {
                let row = load(simd, &spread.values, i * width + k) + load(simd, mean, k);
                store(row, &mut spread.values, i * width + k);
            }
        }
    }

    /// Row `i` of S.
    pub(crate) fn spread_row(&self, i: usize) -> &[f64] {
        self.spread.row(i)
    }

    /// The frame of vertex `i`: its normal, and the displacement for `sigma_i = 1`.
    pub(crate) fn frame(&self, i: usize) -> [[f64; 2]; 2] {
        let (tx, ty, inverse) = (self.tx[i], self.ty[i], 1.0 / self.cosine[i]);
        [[ty, -tx], [tx * inverse, ty * inverse]]
    }

    /// Adds `S^T F` to `out`, for a matrix F of n rows of `width` numbers; `scratch` has two rows.
    #[inline(always)]
    pub(crate) fn add_gathered<S: Instructions>(
        &self,
        simd: S,
        force: &[f64],
        width: usize,
        out: &mut [f64],
        scratch: &mut [f64],
    ) {
        let n = self.tx.len();
        scratch[..2 * width].fill(0.0);
        let (after, weighted) = scratch.split_at_mut(width);
        for i in (0..n).rev() {
            let (s, weight) = (f64x8::splat(simd, -self.sine[i]), f64x8::splat(simd, 2.0 / n as f64 * i as f64));
            let row = i * width;
            for k in (0..width).step_by(LANES) {
                let (along, sum) = (load(simd, force, row + k), load(simd, after, k));
                store(fma(s, sum + sum + along, load(simd, out, row + k)), out, row + k);
                store(sum + along, after, k);
                store(fma(weight, along, load(simd, weighted, k)), weighted, k);
            }
        }
        for i in 0..n {
            let s = f64x8::splat(simd, self.sine[i]);
            let mean = f64x8::splat(simd, -(2.0 * i as f64 - n as f64) / n as f64);
            for k in (0..width).step_by(LANES) {
                let rest = fma(mean, load(simd, after, k), load(simd, weighted, k));
                store(fma(s, rest, load(simd, out, i * width + k)), out, i * width + k);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_instruction_set;
    use crate::physics::simd::{InstructionSet, padded};
    use std::f64::consts::PI;

    /// A bean with even edges, to first order.
    fn bean(n: usize) -> Polygon {
        let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
        let mut shape = Polygon {
            x: (0..n).map(|i| 0.6 * libm::cos(angle(i)) + 0.1 * libm::cos(2.0 * angle(i))).collect(),
            y: (0..n).map(|i| 0.4 * libm::sin(angle(i))).collect(),
        };
        for _ in 0..30 {
            let (edges, even) = directions(&shape);
            let before = shape.clone();
            even.space(&mut shape, &edges, 1.0, &before, &mut vec![0.0; 2 * n]);
        }
        shape
    }

    fn directions(shape: &Polygon) -> (Edges, Even) {
        let (mut edges, mut even) = (Edges::default(), Even::default());
        edges.measure(shape);
        even.measure(&edges);
        (edges, even)
    }

    fn wave(n: usize, k: f64) -> Vec<f64> {
        (0..n).map(|i| libm::sin(k * i as f64 + 0.3)).collect()
    }

    #[test]
    fn spacing_makes_edges_even_and_keeps_the_outline() {
        let (edges, _) = directions(&bean(40));
        let even = edges.perimeter / 40.0;
        assert!(edges.length.iter().all(|length| (length / even - 1.0).abs() < 1e-9));
    }

    #[test]
    fn edges_stay_even_along_the_motions() {
        let shape = bean(40);
        let (_, even) = directions(&shape);
        let mut motion = vec![0.0; 80];
        even.displace(&wave(40, 0.7), &mut motion);
        let lengths = |by: f64| {
            let mut moved = shape.clone();
            for i in 0..40 {
                moved.x[i] += by * motion[2 * i];
                moved.y[i] += by * motion[2 * i + 1];
            }
            directions(&moved).0.length
        };
        let rates: Vec<f64> = lengths(1e-6).iter().zip(lengths(-1e-6)).map(|(a, b)| (a - b) / 2e-6).collect();
        assert!(rates.iter().all(|rate| (rate - rates[0]).abs() < 1e-8), "{rates:?}");
    }

    #[test]
    fn a_rigid_shift_is_a_motion() {
        let (_, even) = directions(&bean(40));
        let shift = [0.8, -0.3];
        let nu: Vec<f64> = (0..40).map(|i| shift[0] * even.ty[i] - shift[1] * even.tx[i]).collect();
        let mut motion = vec![0.0; 80];
        even.displace(&nu, &mut motion);
        for i in 0..40 {
            assert!((motion[2 * i] - shift[0]).abs() < 1e-8 && (motion[2 * i + 1] - shift[1]).abs() < 1e-8);
        }
    }

    #[test]
    fn reduced_forces_do_the_same_work() {
        let (n, f) = (40, wave(80, 1.1));
        let (_, even) = directions(&bean(n));
        let nu = wave(n, 0.4);
        let (mut motion, mut reduced) = (vec![0.0; 80], vec![0.0; n]);
        even.displace(&nu, &mut motion);
        even.reduce(&f, &mut reduced);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        assert!((dot(&f, &motion) - dot(&reduced, &nu)).abs() < 1e-12);
    }

    #[test]
    fn the_matrix_spreads_and_gathers_like_the_motions_on_any_instruction_set() {
        let n = 40;
        let (_, even) = directions(&bean(n));
        let width = padded(5);
        let forces: Vec<f64> = wave(n * width, 0.37);
        let gather = |set: InstructionSet| {
            let mut even = even.clone();
            let (mut out, mut scratch) = (vec![0.0; n * width], vec![0.0; 2 * width]);
            on_instruction_set!(set, simd => {
                even.spread(simd);
                even.add_gathered(simd, &forces, width, &mut out, &mut scratch);
            });
            (even, out)
        };
        let (even, out) = gather(InstructionSet::new());
        let (slow, same) = gather(InstructionSet::fallback());
        assert_eq!((&out, even.spread.values.clone()), (&same, slow.spread.values));
        for j in 0..n {
            let (mut motion, mut unit) = (vec![0.0; 2 * n], vec![0.0; n]);
            unit[j] = 1.0;
            even.displace(&unit, &mut motion);
            for i in 0..n {
                let [normal, along] = even.frame(i);
                for c in 0..2 {
                    let moved = unit[i] * normal[c] + even.spread_row(i)[j] * along[c];
                    assert!((moved - motion[2 * i + c]).abs() < 1e-13);
                }
            }
            for k in 0..width {
                let gathered: f64 = (0..n).map(|i| even.spread_row(i)[j] * forces[i * width + k]).sum();
                assert!((gathered - out[j * width + k]).abs() < 1e-12);
            }
        }
    }
}

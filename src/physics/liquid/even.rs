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
//! so `sigma` is a running sum. A rigid shift of an even polygon is such a motion, exactly. The energy falls along these
//! motions as along any others; vertices never gather, and no force is needed to keep them apart.

use crate::physics::liquid::polygon::{Edges, Polygon, following, preceding};
use crate::physics::simd::{Instructions, LANES, fma, load, store};
use fearless_simd::{f64x8, prelude::*};

/// Cosines are not taken to be smaller than this. An outline that turns by more than 168 degrees at one vertex is a film.
const SMALLEST_COSINE: f64 = 0.1;

/// The directions of the vertices of one shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct Even {
    pub(crate) tx: Vec<f64>,
    pub(crate) ty: Vec<f64>,
    sine: Vec<f64>,
    cosine: Vec<f64>,
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
        let mean = self.run(|i| {
            let j = following(i, n);
            growth - self.sine[i] * nu[i] - self.sine[j] * nu[j]
        }, out);
        for i in 0..n {
            let tau = (out[2 * i] - mean) / self.cosine[i];
            out[2 * i] = nu[i] * self.ty[i] + tau * self.tx[i];
            out[2 * i + 1] = -nu[i] * self.tx[i] + tau * self.ty[i];
        }
    }

    /// Adds to `shape` the motion along the tangents that makes the edges even, in the share `share`, and that takes back
    /// what labels have turned since `before`.
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

    /// `J^T X` for a matrix X of `2 n` rows of `width` numbers; `out` has n rows, `scratch` two.
    #[inline(always)]
    pub(crate) fn reduce_rows<S: Instructions>(
        &self,
        simd: S,
        x: &[f64],
        width: usize,
        out: &mut [f64],
        scratch: &mut [f64],
    ) {
        let n = self.tx.len();
        scratch[..2 * width].fill(0.0);
        let (after, weighted) = scratch.split_at_mut(width);
        let splat = |value: f64| f64x8::splat(simd, value);
        for i in (0..n).rev() {
            let (tx, ty, s) = (splat(self.tx[i]), splat(self.ty[i]), splat(-self.sine[i]));
            let (inverse, weight) = (splat(1.0 / self.cosine[i]), splat(2.0 / n as f64 * i as f64));
            let (x_row, y_row) = (2 * i * width, (2 * i + 1) * width);
            for k in (0..width).step_by(LANES) {
                let (fx, fy) = (load(simd, x, x_row + k), load(simd, x, y_row + k));
                let along = fma(tx, fx, ty * fy) * inverse;
                let normal = fma(ty, fx, -(tx * fy));
                let sum = load(simd, after, k);
                store(fma(s, sum + sum + along, normal), out, i * width + k);
                store(sum + along, after, k);
                store(fma(weight, along, load(simd, weighted, k)), weighted, k);
            }
        }
        for i in 0..n {
            let (s, mean) = (splat(self.sine[i]), splat(-(2.0 * i as f64 - n as f64) / n as f64));
            for k in (0..width).step_by(LANES) {
                let rest = fma(mean, load(simd, after, k), load(simd, weighted, k));
                store(fma(s, rest, load(simd, out, i * width + k)), out, i * width + k);
            }
        }
    }
}

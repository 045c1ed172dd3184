//! Second derivatives of the energy: blocks along the ring, and pairs of parts that touch across the droplet.

use crate::physics::liquid::dense::Matrix;
use crate::physics::liquid::even::Even;
use crate::physics::liquid::polygon::{following, preceding};
use crate::physics::simd::{Instructions, LANES, fma, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

/// The second derivatives of a sum of terms that each depend on one edge, or on one vertex and one edge.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curvature {
    /// xx, xy, yy of each vertex.
    own: Vec<[f64; 3]>,
    /// xx, xy, yx, yy of each vertex and the one after it.
    next: Vec<[f64; 4]>,
    /// Terms of a vertex and an edge elsewhere: the three vertices, and the derivatives by their x and y.
    far: Vec<([usize; 3], [[f64; 6]; 6])>,
    /// All of them by pairs of vertices.
    blocks: Vec<(usize, usize, [f64; 4])>,
}

impl Curvature {
    /// Forgets all terms; there are `n` vertices.
    pub(crate) fn clear(&mut self, n: usize) {
        self.own.clear();
        self.own.resize(n, [0.0; 3]);
        self.next.clear();
        self.next.resize(n, [0.0; 4]);
        self.far.clear();
    }

    /// Adds a term of edge `i`: the derivatives by x and y of its first and of its second vertex.
    pub(crate) fn add_edge(&mut self, i: usize, term: &[[f64; 4]; 4]) {
        let j = following(i, self.own.len());
        for (vertex, o) in [(i, 0), (j, 2)] {
            let own = &mut self.own[vertex];
            own[0] += term[o][o];
            own[1] += term[o][o + 1];
            own[2] += term[o + 1][o + 1];
        }
        for (k, (a, b)) in [(0, 2), (0, 3), (1, 2), (1, 3)].into_iter().enumerate() {
            self.next[i][k] += term[a][b];
        }
    }

    /// Adds a term of vertex `i`: xx, xy, yy.
    pub(crate) fn add_vertex(&mut self, i: usize, term: [f64; 3]) {
        for (own, value) in self.own[i].iter_mut().zip(term) {
            *own += value;
        }
    }

    /// Adds a term of three vertices.
    pub(crate) fn add_far(&mut self, vertices: [usize; 3], term: [[f64; 6]; 6]) {
        self.far.push((vertices, term));
    }

    /// The blocks of two by two: vertex of the rows, vertex of the columns, and the numbers xx, xy, yx, yy.
    pub(crate) fn blocks(&mut self) -> &[(usize, usize, [f64; 4])] {
        let Self { own, next, far, blocks } = self;
        let n = own.len();
        blocks.clear();
        for i in 0..n {
            let (before, after) = (preceding(i, n), following(i, n));
            let ([xx, xy, yy], [a, b, c, d]) = (own[i], next[before]);
            blocks.extend([(i, before, [a, c, b, d]), (i, i, [xx, xy, xy, yy]), (i, after, next[i])]);
        }
        for (vertices, term) in far {
            for (a, &row) in vertices.iter().enumerate() {
                for (b, &column) in vertices.iter().enumerate() {
                    let entry = |r: usize, c: usize| term[2 * a + r][2 * b + c];
                    blocks.push((row, column, [entry(0, 0), entry(0, 1), entry(1, 0), entry(1, 1)]));
                }
            }
        }
        blocks
    }

    /// Sets the upper triangle of `out` to that of `J^T X J`, with these second derivatives X and the even motions J.
    ///
    /// In the frames of the vertices (`n`, `u` of [`Even::frame`]) `J = n + u S`. With `Z = u^T X n + (1/2) u^T X u S`
    /// it is `n^T X n + S^T Z + Z^T S`, so all that is dense is S.
    #[inline(always)]
    pub(crate) fn reduce<S: Instructions>(&mut self, simd: S, even: &Even, work: &mut Work, out: &mut Matrix) {
        let (n, width) = (self.own.len(), out.width);
        let Work { z, gathered, scratch } = work;
        for matrix in [&mut *z, &mut *gathered, &mut *out] {
            matrix.values[..n * width].fill(0.0);
        }
        for &(i, j, [xx, xy, yx, yy]) in self.blocks() {
            let ([[nx, ny], [ux, uy]], [[mx, my], [vx, vy]]) = (even.frame(i), even.frame(j));
            let (to_n, to_u) = ([xx * mx + xy * my, yx * mx + yy * my], [xx * vx + xy * vy, yx * vx + yy * vy]);
            out.values[i * width + j] += nx * to_n[0] + ny * to_n[1];
            z.values[i * width + j] += ux * to_n[0] + uy * to_n[1];
            let half = f64x8::splat(simd, 0.5 * (ux * to_u[0] + uy * to_u[1]));
            let (from, to) = (even.spread_row(j), &mut z.values[i * width..(i + 1) * width]);
            for k in (0..width).step_by(LANES) {
                store(fma(half, load(simd, from, k), load(simd, to, k)), to, k);
            }
        }
        even.add_gathered(simd, &z.values, width, &mut gathered.values, scratch);
        for i in 0..n {
            for j in i..n {
                out.values[i * width + j] += gathered.values[i * width + j] + gathered.values[j * width + i];
            }
        }
    }
}

/// Storage for [`Curvature::reduce`] and for the drag.
#[derive(Debug)]
pub(crate) struct Work {
    pub(crate) z: Matrix,
    pub(crate) gathered: Matrix,
    pub(crate) scratch: Vec<f64>,
}

impl Work {
    /// For rings of `n` vertices.
    pub(crate) fn new(n: usize) -> Self {
        Self { z: Matrix::new(n, n), gathered: Matrix::new(n, n), scratch: vec![0.0; 2 * padded(n)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_instruction_set;
    use crate::physics::liquid::polygon::{Edges, Polygon};
    use crate::physics::simd::InstructionSet;

    const N: usize = 21;

    /// Some number for each place of a symmetric term.
    fn symmetric<const M: usize>(seed: usize) -> [[f64; M]; M] {
        let entry = |i: usize, j: usize| libm::sin((seed + 1) as f64 * 0.7 + (i + j) as f64 * 1.3 + (i * j) as f64);
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    #[test]
    fn the_reduced_matrix_is_that_of_the_even_motions_on_any_instruction_set() {
        let angle = |i: usize| 2.0 * std::f64::consts::PI * i as f64 / N as f64;
        let x = (0..N).map(|i| 0.6 * libm::cos(angle(i)) + 0.1 * libm::cos(2.0 * angle(i))).collect();
        let y = (0..N).map(|i| 0.4 * libm::sin(angle(i))).collect();
        let (mut edges, mut even, mut curvature) = (Edges::default(), Even::default(), Curvature::default());
        edges.measure(&Polygon { x, y });
        even.measure(&edges);
        curvature.clear(N);
        (0..N).for_each(|i| curvature.add_edge(i, &symmetric(i)));
        curvature.add_vertex(4, [3.0, -1.0, 2.0]);
        curvature.add_far([2, 11, 12], symmetric(50));

        let mut reduce = |set: InstructionSet| {
            let (mut out, mut work) = (Matrix::new(N, N), Work::new(N));
            on_instruction_set!(set, simd => {
                even.spread(simd);
                curvature.reduce(simd, &even, &mut work, &mut out);
            });
            out.values
        };
        let (reduced, width) = (reduce(InstructionSet::new()), padded(N));
        assert_eq!(reduced, reduce(InstructionSet::fallback()));

        let motions: Vec<Vec<f64>> = (0..N)
            .map(|k| {
                let (mut unit, mut motion) = (vec![0.0; N], vec![0.0; 2 * N]);
                unit[k] = 1.0;
                even.displace(&unit, &mut motion);
                motion
            })
            .collect();
        for k in 0..N {
            for l in k..N {
                let mut product = 0.0;
                for &(i, j, block) in curvature.blocks() {
                    for (place, value) in block.into_iter().enumerate() {
                        product += motions[k][2 * i + place / 2] * value * motions[l][2 * j + place % 2];
                    }
                }
                assert!((product - reduced[k * width + l]).abs() < 1e-11, "{k} {l}");
            }
        }
    }
}

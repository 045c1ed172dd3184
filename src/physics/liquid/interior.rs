//! Darcy's law inside the droplet, by boundary elements.
//!
//! Friction at the plates makes the liquid flow as `u = -(a0/b_inf) grad(p - rho g x)`, so u is the gradient of a
//! potential phi that obeys Laplace's equation. Its normal derivative on the outline is the normal velocity v of the
//! edges. The squared velocity, integrated over the droplet, is a quadratic form of v:
//!
//! ```text
//! int |u|^2 = sum_e l_e phi_e v_e = v^T Q v
//! ```
//!
//! With v and phi constant on each edge, Green's third identity at the middles of the edges gives
//!
//! ```text
//! H phi = G v,   G_ef = -(1/2 pi) int_f ln r ds,   H_ef = -(angle of f seen from e)/(2 pi),   H_ee = 1/2,
//! ```
//!
//! and the mean of phi is fixed by `l_f/P` in each column of H. Both integrals are exact. Q is made symmetric, and
//! takes no account of a mean of v, which no incompressible flow has. For a circle of 64 edges that moves, Q is right
//! to 8e-4; the error falls with the square of the number of edges.

use crate::on_instruction_set;
use crate::physics::liquid::dense::{Matrix, solve_many};
use crate::physics::simd::functions::{atan2, ln};
use crate::physics::simd::{InstructionSet, Instructions, LANES, fma, load, padded, store};
use fearless_simd::{f64x8, prelude::*};
use std::f64::consts::PI;

/// The quadratic form Q of one shape.
#[derive(Debug)]
pub(crate) struct Interior {
    n: usize,
    set: InstructionSet,
    /// Vertices and edges, with some repeated behind the last.
    x: Vec<f64>,
    y: Vec<f64>,
    ex: Vec<f64>,
    ey: Vec<f64>,
    length: Vec<f64>,
    /// Logarithms of squared distances of the vertices from the middle of one edge.
    logarithm: Vec<f64>,
    h: Matrix,
    q: Matrix,
    share: Vec<f64>,
    column: Vec<f64>,
}

impl Interior {
    /// Storage for outlines of `n` edges.
    pub(crate) fn new(n: usize, set: InstructionSet) -> Self {
        let long = || vec![0.0; padded(n) + LANES];
        Self {
            n,
            set,
            x: long(),
            y: long(),
            ex: long(),
            ey: long(),
            length: vec![1.0; padded(n) + LANES],
            logarithm: long(),
            h: Matrix::new(n, n),
            q: Matrix::new(n, n),
            share: vec![0.0; padded(n)],
            column: vec![0.0; padded(n)],
        }
    }

    /// Row `e` of Q.
    pub(crate) fn row(&self, e: usize) -> &[f64] {
        &self.q.row(e)[..self.n]
    }

    /// The matrix Q.
    pub(crate) const fn form(&self) -> &Matrix {
        &self.q
    }

    /// Computes Q for the vertices `x`, `y`, which stand counter-clockwise. False if the equations have no solution.
    pub(crate) fn assemble(&mut self, x: &[f64], y: &[f64]) -> bool {
        let n = self.n;
        let mut perimeter = 0.0;
        for i in 0..self.x.len() {
            (self.x[i], self.y[i]) = (x[i % n], y[i % n]);
        }
        for i in 0..n {
            (self.ex[i], self.ey[i]) = (self.x[i + 1] - self.x[i], self.y[i + 1] - self.y[i]);
            self.length[i] = (self.ex[i] * self.ex[i] + self.ey[i] * self.ey[i]).sqrt();
            perimeter += self.length[i];
        }
        for i in 0..n {
            self.share[i] = self.length[i] / perimeter;
        }
        let set = self.set;
        // A loop, because code in a closure is compiled without vector instructions.
        on_instruction_set!(set, simd => {
            for e in 0..n {
                self.elements(simd, e);
            }
        });
        if !on_instruction_set!(set, simd => solve_many(simd, &mut self.h, n, &mut self.q)) {
            return false;
        }
        self.symmetric();
        self.q.values.iter().all(|value| value.is_finite())
    }

    /// Row `e` of H, and of G in the place of Q.
    #[inline(always)]
    fn elements<S: Instructions>(&mut self, simd: S, e: usize) {
        let n = self.n;
        let splat = |value: f64| f64x8::splat(simd, value);
        let middle = [0.5 * (self.x[e] + self.x[e + 1]), 0.5 * (self.y[e] + self.y[e + 1])];
        let [mx, my] = middle.map(splat);
        for j in (0..n + 1).step_by(LANES) {
            let (rx, ry) = (load(simd, &self.x, j) - mx, load(simd, &self.y, j) - my);
            store(ln(simd, fma(rx, rx, ry * ry)), &mut self.logarithm, j);
        }
        let (width, of_angle) = (self.h.width, splat(-0.5 / PI));
        for j in (0..n).step_by(LANES) {
            let (ax, ay) = (load(simd, &self.x, j) - mx, load(simd, &self.y, j) - my);
            let (bx, by) = (load(simd, &self.x, j + 1) - mx, load(simd, &self.y, j + 1) - my);
            let (ex, ey) = (load(simd, &self.ex, j), load(simd, &self.ey, j));
            let length = load(simd, &self.length, j);
            let inverse = 1.0 / length;
            let angle = atan2(simd, fma(ax, by, -(ay * bx)), fma(ax, bx, ay * by));
            // Along the edge from its foot, and the distance of the foot.
            let begin = fma(ex, ax, ey * ay) * inverse;
            let end = fma(ex, bx, ey * by) * inverse;
            let far = fma(ey, ax, -(ex * ay)) * inverse;
            let (from, to) = (load(simd, &self.logarithm, j), load(simd, &self.logarithm, j + 1));
            let half = splat(0.5);
            let integral = fma(half, fma(end, to, -(begin * from)), begin - end) + far.abs() * angle.abs();
            store(of_angle * integral, &mut self.q.values, e * width + j);
            store(fma(of_angle, angle, load(simd, &self.share, j)), &mut self.h.values, e * width + j);
        }
        let length = self.length[e];
        self.q.values[e * width + e] = length / (2.0 * PI) * (1.0 - libm::log(0.5 * length));
        self.h.values[e * width + e] = 0.5 + self.share[e];
        self.q.values[e * width + n..(e + 1) * width].fill(0.0);
    }

    /// Makes the form out of phi: `l_e (phi_e - mean)` for v without its mean, and symmetric.
    fn symmetric(&mut self) {
        let n = self.n;
        self.column.fill(0.0);
        for e in 0..n {
            let row = self.q.row_mut(e);
            let mean: f64 = row[..n].iter().sum();
            for j in 0..n {
                row[j] = self.length[e] * (row[j] - mean * self.share[j]);
                self.column[j] += row[j];
            }
        }
        for e in 0..n {
            let (share, row) = (self.share[e], self.q.row_mut(e));
            for j in 0..n {
                row[j] -= share * self.column[j];
            }
        }
        let width = self.q.width;
        for e in 0..n {
            for j in 0..e {
                let (lower, upper) = (e * width + j, j * width + e);
                let mean = 0.5 * (self.q.values[lower] + self.q.values[upper]);
                (self.q.values[lower], self.q.values[upper]) = (mean, mean);
            }
        }
    }
}

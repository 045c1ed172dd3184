//! The dissipation of the liquid, as a quadratic form of the velocities of the vertices.
//!
//! Friction at the plates of the cell makes the liquid obey Darcy's law, and dissipates `(b_inf/2 a0) int |u|^2` over
//! the droplet. An incompressible flow is the sum of the velocity V of the centroid and of a flow without first moment:
//!
//! ```text
//! int |u|^2 = a0 |V|^2 + w^T Q w,   w_e = n_e . (v_i + v_{i+1})/2 - n_e . V
//! ```
//!
//! with the normal velocities w of the edges relative to the centroid, and Q of
//! [`interior`](crate::physics::liquid::interior). So a body that moves rigidly feels exactly `b_inf V`, whatever its
//! shape.

use crate::parameters::MASS;
use crate::physics::liquid::even::Even;
use crate::physics::liquid::interior::Interior;
use crate::physics::liquid::near_wall::NearWall;
use crate::physics::liquid::polygon::{Edges, Polygon, following, preceding};
use crate::physics::liquid::potential::Evaluation;
use crate::physics::simd::{InstructionSet, padded};

/// The quadratic form at one shape.
#[derive(Debug)]
pub(crate) struct Dissipation {
    interior: Interior,
    edges: Edges,
    /// Gradient of the centroid by the vertices: x and y of each.
    x_gradient: Vec<f64>,
    y_gradient: Vec<f64>,
    /// `b_inf/a0`.
    friction: f64,
    near_wall: Option<NearWall>,
    flow: Vec<f64>,
    pressure: Vec<f64>,
}

impl Dissipation {
    /// For `n` edges and the friction `b_inf/a0`, with the additional drag near walls if there is one.
    pub(crate) fn new(n: usize, friction: f64, near_wall: Option<NearWall>, set: InstructionSet) -> Self {
        Self {
            interior: Interior::new(n, set),
            edges: Edges::default(),
            x_gradient: Vec::new(),
            y_gradient: Vec::new(),
            friction,
            near_wall,
            flow: vec![0.0; padded(n)],
            pressure: vec![0.0; padded(n)],
        }
    }

    /// Takes over a shape, its evaluation and its directions. False if the flow in it cannot be computed.
    pub(crate) fn take(&mut self, shape: &Polygon, origin: [f64; 2], at: &Evaluation, even: &Even) -> bool {
        self.edges.clone_from(&at.edges);
        self.x_gradient.clone_from(&at.x_gradient);
        self.y_gradient.clone_from(&at.y_gradient);
        if let Some(near_wall) = &mut self.near_wall {
            near_wall.take(shape, origin, even);
        }
        self.interior.assemble(&shape.x, &shape.y)
    }

    /// The velocity of the centroid for velocities `v` of the vertices.
    pub(crate) fn centroid_velocity(&self, v: &[f64]) -> [f64; 2] {
        let dot = |gradient: &[f64]| gradient.iter().zip(v).map(|(a, b)| a * b).sum();
        [dot(&self.x_gradient), dot(&self.y_gradient)]
    }

    /// Sets `out` to the drag `B v`, and returns `int |u|^2`.
    pub(crate) fn drag(&mut self, v: &[f64], out: &mut [f64]) -> f64 {
        let n = self.edges.length.len();
        let [cx, cy] = self.centroid_velocity(v);
        for e in 0..n {
            let j = following(e, n);
            let (vx, vy) = (0.5 * (v[2 * e] + v[2 * j]) - cx, 0.5 * (v[2 * e + 1] + v[2 * j + 1]) - cy);
            self.flow[e] = self.edges.nx[e] * vx + self.edges.ny[e] * vy;
        }
        let mut squares = MASS * (cx * cx + cy * cy);
        for e in 0..n {
            let row = self.interior.row(e);
            self.pressure[e] = (0..n).map(|k| row[k] * self.flow[k]).sum();
            squares += self.flow[e] * self.pressure[e];
        }
        let (mut px, mut py) = (0.0, 0.0);
        for e in 0..n {
            px += self.edges.nx[e] * self.pressure[e];
            py += self.edges.ny[e] * self.pressure[e];
        }
        let (along_x, along_y) = (MASS * cx - px, MASS * cy - py);
        for i in 0..n {
            let k = preceding(i, n);
            let half = |normal: &[f64]| 0.5 * (normal[i] * self.pressure[i] + normal[k] * self.pressure[k]);
            for (c, normal) in [(0, &self.edges.nx), (1, &self.edges.ny)] {
                let at = 2 * i + c;
                let shift = self.x_gradient[at] * along_x + self.y_gradient[at] * along_y;
                out[at] = self.friction * (half(normal) + shift);
            }
        }
        if let Some(near_wall) = &self.near_wall {
            near_wall.add_drag(v, [cx, cy], &self.x_gradient, &self.y_gradient, out);
        }
        squares
    }

    /// Fills `full`, of `2 n` rows of `width` numbers, with the matrix B in the space of vertices.
    ///
    /// With D from vertices to normal velocities of edges, `W = D - n_x g_x^T - n_y g_y^T`, and `B = (b/a0) (W^T Q W +
    /// a0 (g_x g_x^T + g_y g_y^T))`, written out as `D^T Q D` and terms of low rank.
    pub(crate) fn fill(&self, full: &mut [f64], width: usize) {
        let n = self.edges.length.len();
        let (nx, ny) = (&self.edges.nx, &self.edges.ny);
        // Q n_x, Q n_y and the numbers n^T Q n.
        let times = |normal: &[f64]| -> Vec<f64> {
            (0..n).map(|e| (0..n).map(|k| self.interior.row(e)[k] * normal[k]).sum()).collect()
        };
        let q = [times(nx), times(ny)];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let cross = [[dot(nx, &q[0]), dot(nx, &q[1])], [dot(ny, &q[0]), dot(ny, &q[1])]];
        // D^T Q n for both directions.
        let spread = |pressure: &[f64], at: usize| {
            let (i, normal) = (at / 2, if at.is_multiple_of(2) { nx } else { ny });
            let k = preceding(i, n);
            0.5 * (normal[i] * pressure[i] + normal[k] * pressure[k])
        };
        let s: [Vec<f64>; 2] = [0, 1].map(|d| (0..2 * n).map(|at| spread(&q[d], at)).collect());
        let g = [&self.x_gradient, &self.y_gradient];
        for i in 0..n {
            let k = preceding(i, n);
            for j in 0..n {
                let l = preceding(j, n);
                let (row_i, row_k) = (self.interior.row(i), self.interior.row(k));
                for (a, normal_a) in [(0, nx), (1, ny)] {
                    let upper = [
                        normal_a[i] * row_i[j] + normal_a[k] * row_k[j],
                        normal_a[i] * row_i[l] + normal_a[k] * row_k[l],
                    ];
                    for (b, normal_b) in [(0, nx), (1, ny)] {
                        full[(2 * i + a) * width + 2 * j + b] =
                            0.25 * (upper[0] * normal_b[j] + upper[1] * normal_b[l]);
                    }
                }
            }
        }
        for r in 0..2 * n {
            for c in 0..2 * n {
                let mut sum = full[r * width + c];
                for d in 0..2 {
                    sum -= g[d][r] * s[d][c] + s[d][r] * g[d][c];
                    for (e, row) in cross[d].iter().enumerate() {
                        sum += g[d][r] * row * g[e][c];
                    }
                    sum += MASS * g[d][r] * g[d][c];
                }
                full[r * width + c] = self.friction * sum;
            }
        }
        if let Some(near_wall) = &self.near_wall {
            near_wall.add_matrix(&self.x_gradient, &self.y_gradient, full, width);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::liquid::{nearby::Nearby, potential::Potential};
    use crate::physics::walls::wedge::ChannelWalls;
    use std::{f64::consts::PI, sync::Arc};

    const FRICTION: f64 = 30.0;

    /// An ellipse, and its dissipation.
    fn ellipse(n: usize, a: f64, b: f64) -> (Polygon, Dissipation) {
        let angle = |i: usize| 2.0 * PI * i as f64 / n as f64;
        let x = (0..n).map(|i| a * libm::cos(angle(i))).collect();
        let y = (0..n).map(|i| b * libm::sin(angle(i))).collect();
        let shape = Polygon { x, y };
        let walls = Arc::new(ChannelWalls::new(50.0, 45.0, 0.0));
        let potential =
            Potential { walls, gamma: 1.0, k_a: 1.0, rest: 1.0, weight: 0.0, k_w: 1e5, reach: 0.01, folds: None };
        let (mut nearby, mut seen) = (Nearby::none(), Evaluation::default());
        nearby.list(potential.walls.as_ref(), [0.0; 2], &shape, potential.reach, None);
        potential.evaluate(&shape, &nearby, &mut seen);
        let mut even = Even::default();
        even.measure(&seen.edges);
        let mut dissipation = Dissipation::new(n, FRICTION, None, InstructionSet::new());
        assert!(dissipation.take(&shape, [0.0; 2], &seen, &even));
        (shape, dissipation)
    }

    #[test]
    fn a_body_of_any_shape_that_moves_rigidly_feels_the_same_drag() {
        let n = 40;
        for (a, b) in [(0.5, 0.5), (1.0, 0.25), (0.2, 1.25)] {
            let (_, mut dissipation) = ellipse(n, a, b);
            let v: Vec<f64> = (0..n).flat_map(|_| [0.3, -0.4]).collect();
            let mut drag = vec![0.0; 2 * n];
            let squares = dissipation.drag(&v, &mut drag);
            assert!((squares / (MASS * 0.25) - 1.0).abs() < 1e-12);
            let total: f64 = drag.iter().step_by(2).sum();
            assert!((total / (FRICTION * MASS * 0.3) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_strain_of_an_ellipse_dissipates_what_its_flow_does() {
        // u = (x, -y) is the gradient of (x^2 - y^2)/2: the integral of its square is pi a b (a^2 + b^2)/4.
        let error = |n: usize| {
            let (a, b) = (0.8, 0.3125);
            let (shape, mut dissipation) = ellipse(n, a, b);
            let v: Vec<f64> = (0..n).flat_map(|i| [shape.x[i], -shape.y[i]]).collect();
            let squares = dissipation.drag(&v, &mut vec![0.0; 2 * n]);
            squares / (0.25 * PI * a * b * (a * a + b * b)) - 1.0
        };
        assert!(error(64).abs() < 0.01);
        let order = libm::log2((error(32) / error(64)).abs());
        assert!(order > 1.7, "the error falls with the square of the number of edges, not with {order}");
    }

    #[test]
    fn the_matrix_is_the_drag_and_dissipation_is_never_negative() {
        let n = 24;
        let (_, mut dissipation) = ellipse(n, 0.7, 0.35);
        let width = padded(2 * n);
        let mut full = vec![0.0; 2 * n * width];
        dissipation.fill(&mut full, width);
        for k in 1..20 {
            let v: Vec<f64> = (0..2 * n).map(|i| libm::sin(0.37 * f64::from(k) * i as f64 + 0.1)).collect();
            let mut drag = vec![0.0; 2 * n];
            let squares = dissipation.drag(&v, &mut drag);
            assert!(squares > 0.0);
            for row in 0..2 * n {
                let product: f64 = (0..2 * n).map(|column| full[row * width + column] * v[column]).sum();
                assert!((product - drag[row]).abs() < 1e-10);
                assert!((0..2 * n).all(|c| (full[row * width + c] - full[c * width + row]).abs() < 1e-11));
            }
            let power: f64 = v.iter().zip(&drag).map(|(v, f)| v * f).sum();
            assert!((power / (FRICTION * squares) - 1.0).abs() < 1e-12);
        }
    }
}

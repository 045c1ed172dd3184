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

use crate::on_instruction_set;
use crate::parameters::MASS;
use crate::physics::liquid::curvature::Work;
use crate::physics::liquid::dense::{Matrix, dot};
use crate::physics::liquid::even::Even;
use crate::physics::liquid::interior::Interior;
use crate::physics::liquid::near_wall::NearWall;
use crate::physics::liquid::polygon::{Edges, Polygon, following, preceding};
use crate::physics::liquid::potential::Evaluation;
use crate::physics::simd::{InstructionSet, Instructions, LANES, fma, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

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
    set: InstructionSet,
    flow: Vec<f64>,
    pressure: Vec<f64>,
    /// Forces on the vertices.
    force: Vec<f64>,
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
            set,
            flow: vec![0.0; padded(n)],
            pressure: vec![0.0; padded(n)],
            force: vec![0.0; 2 * n],
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
        let Self { interior, flow, pressure, .. } = self;
        on_instruction_set!(self.set, simd => {
            for e in 0..n {
                pressure[e] = dot(simd, interior.row(e), &flow[..n]);
                squares += flow[e] * pressure[e];
            }
        });
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

    /// Sets `out` to the drag of even motions, `J^T B J`.
    ///
    /// Let F give the normal velocities of the edges for normal parts `nu`, `g` the velocity of the centroid, and m the
    /// normals. Then `J^T B J = (b/a0) [(F - m g)^T Q (F - m g) + a0 g^T g]`, written out as `F^T Q F` and terms of low
    /// rank.
    pub(crate) fn fill(&mut self, even: &Even, work: &mut Work, out: &mut Matrix) {
        let n = self.edges.length.len();
        let mut terms = Terms::new(padded(n));
        for (d, (normal, gradient)) in
            [(&self.edges.nx, &self.x_gradient), (&self.edges.ny, &self.y_gradient)].into_iter().enumerate()
        {
            for e in 0..n {
                self.pressure[e] = self.interior.row(e).iter().zip(normal).map(|(q, m)| q * m).sum();
            }
            for (e, other) in [&self.edges.nx, &self.edges.ny].into_iter().enumerate() {
                terms.cross[d][e] = self.pressure.iter().zip(other).map(|(p, m)| p * m).sum();
            }
            for i in 0..n {
                let k = preceding(i, n);
                for (c, m) in [&self.edges.nx, &self.edges.ny].into_iter().enumerate() {
                    self.force[2 * i + c] = 0.5 * (m[i] * self.pressure[i] + m[k] * self.pressure[k]);
                }
            }
            even.reduce(&self.force, &mut terms.flow[d]);
            even.reduce(gradient, &mut terms.centroid[d]);
        }
        let along = self.near_wall.as_ref().map_or([0.0; 3], |near_wall| near_wall.along);
        out.values.fill(0.0);
        on_instruction_set!(self.set, simd => {
            self.forces(simd, even, None, work);
            // Q is symmetric, so the transpose of F^T Q is Q F.
            for i in 0..n {
                for j in 0..n {
                    out.values[j * out.width + i] = work.gathered.values[i * out.width + j];
                }
            }
            self.forces(simd, even, Some(out), work);
            terms.add(simd, self.friction, along, &work.gathered, out, n);
        });
        if let Some(near_wall) = &self.near_wall {
            for (i, z) in near_wall.z.iter().enumerate() {
                out.row_mut(i)[i] += z;
            }
        }
    }

    /// Sets `work.gathered` to `F^T X`, for Q in the place of X where there is none.
    #[inline(always)]
    fn forces<S: Instructions>(&self, simd: S, even: &Even, x: Option<&Matrix>, work: &mut Work) {
        let (n, x) = (self.edges.length.len(), x.unwrap_or(self.interior.form()));
        let (width, Work { z, gathered, scratch }) = (x.width, work);
        for i in 0..n {
            let k = preceding(i, n);
            let [[ax, ay], [ux, uy]] = even.frame(i);
            let ([mx, my], [lx, ly]) = ([self.edges.nx[i], self.edges.ny[i]], [self.edges.nx[k], self.edges.ny[k]]);
            let a = f64x8::splat(simd, 0.5 * (ax * mx + ay * my));
            let b = f64x8::splat(simd, 0.5 * (ax * lx + ay * ly));
            let p = f64x8::splat(simd, 0.5 * (ux * mx + uy * my));
            let q = f64x8::splat(simd, 0.5 * (ux * lx + uy * ly));
            for c in (0..width).step_by(LANES) {
                let (here, last) = (load(simd, &x.values, i * width + c), load(simd, &x.values, k * width + c));
                store(fma(a, here, b * last), &mut gathered.values, i * width + c);
                store(fma(p, here, q * last), &mut z.values, i * width + c);
            }
        }
        even.add_gathered(simd, &z.values, width, &mut gathered.values, scratch);
    }
}

/// The parts of the drag that are of low rank, for both directions.
struct Terms {
    /// `F^T Q m`.
    flow: [Vec<f64>; 2],
    /// `J^T` of the gradients of the centroid.
    centroid: [Vec<f64>; 2],
    /// `m^T Q m`.
    cross: [[f64; 2]; 2],
}

impl Terms {
    fn new(n: usize) -> Self {
        let vectors = || [vec![0.0; n], vec![0.0; n]];
        Self { flow: vectors(), centroid: vectors(), cross: [[0.0; 2]; 2] }
    }

    /// `out = friction (x + terms) + g^T along g`.
    #[inline(always)]
    fn add<S: Instructions>(&self, simd: S, friction: f64, along: [f64; 3], x: &Matrix, out: &mut Matrix, n: usize) {
        let [[sx, sy], [gx, gy]] = [&self.flow, &self.centroid];
        let own = |a: usize, b: usize| self.cross[a][b] + if a == b { MASS } else { 0.0 };
        let [xx, xy, yx, yy] = [
            friction * own(0, 0) + along[0],
            friction * own(0, 1) + along[1],
            friction * own(1, 0) + along[1],
            friction * own(1, 1) + along[2],
        ];
        let (width, scale) = (x.width, f64x8::splat(simd, friction));
        for i in 0..n {
            let of_sx = f64x8::splat(simd, -friction * gx[i]);
            let of_sy = f64x8::splat(simd, -friction * gy[i]);
            let of_gx = f64x8::splat(simd, gx[i] * xx + gy[i] * yx - friction * sx[i]);
            let of_gy = f64x8::splat(simd, gx[i] * xy + gy[i] * yy - friction * sy[i]);
            for k in (0..width).step_by(LANES) {
                let sum = scale * load(simd, &x.values, i * width + k);
                let sum = fma(of_sx, load(simd, sx, k), fma(of_sy, load(simd, sy, k), sum));
                let sum = fma(of_gx, load(simd, gx, k), fma(of_gy, load(simd, gy, k), sum));
                store(sum, &mut out.values, i * width + k);
            }
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
        for n in [24, 29] {
            let (shape, mut dissipation) = ellipse(n, 0.7, 0.35);
            let (mut edges, mut even) = (Edges::default(), Even::default());
            edges.measure(&shape);
            even.measure(&edges);
            let (mut work, mut matrix) = (Work::new(n), Matrix::new(n, n));
            on_instruction_set!(InstructionSet::new(), simd => even.spread(simd));
            dissipation.fill(&even, &mut work, &mut matrix);
            for k in 1..20 {
                let nu: Vec<f64> = (0..n).map(|i| libm::sin(0.37 * f64::from(k) * i as f64 + 0.1)).collect();
                let (mut v, mut drag, mut reduced) = (vec![0.0; 2 * n], vec![0.0; 2 * n], vec![0.0; n]);
                even.displace(&nu, &mut v);
                let squares = dissipation.drag(&v, &mut drag);
                assert!(squares > 0.0);
                even.reduce(&drag, &mut reduced);
                for i in 0..n {
                    let product: f64 = (0..n).map(|j| matrix.row(i)[j] * nu[j]).sum();
                    assert!((product - reduced[i]).abs() < 1e-10);
                    assert!((0..n).all(|j| (matrix.row(i)[j] - matrix.row(j)[i]).abs() < 1e-11));
                }
                let power: f64 = v.iter().zip(&drag).map(|(v, f)| v * f).sum();
                assert!((power / (FRICTION * squares) - 1.0).abs() < 1e-12);
            }
        }
    }
}

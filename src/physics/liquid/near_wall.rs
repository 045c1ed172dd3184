//! Drag near walls, in addition to that of Darcy's law ([C24] eqs 5, 6).
//!
//! In the paper a vertex at the distance d from the nearest wall feels `-(b_0/N)(sigma/d)^alpha v` on top of the drag
//! far from walls. The outline of a liquid has a normal velocity; along the wall the liquid moves with the droplet. So
//! here
//!
//! ```text
//! dissipation = (1/2) sum_i z_i [(v_i . n_i)^2 + (V . t_i)^2],   z_i = (b_0/N) (sigma/d_i)^alpha
//! ```
//!
//! with the velocity V of the centroid. It is never negative, and a rigid motion feels what it feels in the paper.

use crate::parameters::MASS;
use crate::physics::liquid::even::Even;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::near_wall_drag::NearWallDrag;

/// The additional drag of each vertex.
#[derive(Debug)]
pub(crate) struct NearWall {
    drag: NearWallDrag,
    /// The droplet as the drag knows it.
    ring: Ring,
    /// Damping rate far from walls, 1/V_t.
    far: f64,
    /// z of each vertex, which multiplies the square of its normal velocity.
    pub(crate) z: Vec<f64>,
    tx: Vec<f64>,
    ty: Vec<f64>,
    /// `sum z t t^T`, which multiplies the square of the velocity of the centroid: xx, xy, yy.
    pub(crate) along: [f64; 3],
}

impl NearWall {
    /// For `n` vertices, whose damping rate far from walls is `far`.
    pub(crate) fn new(drag: NearWallDrag, n: usize, far: f64) -> Self {
        Self { drag, ring: Ring::at(n, [0.0; 2]), far, z: Vec::new(), tx: Vec::new(), ty: Vec::new(), along: [0.0; 3] }
    }

    /// Takes over a shape.
    pub(crate) fn take(&mut self, shape: &Polygon, origin: [f64; 2], even: &Even) {
        let n = shape.len();
        self.ring.x[..n].copy_from_slice(&shape.x);
        self.ring.y[..n].copy_from_slice(&shape.y);
        self.ring.origin = origin;
        self.ring.close();
        self.drag.update(f64::INFINITY, &self.ring);
        let mass = MASS / n as f64;
        self.z.clear();
        self.z.extend(self.drag.rates()[..n].iter().map(|rate| mass * (rate - self.far).max(0.0)));
        self.tx.clone_from(&even.tx);
        self.ty.clone_from(&even.ty);
        self.along = [0.0; 3];
        for i in 0..n {
            let (z, tx, ty) = (self.z[i], self.tx[i], self.ty[i]);
            for (sum, term) in self.along.iter_mut().zip([z * tx * tx, z * tx * ty, z * ty * ty]) {
                *sum += term;
            }
        }
    }

    /// Adds to `out` the drag at the velocities `v` of the vertices, if the centroid has the velocity `centroid` and
    /// its gradients are `gx`, `gy`.
    pub(crate) fn add_drag(&self, v: &[f64], centroid: [f64; 2], gx: &[f64], gy: &[f64], out: &mut [f64]) {
        let ([xx, xy, yy], [cx, cy]) = (self.along, centroid);
        let (fx, fy) = (xx * cx + xy * cy, xy * cx + yy * cy);
        for i in 0..self.z.len() {
            let (nx, ny) = (self.ty[i], -self.tx[i]);
            let push = self.z[i] * (v[2 * i] * nx + v[2 * i + 1] * ny);
            out[2 * i] += push * nx + gx[2 * i] * fx + gy[2 * i] * fy;
            out[2 * i + 1] += push * ny + gx[2 * i + 1] * fx + gy[2 * i + 1] * fy;
        }
    }
}

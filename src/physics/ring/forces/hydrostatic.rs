//! Gravity as hydrostatic pressure: `U = -M C_x` with C_x the centroid of the polygon's area, not of its vertices.
//!
//! With `S = sum (x_i + x_{i+1}) c_i`, `c_i = x_i y_{i+1} - x_{i+1} y_i`, and the area `a = (1/2) sum c_i`, the
//! centroid is `C_x = S/(6a)` and the force `M [grad S/(6a) - (C_x/a) grad a]`. It acts along the normal only, and does
//! not drag vertices along the interface as [`crate::physics::ring::forces::gravity`] does.

use crate::parameters::MASS;
use crate::physics::ring::forces::stiffness::{Parts, Stiffness};
use crate::physics::ring::{Ring, forces::RingForce};

/// Hydrostatic pressure of the droplet's weight.
#[derive(Clone, Copy, Debug)]
pub struct Hydrostatic;

/// Area and moment `S` of the ring, in local coordinates.
fn area_and_moment(ring: &Ring) -> (f64, f64) {
    let (mut twice_area, mut moment) = (0.0, 0.0);
    for i in 0..ring.n {
        let cross = ring.x[i] * ring.y[i + 1] - ring.x[i + 1] * ring.y[i];
        twice_area += cross;
        moment += (ring.x[i] + ring.x[i + 1]) * cross;
    }
    (0.5 * twice_area, moment)
}

impl RingForce for Hydrostatic {
    fn moved(&mut self, _: f64, _: &Ring) {}

    fn acts(&self) -> bool {
        true
    }

    fn add(&self, ring: &mut Ring) {
        let (area, moment) = area_and_moment(ring);
        let (of_moment, of_area) = (MASS / (6.0 * area), MASS * moment / (6.0 * area * area));
        let n = ring.n;
        let (mut xb, mut yb) = (ring.x[n - 1], ring.y[n - 1]);
        for i in 0..n {
            let (x, y, xf, yf) = (ring.x[i], ring.y[i], ring.x[i + 1], ring.y[i + 1]);
            let (ahead, behind) = (x * yf - xf * y, xb * y - x * yb);
            let moment_x = ahead + behind + (x + xf) * yf - (xb + x) * yb;
            let moment_y = (xb + x) * xb - (x + xf) * xf;
            ring.force_x[i] += of_moment * moment_x - of_area * 0.5 * (yf - yb);
            ring.force_y[i] += of_moment * moment_y + of_area * 0.5 * (xf - xb);
            (xb, yb) = (x, y);
        }
    }

    /// `-M [S''/(6a) - (C_x/a) a'']`, sums over edges. Products of the gradients of S and a are left out, because they
    /// matter only if the area changes, which K_a prevents. The matrix is indefinite, so it has no positive part here.
    fn add_stiffness(&self, ring: &Ring, parts: Parts, stiffness: &mut Stiffness) {
        if parts == Parts::Positive {
            return;
        }
        let (area, moment) = area_and_moment(ring);
        let of_moment = -MASS / (6.0 * area);
        let of_area = MASS * moment / (12.0 * area * area);
        for i in 0..ring.n {
            let (x0, y0, x1, y1) = (ring.x[i], ring.y[i], ring.x[i + 1], ring.y[i + 1]);
            stiffness.own_xx[i] += 2.0 * of_moment * y1;
            stiffness.own_xy[i] -= of_moment * x1;
            stiffness.own_xx[i + 1] -= 2.0 * of_moment * y0;
            stiffness.own_xy[i + 1] += of_moment * x0;
            stiffness.next_xx[i] += of_moment * (y1 - y0);
            stiffness.next_xy[i] += of_moment * (2.0 * x0 + x1) + of_area;
            stiffness.next_yx[i] -= of_moment * (x0 + 2.0 * x1) + of_area;
        }
    }

    fn energy(&self, ring: &Ring) -> f64 {
        let (area, moment) = area_and_moment(ring);
        -MASS * (moment / (6.0 * area) + ring.origin[0])
    }
}

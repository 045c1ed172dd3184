//! The ring of a deformable particle, and what acts on it.
//!
//! Each coordinate has one array, in which the vertices stand counter-clockwise. Positions are relative to an `origin`
//! that follows the droplet in multiples of `ORIGIN_STEP`, so that rounding does not grow with the distance travelled.
//! Entries from `n` on repeat vertex 0: they add exact zeros to every sum, so no loop needs a tail.
//!
//! This folder knows geometry, energies and forces, but not how time advances. Read [`Ring`] first, then [`forces`]
//! with a file for each effect, [`effects`] for all of them together, and `passes` for the loops that take most of the
//! time.

pub mod effects;
pub mod forces;
pub(crate) mod passes;

use crate::parameters::{MASS, regular_edge};
use crate::physics::simd::{LANES, aligned::Aligned, padded};
use std::f64::consts::PI;

/// The origin moves by multiples of this, which rounds no position.
pub(crate) const ORIGIN_STEP: f64 = 4.0;

/// State and scratch of a ring of `n` vertices.
#[derive(Clone, Debug)]
pub struct Ring {
    /// Number of vertices.
    pub n: usize,
    /// x of each vertex relative to the origin, `padded(n) + 8` long.
    pub x: Aligned,
    /// y of each vertex, as long as `x`.
    pub y: Aligned,
    /// x of each velocity, half a step before the positions, `padded(n)` long, zero from `n` on.
    pub ux: Aligned,
    /// y of each velocity, as long as `ux`.
    pub uy: Aligned,
    /// Origin of the local coordinates.
    pub origin: [f64; 2],
    // This and the following arrays are scratch. Edge `i`, from vertex i to i + 1, stands at `8 + i`, edge -1 at 7.
    pub(crate) edge_x: Aligned,
    pub(crate) edge_y: Aligned,
    /// Tension over smoothed length of each edge.
    pub(crate) coefficient: Aligned,
    /// Forces of walls and other forces; entry `n` holds forces that are to be added to vertex 0.
    pub(crate) force_x: Aligned,
    pub(crate) force_y: Aligned,
}

impl Ring {
    /// A ring whose vertices all lie at rest at the origin of its local coordinates.
    pub(crate) fn at(n: usize, origin: [f64; 2]) -> Self {
        let (short, long) = (|| Aligned::zeros(padded(n)), || Aligned::zeros(padded(n) + LANES));
        Self {
            n,
            x: long(),
            y: long(),
            ux: short(),
            uy: short(),
            edge_x: long(),
            edge_y: long(),
            coefficient: long(),
            force_x: long(),
            force_y: long(),
            origin,
        }
    }

    /// A regular ring of radius `radius` at rest around `centre`.
    pub fn regular(n: usize, centre: [f64; 2], radius: f64) -> Self {
        let mut ring = Self::at(n, centre.map(|c| (c / ORIGIN_STEP).round() * ORIGIN_STEP));
        for i in 0..n {
            let (sin, cos) = libm::sincos(2.0 * PI * i as f64 / n as f64);
            ring.x[i] = centre[0] - ring.origin[0] + radius * cos;
            ring.y[i] = centre[1] - ring.origin[1] + radius * sin;
        }
        ring.close();
        ring
    }

    /// Radius of the regular ring of area a0 = pi/4: `l0/(2 sin(pi/N_v))`.
    pub fn regular_radius(n: usize) -> f64 {
        regular_edge(n) / (2.0 * libm::sin(PI / n as f64))
    }

    /// Repeats vertex 0 behind the last vertex, and sets the velocities of the padding to zero.
    #[inline(always)]
    pub fn close(&mut self) {
        let (first_x, first_y, n) = (self.x[0], self.y[0], self.n);
        self.x[n..].fill(first_x);
        self.y[n..].fill(first_y);
        self.ux[n..].fill(0.0);
        self.uy[n..].fill(0.0);
    }

    /// Mass of one vertex, `m = M/N_v`.
    #[inline(always)]
    pub(crate) fn vertex_mass(&self) -> f64 {
        MASS / self.n as f64
    }

    /// Speed of the fastest vertex.
    pub(crate) fn fastest(&self) -> f64 {
        self.ux.iter().zip(self.uy.iter()).fold(0.0_f64, |most, (x, y)| most.max(x * x + y * y)).sqrt()
    }

    /// Vertex positions in world coordinates, unwrapped.
    pub(crate) fn world_vertices(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..self.n).map(|i| [self.x[i] + self.origin[0], self.y[i] + self.origin[1]])
    }

    /// Smallest box around the ring in local coordinates: `[x_min, x_max, y_min, y_max]`.
    pub(crate) fn bounds(&self) -> [f64; 4] {
        let ends = |v: &[f64]| v.iter().fold([f64::MAX, f64::MIN], |[lo, hi], &c| [lo.min(c), hi.max(c)]);
        let ([x0, x1], [y0, y1]) = (ends(&self.x[..self.n]), ends(&self.y[..self.n]));
        [x0, x1, y0, y1]
    }

    /// Area `a = (1/2) sum (x_i y_{i+1} - x_{i+1} y_i)` and perimeter `sum l_i` with the true edge length.
    pub fn area_and_perimeter(&self) -> (f64, f64) {
        let (mut twice_area, mut perimeter) = (0.0, 0.0);
        for i in 0..self.n {
            let (ex, ey) = (self.x[i + 1] - self.x[i], self.y[i + 1] - self.y[i]);
            twice_area += self.x[i] * ey - self.y[i] * ex;
            perimeter += (ex * ex + ey * ey).sqrt();
        }
        (0.5 * twice_area, perimeter)
    }

    /// Area centroid in local coordinates, and its velocity if the vertices have the velocities `v`.
    ///
    /// `C = sum (r_i + r_{i+1}) c_i/(6a)` with `c_i` the cross product of neighbours. The velocity is its time derivative.
    pub(crate) fn centroid(&self, vx: &[f64], vy: &[f64]) -> ([f64; 2], [f64; 2]) {
        // Places relative to vertex 0 keep cancellation small.
        let (x0, y0) = (self.x[0], self.y[0]);
        let (ux0, uy0) = (vx[0], vy[0]);
        let (mut twice_area, mut rate) = (0.0, 0.0);
        let (mut moment, mut moment_rate) = ([0.0; 2], [0.0; 2]);
        for i in 0..self.n {
            let j = if i + 1 == self.n { 0 } else { i + 1 };
            let (ax, ay, bx, by) = (self.x[i] - x0, self.y[i] - y0, self.x[j] - x0, self.y[j] - y0);
            let (aux, auy, bux, buy) = (vx[i] - ux0, vy[i] - uy0, vx[j] - ux0, vy[j] - uy0);
            let cross = ax * by - bx * ay;
            let cross_rate = aux * by + ax * buy - bux * ay - bx * auy;
            twice_area += cross;
            rate += cross_rate;
            moment[0] += (ax + bx) * cross;
            moment[1] += (ay + by) * cross;
            moment_rate[0] += (aux + bux) * cross + (ax + bx) * cross_rate;
            moment_rate[1] += (auy + buy) * cross + (ay + by) * cross_rate;
        }
        let scale = 1.0 / (3.0 * twice_area);
        let relative = moment.map(|m| m * scale);
        let speed = |k: usize| moment_rate[k] * scale - relative[k] * rate / twice_area;
        ([x0 + relative[0], y0 + relative[1]], [ux0 + speed(0), uy0 + speed(1)])
    }

    /// Whether the point (local coordinates) lies inside the ring: its winding number is not zero.
    pub(crate) fn contains(&self, px: f64, py: f64) -> bool {
        let mut winding = 0_i32;
        for i in 0..self.n {
            let (ax, ay, bx, by) = (self.x[i] - px, self.y[i] - py, self.x[i + 1] - px, self.y[i + 1] - py);
            let cross = ax * by - bx * ay;
            if ay <= 0.0 && by > 0.0 && cross > 0.0 {
                winding += 1;
            } else if ay > 0.0 && by <= 0.0 && cross < 0.0 {
                winding -= 1;
            }
        }
        winding != 0
    }

    /// Moves the origin next to vertex 0, if that is more than a step away.
    pub(crate) fn follow(&mut self) {
        let shift = [self.x[0], self.y[0]].map(|c| (c / ORIGIN_STEP).trunc() * ORIGIN_STEP);
        if shift == [0.0, 0.0] {
            return;
        }
        self.x.iter_mut().for_each(|x| *x -= shift[0]);
        self.y.iter_mut().for_each(|y| *y -= shift[1]);
        self.origin = [self.origin[0] + shift[0], self.origin[1] + shift[1]];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_regular_ring_has_the_rest_area_and_edge() {
        for n in [8, 63, 256] {
            let ring = Ring::regular(n, [250.0, 250.0], Ring::regular_radius(n));
            let (area, perimeter) = ring.area_and_perimeter();
            assert!((area / MASS - 1.0).abs() < 1e-12);
            assert!((perimeter / (n as f64 * regular_edge(n)) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_centroid_moves_with_the_velocity_it_states() {
        let mut ring = Ring::regular(60, [1.0, 2.0], 0.5);
        let vx: Vec<f64> = (0..60).map(|i| libm::sin(0.7 * f64::from(i))).collect();
        let vy: Vec<f64> = (0..60).map(|i| libm::cos(1.3 * f64::from(i))).collect();
        for i in 0..60 {
            ring.x[i] += 0.05 * vy[i];
        }
        ring.close();
        let (_, velocity) = ring.centroid(&vx, &vy);
        let moved = |h: f64| {
            let mut r = ring.clone();
            for i in 0..60 {
                r.x[i] += h * vx[i];
                r.y[i] += h * vy[i];
            }
            r.close();
            r.centroid(&vx, &vy).0
        };
        let (ahead, behind) = (moved(1e-6), moved(-1e-6));
        for k in 0..2 {
            assert!(((ahead[k] - behind[k]) / 2e-6 - velocity[k]).abs() < 1e-7);
        }
    }

    #[test]
    fn inside_and_outside_are_told_apart() {
        let ring = Ring::regular(32, [0.0, 0.0], 0.5);
        assert!(ring.contains(0.1, -0.2) && ring.contains(0.0, 0.0));
        assert!(!ring.contains(0.6, 0.0) && !ring.contains(0.4, 0.4));
    }

    #[test]
    fn following_the_droplet_does_not_move_it() {
        let mut ring = Ring::regular(16, [3.0, -1.0], 0.5);
        ring.x.iter_mut().for_each(|x| *x += 9.0);
        let before: Vec<_> = ring.world_vertices().collect();
        ring.follow();
        assert!(ring.x[0].abs() < ORIGIN_STEP);
        for (a, b) in before.iter().zip(ring.world_vertices()) {
            assert!((a[0] - b[0]).abs() < 1e-14 && a[1] == b[1]);
        }
    }
}

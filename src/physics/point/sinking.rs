//! Steps of a soft particle without inertia, for the descent to its equilibrium: backward Euler of
//! `M lambda dx/dt = F(x)`, by Newton's method with the exact second derivatives.

use crate::parameters::MASS;
use crate::physics::point::{SKIN, SoftMotion};
use crate::physics::walls::wall::{Obstacle, Walls};

/// A step is given up after so many iterations.
const MOST_ITERATIONS: u32 = 50;

/// A step ends with a correction below this, in sigma.
const PRECISION: f64 = 1e-12;

/// The largest distance in one step, in sigma. It is less than the skin of the list of near walls.
const LARGEST_MOVE: f64 = 0.1 * SKIN;

impl<W: Walls> SoftMotion<W> {
    /// Takes a step of `h` t0 without inertia; returns how far the point moved. `None`, and it stays, where the energy
    /// is not convex enough for a unique solution.
    pub(in crate::physics) fn sink(&mut self, h: f64) -> Option<f64> {
        self.list_near();
        let rate = if self.effects.b0 > 0.0 { self.drag_rate(self.position) } else { self.effects.far_rate };
        let (begin, weight) = (self.position, MASS * rate / h);
        let mut at = begin;
        for _ in 0..MOST_ITERATIONS {
            let (force, [xx, xy, yy]) = self.force_and_stiffness(at);
            let (xx, yy) = (xx + weight, yy + weight);
            let determinant = xx * yy - xy * xy;
            if !(xx > 0.0 && determinant > 0.0) {
                return None;
            }
            let push = [0, 1].map(|k| force[k] - weight * (at[k] - begin[k]));
            let step = [(yy * push[0] - xy * push[1]) / determinant, (xx * push[1] - xy * push[0]) / determinant];
            at = [at[0] + step[0], at[1] + step[1]];
            let moved = libm::hypot(at[0] - begin[0], at[1] - begin[1]);
            if !(moved <= LARGEST_MOVE) {
                return None;
            }
            if libm::hypot(step[0], step[1]) <= PRECISION {
                self.position = at;
                return Some(moved);
            }
        }
        None
    }

    /// The force at a place and the second derivatives of the energy: `4 E_w [n n^T - (depth/d) (1 - n n^T)]` for each
    /// wall, with the distance d from its corner.
    pub(super) fn force_and_stiffness(&self, [x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
        let (reach, stiffness) = (self.reach(), 4.0 * self.effects.stiffness);
        let (mut force, mut second) = ([self.effects.weight, 0.0], [0.0; 3]);
        for obstacle in &self.near.items {
            let Some((depth, [nx, ny])) = obstacle.touch_point(x, y, reach) else { continue };
            let turning = depth * obstacle.curvature_at(x, y);
            force = [force[0] + stiffness * depth * nx, force[1] + stiffness * depth * ny];
            second[0] += stiffness * (nx * nx - turning * ny * ny);
            second[1] += stiffness * (nx * ny + turning * nx * ny);
            second[2] += stiffness * (ny * ny - turning * nx * nx);
        }
        (force, second)
    }

    /// World coordinates of the point, and its potential energy.
    pub(in crate::physics) fn place_and_energy(&self) -> ([f64; 2], f64) {
        let [x, y] = self.position;
        let world = [x + self.origin[0], y + self.origin[1]];
        let touches = self.near.items.iter().filter_map(|obstacle| obstacle.touch_point(x, y, self.reach()));
        let pushed: f64 = touches.map(|(depth, _)| 2.0 * self.effects.stiffness * depth * depth).sum();
        (world, pushed - self.effects.weight * world[0])
    }
}

//! How vertices meet walls while Newton's method looks for a shape.
//!
//! Walls are so stiff that a vertex overlaps them by a millionth of sigma. A step of Newton's method follows straight
//! lines, and leaves a round wall by more than that, or enters it. Then contacts would open and close for ever.

use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::Potential;
use crate::physics::walls::wall::{Obstacle, Walls};
use std::f64::consts::PI;

/// Vertices that a step has moved away from a wall by more than this have left it, in sigma.
const NEAR: f64 = 0.01;

impl<W: Walls> Potential<W> {
    /// The largest push on one of `n` vertices: at a sharp tip it carries at most twice the tension, and pressures are of
    /// the order of g rho sigma.
    pub(crate) fn largest_push(&self, n: usize) -> f64 {
        2.0 * (self.gamma + PI / n as f64)
    }

    /// Puts vertices that a step of Newton's method has moved from `before` to `shape` as deep into walls as the step
    /// foresaw, along the curved surface. Those that it has moved into a wall get the depth of the largest push.
    pub(crate) fn settle_on_walls(&self, before: &Polygon, shape: &mut Polygon, nearby: &Nearby<W::Obstacle>) {
        let most = self.largest_push(shape.len()) / self.k_w;
        for near in &nearby.obstacles {
            for &i in &near.vertices {
                let ([x, y], [x0, y0]) = (shape.at(i), before.at(i));
                let seen = near.obstacle.touch_point(x, y, self.reach + NEAR);
                let Some((depth, [nx, ny])) = seen.map(|(depth, normal)| (depth - NEAR, normal)) else { continue };
                let foreseen = near
                    .obstacle
                    .touch_point(x0, y0, self.reach)
                    .map_or(0.0, |(depth, [mx, my])| depth - mx * (x - x0) - my * (y - y0));
                let out = if foreseen > 0.0 { depth - foreseen.min(most) } else { (depth - most).max(0.0) };
                shape.x[i] += out * nx;
                shape.y[i] += out * ny;
            }
        }
    }
}

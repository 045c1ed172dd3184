//! The loads that obstacles carry.

use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::{Evaluation, Potential};
use crate::physics::ring::forces::contact::{Load, add_load, finish_load};
use crate::physics::walls::wall::{Obstacle, Walls};
use crate::results::outline::LoadRecord;

/// The loads on a droplet of this shape, in world coordinates and in the order of the obstacles.
pub(super) fn of<W: Walls>(
    potential: &Potential<W>,
    shape: &Polygon,
    nearby: &Nearby<W::Obstacle>,
    seen: &Evaluation,
    [x0, y0]: [f64; 2],
) -> Vec<LoadRecord> {
    let mut loads: Vec<Load> = Vec::new();
    let liquid = potential.load(seen);
    for near in &nearby.obstacles {
        let id = near.obstacle.id();
        for string in seen.strings.iter().filter(|string| string.obstacle == id) {
            let g = string.force(&liquid).gradient;
            let force = [-(g[0] + g[2]), -(g[1] + g[3])];
            let total = (force[0] * force[0] + force[1] * force[1]).sqrt();
            if total > 0.0 {
                let normal = force.map(|f| f / total);
                let at = [0, 1].map(|k| string.centre[k] + normal[k] * potential.reach);
                // Pushes that are spread over the angle psi cancel in part.
                let half = 0.5 * string.turn();
                let spread = if half > 1e-6 { half / libm::sin(half) } else { 1.0 };
                add_load(&mut loads, id, at, normal.map(|n| n / spread), total * spread);
            }
        }
        for &i in &near.vertices {
            let [x, y] = shape.at(i);
            if let Some((depth, normal)) = near.obstacle.touch_point(x, y, potential.reach) {
                add_load(&mut loads, id, [x, y], normal, potential.k_w * depth);
            }
        }
    }
    let record = |mut load: Load| {
        finish_load(&mut load);
        let Load { id, at, force, turn } = load;
        LoadRecord { obstacle: id, x: at[0] + x0, y: at[1] + y0, fx: force[0], fy: force[1], turn }
    };
    loads.into_iter().map(record).collect()
}

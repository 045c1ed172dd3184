//! What is measured on a soft particle.

use crate::parameters::MASS;
use crate::physics::observation::Observation;
use crate::physics::point::SoftMotion;
use crate::physics::walls::wall::{Obstacle, Walls};
use crate::results::outline::{LoadRecord, Outline};

impl<W: Walls> SoftMotion<W> {
    /// The outline at time `t`: one point, and the loads on it, each at the surface of its wall.
    pub fn outline(&self, t: f64) -> Outline {
        self.outline_at([0, 1].map(|k| self.position[k] + self.origin[k]), t)
    }

    /// The outline of a point at `world`, whose walls are listed.
    pub(in crate::physics) fn outline_at(&self, world: [f64; 2], t: f64) -> Outline {
        let [x, y] = [0, 1].map(|k| world[k] - self.origin[k]);
        let mut loads = Vec::new();
        for obstacle in &self.near.items {
            if let Some((overlap, [nx, ny])) = obstacle.touch_point(x, y, self.reach()) {
                let (push, to_surface) = (4.0 * self.effects.stiffness * overlap, 0.5 - overlap);
                let at = [world[0] - to_surface * nx, world[1] - to_surface * ny];
                let (fx, fy) = (push * nx, push * ny);
                loads.push(LoadRecord { obstacle: obstacle.id(), x: at[0], y: at[1], fx, fy, turn: 0.0 });
            }
        }
        Outline { t, x: vec![world[0]], y: vec![world[1]], loads }
    }

    /// Measures everything that is recorded.
    pub fn observe(&mut self) -> Observation {
        self.forget();
        let force = self.force(self.position);
        let rate = if self.effects.b0 > 0.0 { self.drag_rate(self.position) } else { self.effects.far_rate };
        let damping = 1.0 + 0.5 * self.dt * rate;
        let velocity = [0, 1].map(|k| (self.velocity[k] + 0.5 * self.dt / MASS * force[k]) / damping);
        self.measure(velocity)
    }

    /// Measures everything that is recorded, of a point with this velocity.
    pub(in crate::physics) fn measure(&self, velocity: [f64; 2]) -> Observation {
        let (mut overlap, mut contacts, mut potential) = (0.0_f64, 0, 0.0);
        for obstacle in &self.near.items {
            let touch = obstacle.touch_point(self.position[0], self.position[1], self.reach());
            if let Some((depth, _)) = touch {
                overlap = overlap.max(depth);
                contacts += 1;
                potential += 2.0 * self.effects.stiffness * depth * depth;
            }
        }
        let x = self.position[0] + self.origin[0];
        Observation {
            x,
            y: self.position[1] + self.origin[1],
            velocity: velocity[0],
            kinetic: 0.5 * MASS * (velocity[0] * velocity[0] + velocity[1] * velocity[1]),
            potential: potential - self.effects.weight * x,
            shape: None,
            area_error: None,
            overlap,
            contacts,
        }
    }
}

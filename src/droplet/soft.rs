//! The soft particle: one point of mass M that discs push away ([C24] eqs 8-11).
//!
//! For every disc with `d = |r - r_ob| - sigma_ob/2 < sigma/2`: `U = (E_w/2)(1 - 2d/sigma)^2`, a force
//! `2 (E_w/sigma)(1 - 2d/sigma)` along the line of centres. On a plate the point sinks `delta_s = pi/(16 E_w)`.
//!
//! Time advances by the same scheme as the ring's ([`crate::integrator::verlet`]).

use super::Observation;
use crate::droplet::deformable::ORIGIN_STEP;
use crate::job::MASS;
use crate::scene::obstacles::{Disc, ObstacleArray};
use crate::shape::{LoadRecord, ShapeRecord};
use std::sync::Arc;

/// How far the point may move before its list of near discs is made again, in sigma.
const SKIN: f64 = 0.1;

/// A soft particle among discs.
#[derive(Clone, Debug)]
pub struct SoftMotion {
    /// Position relative to the origin.
    position: [f64; 2],
    /// Velocity half a step ahead of the position before.
    velocity: [f64; 2],
    origin: [f64; 2],
    stiffness: f64,
    /// Force along +x: the weight, or nothing while the droplet is put in place.
    weight: f64,
    drag_rate: f64,
    dt: f64,
    discs: Arc<ObstacleArray>,
    near: Vec<Disc>,
    slack: f64,
}

impl SoftMotion {
    /// A point at rest at `position` (world), its first half step taken.
    pub fn start(
        position: [f64; 2],
        e_w: f64,
        weight: f64,
        drag_rate: f64,
        dt: f64,
        discs: Arc<ObstacleArray>,
    ) -> Self {
        let origin = position.map(|c| (c / ORIGIN_STEP).round() * ORIGIN_STEP);
        let mut motion = Self {
            position: [position[0] - origin[0], position[1] - origin[1]],
            velocity: [0.0; 2],
            origin,
            stiffness: e_w,
            weight,
            drag_rate,
            dt,
            discs,
            near: Vec::new(),
            slack: f64::NEG_INFINITY,
        };
        motion.list_near();
        let force = motion.force();
        for k in 0..2 {
            motion.velocity[k] = 0.5 * dt / MASS * force[k];
            motion.position[k] += dt * motion.velocity[k];
        }
        motion
    }

    /// Distance of centres below which a disc pushes.
    fn reach(&self) -> f64 {
        0.5 + self.discs.radius
    }

    #[inline(never)]
    fn list_near(&mut self) {
        let far = self.reach() + SKIN;
        let [x, y] = self.position;
        let near = &mut self.near;
        near.clear();
        self.discs.for_each_in(self.origin, [x - far, x + far, y - far, y + far], |disc| {
            if (disc.x - x) * (disc.x - x) + (disc.y - y) * (disc.y - y) < far * far {
                near.push(disc);
            }
        });
        near.sort_by_key(|disc| disc.id);
        self.slack = SKIN;
    }

    /// Force at the present position, drag apart.
    #[inline(always)]
    fn force(&self) -> [f64; 2] {
        let reach = self.reach();
        let mut force = [self.weight, 0.0];
        for disc in &self.near {
            let (dx, dy) = (self.position[0] - disc.x, self.position[1] - disc.y);
            let square = dx * dx + dy * dy;
            if square < reach * reach {
                // 1 - 2d/sigma = 2 (reach - distance) at sigma = 1.
                let distance = square.sqrt();
                let push = 4.0 * self.stiffness * (reach - distance) / distance.max(1e-300);
                force[0] += push * dx;
                force[1] += push * dy;
            }
        }
        force
    }

    /// Takes `steps` time steps.
    pub fn advance(&mut self, steps: u64) {
        let damping = 0.5 * self.dt * self.drag_rate;
        let (keep, push) = ((1.0 - damping) / (1.0 + damping), self.dt / MASS / (1.0 + damping));
        for _ in 0..steps {
            let force = self.force();
            for k in 0..2 {
                self.velocity[k] = self.velocity[k] * keep + force[k] * push;
                self.position[k] += self.dt * self.velocity[k];
            }
            let [vx, vy] = self.velocity;
            self.slack -= self.dt * (vx.abs() + vy.abs());
            if self.slack < 0.0 {
                self.list_near();
            }
        }
    }

    /// Moves the origin next to the point.
    pub fn follow(&mut self) {
        let shift = self.position.map(|c| (c / ORIGIN_STEP).trunc() * ORIGIN_STEP);
        if shift != [0.0, 0.0] {
            for k in 0..2 {
                self.position[k] -= shift[k];
                self.origin[k] += shift[k];
            }
            self.list_near();
        }
    }

    /// The point at time `t`, and the loads on it; each acts where the line of centres meets the surface of its disc.
    pub fn shape(&self, t: f64) -> ShapeRecord {
        let world = [self.position[0] + self.origin[0], self.position[1] + self.origin[1]];
        let mut loads = Vec::new();
        for disc in &self.near {
            let (dx, dy) = (self.position[0] - disc.x, self.position[1] - disc.y);
            let distance = (dx * dx + dy * dy).sqrt().max(1e-300);
            let push = 4.0 * self.stiffness * (self.reach() - distance);
            if push > 0.0 {
                let (nx, ny) = (dx / distance, dy / distance);
                let surface = distance - self.discs.radius;
                let (x, y) = (world[0] - surface * nx, world[1] - surface * ny);
                loads.push(LoadRecord { obstacle: disc.id, x, y, fx: push * nx, fy: push * ny, turn: 0.0 });
            }
        }
        ShapeRecord { t, x: vec![world[0]], y: vec![world[1]], loads }
    }

    /// Everything that is recorded, at the present position.
    pub fn observe(&self) -> Observation {
        let force = self.force();
        let damping = 1.0 + 0.5 * self.dt * self.drag_rate;
        let velocity = [0, 1].map(|k| (self.velocity[k] + 0.5 * self.dt / MASS * force[k]) / damping);
        let (mut overlap, mut contacts, mut potential) = (0.0_f64, 0, 0.0);
        for disc in &self.near {
            let (dx, dy) = (self.position[0] - disc.x, self.position[1] - disc.y);
            let depth = self.reach() - (dx * dx + dy * dy).sqrt();
            if depth > 0.0 {
                overlap = overlap.max(depth);
                contacts += 1;
                potential += 2.0 * self.stiffness * depth * depth;
            }
        }
        let x = self.position[0] + self.origin[0];
        Observation {
            x,
            y: self.position[1] + self.origin[1],
            velocity: velocity[0],
            kinetic: 0.5 * MASS * (velocity[0] * velocity[0] + velocity[1] * velocity[1]),
            potential: potential - self.weight * x,
            shape: None,
            area_error: None,
            overlap,
            contacts,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_on_one_disc_sinks_by_pi_over_16_e_w() {
        // Head-on to one disc, gravity is balanced as on a plate: 4 E_w delta = M.
        let discs = Arc::new(ObstacleArray::from_centres(50.0, 0.15, &[25.0], &[25.0]));
        for e_w in [0.5, 5.0, 100.0] {
            let mut motion = SoftMotion::start([24.3, 25.0], e_w, MASS, 33.0, 1e-3, discs.clone());
            motion.advance(400_000);
            let sunk = 0.65 - (25.0 - motion.observe().x);
            assert!((sunk / (std::f64::consts::PI / (16.0 * e_w)) - 1.0).abs() < 1e-9, "{e_w}: {sunk}");
        }
    }

    #[test]
    fn force_is_minus_the_gradient_of_the_energy() {
        let discs = Arc::new(ObstacleArray::from_centres(50.0, 0.15, &[25.0, 25.4], &[25.0, 25.9]));
        let at = |x: f64, y: f64| {
            let mut motion = SoftMotion::start([x, y], 7.0, MASS, 33.0, 1e-9, discs.clone());
            motion.position = [x - motion.origin[0], y - motion.origin[1]];
            motion
        };
        let h = 1e-6;
        let force = at(24.7, 25.5).force();
        let slope_x = (at(24.7 + h, 25.5).observe().potential - at(24.7 - h, 25.5).observe().potential) / (2.0 * h);
        let slope_y = (at(24.7, 25.5 + h).observe().potential - at(24.7, 25.5 - h).observe().potential) / (2.0 * h);
        assert!((force[0] + slope_x).abs() < 1e-6 * force[0].abs());
        assert!((force[1] + slope_y).abs() < 1e-6 * force[1].abs());
    }
}

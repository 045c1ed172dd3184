//! The soft particle: one point of mass M that walls push away ([C24] eqs 8-11).
//!
//! For every wall whose surface is nearer than `d = sigma/2`: `U = (E_w/2)(1 - 2d/sigma)^2`, a force
//! `2 (E_w/sigma)(1 - 2d/sigma)` along the normal. On a plate the point sinks `delta_s = pi/(16 E_w)`.
//!
//! Time advances by the same scheme as the ring's ([`crate::physics::motion::verlet`]).

use crate::on_instruction_set;
use crate::parameters::MASS;
use crate::physics::observation::Observation;
use crate::physics::ring::ORIGIN_STEP;
use crate::physics::simd::InstructionSet;
use crate::physics::walls::wall::{Obstacle, Walls};
use crate::results::outline::{LoadRecord, Outline};
use fearless_simd::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How far the point may move before its list of near walls is made again, in sigma.
const SKIN: f64 = 0.1;

/// Smallest distance that the near-wall drag knows, in sigma: the rim of a soft particle sinks into walls.
const NEAREST: f64 = 0.01;

/// A force along y too small to move anything: without it the velocity of a droplet that falls freely dies away until it is
/// so small a number (denormal) that processors take twenty times as long over it.
const NEXT_TO_NOTHING: f64 = 1e-200;

/// What acts on a soft particle.
#[derive(Clone, Copy, Debug)]
pub struct SoftEffects {
    /// E_w.
    pub stiffness: f64,
    /// Force along +x: the weight, or nothing while the droplet is put in place.
    pub weight: f64,
    /// Damping rate far from walls, `1/V_t`.
    pub far_rate: f64,
    /// Strength of the near-wall drag, `b0/b_inf`.
    pub b0: f64,
    /// Its exponent.
    pub alpha: f64,
}

/// A soft particle among walls.
#[derive(Clone, Debug)]
pub struct SoftMotion<W: Walls> {
    /// Position relative to the origin.
    position: [f64; 2],
    /// Velocity half a step before the position.
    velocity: [f64; 2],
    origin: [f64; 2],
    effects: SoftEffects,
    dt: f64,
    walls: Arc<W>,
    near: Vec<W::Obstacle>,
    /// What each of them remembers of the step before ([`Obstacle::push_point`]).
    memories: Vec<f64>,
    instruction_set: InstructionSet,
    /// How far from a skeleton the listed walls may be, so that the nearest is among them.
    far: f64,
    slack: f64,
    /// Where the point was when the list was made.
    listed_at: [f64; 2],
}

/// What decides how a soft particle goes on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoftState {
    position: [f64; 2],
    velocity: [f64; 2],
    origin: [f64; 2],
    listed_at: [f64; 2],
    slack: f64,
}

impl<W: Walls> SoftMotion<W> {
    /// A point at rest at `position` (world): its velocity half a step before, `u = -dt/2 F/M`, is what makes `v` zero now.
    pub fn start(
        position: [f64; 2],
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        let origin = position.map(|c| (c / ORIGIN_STEP).round() * ORIGIN_STEP);
        let mut motion =
            Self::at([position[0] - origin[0], position[1] - origin[1]], origin, effects, dt, walls, instruction_set);
        motion.list_near();
        let force = motion.force(motion.position);
        motion.velocity = force.map(|force| -0.5 * dt / MASS * force);
        motion
    }

    /// A point that nothing is known of but its place.
    fn at(
        position: [f64; 2],
        origin: [f64; 2],
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        Self {
            position,
            velocity: [0.0; 2],
            origin,
            effects,
            dt,
            walls,
            near: Vec::new(),
            memories: Vec::new(),
            instruction_set,
            far: 0.0,
            slack: f64::NEG_INFINITY,
            listed_at: [f64::NAN; 2],
        }
    }

    /// Its state between two steps.
    pub fn state(&self) -> SoftState {
        let Self { position, velocity, origin, listed_at, slack, .. } = *self;
        SoftState { position, velocity, origin, listed_at, slack }
    }

    /// Goes on from `state`. The list is made where it was: with near-wall drag it decides how far is looked, and so the last bits.
    pub fn resume(
        state: SoftState,
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        let SoftState { position, velocity, origin, listed_at, slack } = state;
        let mut motion = Self::at(listed_at, origin, effects, dt, walls, instruction_set);
        motion.list_near();
        (motion.position, motion.velocity, motion.slack) = (position, velocity, slack);
        motion
    }

    /// Distance from a skeleton below which a wall pushes.
    fn reach(&self) -> f64 {
        0.5 + self.walls.surface()
    }

    /// Lists the walls in reach; with near-wall drag, further out until the nearest is among them for certain.
    #[inline(never)]
    fn list_near(&mut self) {
        let [x, y] = self.position;
        self.far = self.reach() + SKIN;
        loop {
            let far = self.far;
            let near = &mut self.near;
            near.clear();
            self.walls.for_each_near(self.origin, [x - far, x + far, y - far, y + far], |obstacle| {
                near.extend(obstacle.touch_point(x, y, far).map(|_| obstacle));
            });
            if self.effects.b0 == 0.0 || !self.near.is_empty() || far > 100.0 {
                break;
            }
            self.far *= 2.0;
        }
        self.near.sort_by_key(Obstacle::id);
        self.forget();
        self.slack = SKIN;
        self.listed_at = self.position;
    }

    /// Has the walls remember nothing, so that what follows depends on the present alone.
    fn forget(&mut self) {
        self.memories.clear();
        self.memories.resize(self.near.len(), 0.0);
    }

    /// Force at `position`, drag apart.
    #[inline(always)]
    fn force(&mut self, position: [f64; 2]) -> [f64; 2] {
        // 1 - 2d/sigma = 2 overlap at sigma = 1.
        let (reach, stiffness) = (self.reach(), 4.0 * self.effects.stiffness);
        let mut force = [self.effects.weight, NEXT_TO_NOTHING];
        for (obstacle, memory) in self.near.iter().zip(&mut self.memories) {
            force = obstacle.push_point(position, reach, stiffness, memory, force);
        }
        force
    }

    /// Damping rate at `[x, y]`: `(1 + b0 d^-alpha)/V_t`, d the distance of the droplet's rim from the nearest
    /// wall, no less than a hundredth of sigma.
    fn drag_rate(&self, [x, y]: [f64; 2]) -> f64 {
        let effects = &self.effects;
        let deepest = self
            .near
            .iter()
            .filter_map(|obstacle| obstacle.touch_point(x, y, self.far + SKIN).map(|(overlap, _)| overlap));
        let distance = self.far + SKIN - deepest.fold(0.0, f64::max) - self.reach();
        effects.far_rate * (1.0 + effects.b0 * libm::pow(distance.max(NEAREST), -effects.alpha))
    }

    /// Takes `steps` time steps.
    pub fn advance(&mut self, steps: u64) {
        self.forget();
        if self.effects.b0 > 0.0 {
            on_instruction_set!(self.instruction_set, simd => self.advance_with::<_, true>(simd, steps));
        } else {
            on_instruction_set!(self.instruction_set, simd => self.advance_with::<_, false>(simd, steps));
        }
    }

    /// For its fused multiply-adds compiled for the instruction set S.
    #[inline(always)]
    fn advance_with<S: Simd, const NEAR_WALL: bool>(&mut self, _: S, steps: u64) {
        let factors = |rate: f64, dt: f64| {
            let damping = 0.5 * dt * rate;
            ((1.0 - damping) / (1.0 + damping), dt / MASS / (1.0 + damping))
        };
        let (mut keep, mut push) = factors(self.effects.far_rate, self.dt);
        // In registers: a step would wait for memory otherwise.
        let Self { mut position, mut velocity, mut slack, dt, .. } = *self;
        for _ in 0..steps {
            if NEAR_WALL {
                (keep, push) = factors(self.drag_rate(position), dt);
            }
            let force = self.force(position);
            for k in 0..2 {
                // x + dt u+, with what does not wait for the force made first.
                let coasting = (dt * keep).mul_add(velocity[k], position[k]);
                velocity[k] = velocity[k].mul_add(keep, force[k] * push);
                position[k] = (dt * push).mul_add(force[k], coasting);
            }
            slack -= dt * (velocity[0].abs() + velocity[1].abs());
            if slack < 0.0 {
                self.position = position;
                self.list_near();
                slack = self.slack;
            }
        }
        (self.position, self.velocity, self.slack) = (position, velocity, slack);
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

    /// The point at time `t`, and the loads on it; each acts where the normal meets the surface of its wall.
    pub fn outline(&self, t: f64) -> Outline {
        let world = [self.position[0] + self.origin[0], self.position[1] + self.origin[1]];
        let mut loads = Vec::new();
        for obstacle in &self.near {
            let [x, y] = self.position;
            if let Some((overlap, [nx, ny])) = obstacle.touch_point(x, y, self.reach()) {
                let (push, to_surface) = (4.0 * self.effects.stiffness * overlap, 0.5 - overlap);
                let at = [world[0] - to_surface * nx, world[1] - to_surface * ny];
                let (fx, fy) = (push * nx, push * ny);
                loads.push(LoadRecord { obstacle: obstacle.id(), x: at[0], y: at[1], fx, fy, turn: 0.0 });
            }
        }
        Outline { t, x: vec![world[0]], y: vec![world[1]], loads }
    }

    /// Everything that is recorded, at the present position.
    pub fn observe(&mut self) -> Observation {
        self.forget();
        let force = self.force(self.position);
        let rate = if self.effects.b0 > 0.0 { self.drag_rate(self.position) } else { self.effects.far_rate };
        let damping = 1.0 + 0.5 * self.dt * rate;
        let velocity = [0, 1].map(|k| (self.velocity[k] + 0.5 * self.dt / MASS * force[k]) / damping);
        let (mut overlap, mut contacts, mut potential) = (0.0_f64, 0, 0.0);
        for obstacle in &self.near {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::walls::arrays::obstacles::ObstacleArray;
    use crate::physics::walls::plate::Plate;

    fn effects(stiffness: f64) -> SoftEffects {
        SoftEffects { stiffness, weight: MASS, far_rate: 33.0, b0: 0.0, alpha: 4.0 / 3.0 }
    }

    #[test]
    fn a_point_on_a_plate_sinks_by_pi_over_16_e_w() {
        for e_w in [0.5, 5.0, 100.0] {
            let mut motion = SoftMotion::start([-0.6, 3.0], effects(e_w), 1e-3, Arc::new(Plate), InstructionSet::new());
            motion.advance(400_000);
            let sunk = 0.5 + motion.observe().x;
            assert!((sunk / (std::f64::consts::PI / (16.0 * e_w)) - 1.0).abs() < 1e-9, "{e_w}: {sunk}");
        }
    }

    #[test]
    fn force_is_minus_the_gradient_of_the_energy() {
        let discs = Arc::new(ObstacleArray::from_centres(50.0, 0.15, &[25.0, 25.4], &[25.0, 25.9]));
        let at = |x: f64, y: f64| {
            let mut motion = SoftMotion::start([x, y], effects(7.0), 1e-9, discs.clone(), InstructionSet::new());
            motion.position = [x - motion.origin[0], y - motion.origin[1]];
            motion
        };
        let h = 1e-6;
        let mut here = at(24.7, 25.5);
        let force = here.force(here.position);
        let slope_x = (at(24.7 + h, 25.5).observe().potential - at(24.7 - h, 25.5).observe().potential) / (2.0 * h);
        let slope_y = (at(24.7, 25.5 + h).observe().potential - at(24.7, 25.5 - h).observe().potential) / (2.0 * h);
        assert!((force[0] + slope_x).abs() < 1e-6 * force[0].abs());
        assert!((force[1] + slope_y).abs() < 1e-6 * force[1].abs());
    }

    #[test]
    fn near_a_wall_the_drag_is_that_of_the_distance() {
        let near_wall = SoftEffects { b0: 0.4, ..effects(5.0) };
        for gap in [0.05, 0.3, 2.0] {
            let motion = SoftMotion::start([-0.5 - gap, 0.0], near_wall, 1e-9, Arc::new(Plate), InstructionSet::new());
            let want = 33.0 * (1.0 + 0.4 * libm::pow(gap, -4.0 / 3.0));
            assert!((motion.drag_rate(motion.position) / want - 1.0).abs() < 1e-6, "{gap}");
        }
    }
}

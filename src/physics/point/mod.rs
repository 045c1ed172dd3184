//! The soft particle: one point of mass M that walls repel ([C24] eqs 8-11).
//!
//! Every wall whose surface is at a distance `d < sigma/2` adds an energy `U = (E_w/2)(1 - 2d/sigma)^2`, that is, a
//! force `2 (E_w/sigma)(1 - 2d/sigma)` along the normal. On a plate the point sinks by `delta_s = pi/(16 E_w)`. Time
//! advances by the scheme of [`crate::physics::motion::verlet`].
//!
//! ```
//! use meniscus::parameters::MASS;
//! use meniscus::physics::{point::{SoftEffects, SoftMotion}, simd::best_instruction_set, walls::plate::Plate};
//! use std::{f64::consts::PI, sync::Arc};
//!
//! let effects = SoftEffects { stiffness: 5.0, weight: MASS, far_rate: 33.0, b0: 0.0, alpha: 4.0 / 3.0 };
//! let mut droplet = SoftMotion::start([-0.6, 0.0], effects, 1e-3, Arc::new(Plate), best_instruction_set());
//! droplet.advance(400_000);
//! let sunk = 0.5 + droplet.observe().x;
//! assert!((sunk - PI / (16.0 * 5.0)).abs() < 1e-9);
//! ```

mod long_steps;
pub(in crate::physics) mod radau;
mod readings;
mod sinking;

use crate::on_instruction_set;
use crate::parameters::MASS;
use crate::physics::ring::ORIGIN_STEP;
use crate::physics::simd::InstructionSet;
use crate::physics::walls::neighbours::{Neighbours, obstacles_near};
use crate::physics::walls::wall::{Obstacle, Walls};
use fearless_simd::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How far the point may move before its list of near walls is made again, in sigma.
pub(in crate::physics) const SKIN: f64 = 0.1;

/// The near-wall drag takes smaller distances from a wall as this one, in sigma, because the rim of a soft particle
/// sinks into walls.
const NEAREST: f64 = 0.01;

/// A force along y that is too small to move anything. Without it the velocity along y of a droplet that falls freely
/// decays to a denormal number, with which processors compute twenty times slower.
const NEXT_TO_NOTHING: f64 = 1e-200;

/// What acts on a soft particle.
#[derive(Clone, Copy, Debug)]
pub struct SoftEffects {
    /// E_w.
    pub stiffness: f64,
    /// Force along +x: the weight, or zero while the droplet is put at its start.
    pub weight: f64,
    /// Damping rate far from walls, `1/V_t`.
    pub far_rate: f64,
    /// Strength of the near-wall drag, `b0/b_inf`.
    pub b0: f64,
    /// Exponent of the near-wall drag.
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
    near: Neighbours<W::Obstacle>,
    /// What each wall in `near` remembers of the step before ([`Obstacle::push_point`]).
    memories: Vec<f64>,
    instruction_set: InstructionSet,
    /// Walls whose skeletons are nearer than this were listed.
    far: f64,
    /// Where the point was when the list was made.
    listed_at: [f64; 2],
}

/// Everything that decides how a soft particle goes on, as checkpoints keep it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SoftState {
    position: [f64; 2],
    velocity: [f64; 2],
    origin: [f64; 2],
    listed_at: [f64; 2],
    slack: f64,
}

impl<W: Walls> SoftMotion<W> {
    /// A point at rest at `position` in world coordinates: `v` is zero now if half a step before `u = -dt/2 F/M`.
    pub fn start(
        position: [f64; 2],
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        let origin = position.map(|c| (c / ORIGIN_STEP).round() * ORIGIN_STEP);
        let position = [position[0] - origin[0], position[1] - origin[1]];
        let state = SoftState { position, velocity: [0.0; 2], origin, listed_at: position, slack: SKIN };
        let mut motion = Self::resume(state, effects, dt, walls, instruction_set);
        let force = motion.force(position);
        motion.velocity = force.map(|force| -0.5 * dt / MASS * force);
        motion
    }

    pub(crate) fn state(&self) -> SoftState {
        let Self { position, velocity, origin, listed_at, .. } = *self;
        SoftState { position, velocity, origin, listed_at, slack: self.near.skin.left }
    }

    /// Goes on from `state`. The list is made at the place where it was made before. With near-wall drag that place
    /// decides how far out walls are listed, and so the last bits of the drag.
    pub(crate) fn resume(
        state: SoftState,
        effects: SoftEffects,
        dt: f64,
        walls: Arc<W>,
        instruction_set: InstructionSet,
    ) -> Self {
        let SoftState { position, velocity, origin, listed_at, slack } = state;
        let mut motion = Self {
            position: listed_at,
            velocity,
            origin,
            effects,
            dt,
            walls,
            near: Neighbours::new(SKIN),
            memories: Vec::new(),
            instruction_set,
            far: 0.0,
            listed_at,
        };
        motion.list_near();
        (motion.position, motion.near.skin.left) = (position, slack);
        motion
    }

    /// Distance from a skeleton below which a wall pushes.
    fn reach(&self) -> f64 {
        0.5 + self.walls.surface()
    }

    /// Lists the walls that may come into reach. With near-wall drag it looks further out, until the nearest wall is
    /// certainly among them.
    #[inline(never)]
    fn list_near(&mut self) {
        let [x, y] = self.position;
        self.near.renew(self.origin);
        self.far = self.reach() + SKIN;
        loop {
            let near = obstacles_near(&*self.walls, self.origin, [x, x, y, y], self.far);
            self.near.items.extend(near.iter().filter(|obstacle| obstacle.touch_point(x, y, self.far).is_some()));
            if self.effects.b0 == 0.0 || !self.near.items.is_empty() || self.far > 100.0 {
                break;
            }
            self.far *= 2.0;
        }
        self.forget();
        self.listed_at = self.position;
    }

    /// Clears the memories of the walls, so that the next steps depend only on the present state.
    fn forget(&mut self) {
        self.memories.clear();
        self.memories.resize(self.near.items.len(), 0.0);
    }

    /// Force at `position`, without drag.
    #[inline(always)]
    fn force(&mut self, position: [f64; 2]) -> [f64; 2] {
        // 1 - 2d/sigma = 2 overlap at sigma = 1.
        let (reach, stiffness) = (self.reach(), 4.0 * self.effects.stiffness);
        let mut force = [self.effects.weight, NEXT_TO_NOTHING];
        for (obstacle, memory) in self.near.items.iter().zip(&mut self.memories) {
            force = obstacle.push_point(position, reach, stiffness, memory, force);
        }
        force
    }

    /// Damping rate at `[x, y]`: `(1 + b0 d^-alpha)/V_t`, with d the distance of the droplet's rim from the nearest
    /// wall, but at least [`NEAREST`].
    fn drag_rate(&self, at: [f64; 2]) -> f64 {
        let (distance, _) = self.nearest_wall(at);
        self.effects.far_rate * (1.0 + self.near_wall_drag(distance))
    }

    /// The drag of a wall over that far from walls, `b0 d^-alpha`.
    fn near_wall_drag(&self, distance: f64) -> f64 {
        self.effects.b0 * libm::pow(distance.max(NEAREST), -self.effects.alpha)
    }

    /// The distance of the droplet's rim from the nearest wall, and the normal there.
    fn nearest_wall(&self, [x, y]: [f64; 2]) -> (f64, [f64; 2]) {
        let far = self.far + SKIN;
        let touches = self.near.items.iter().filter_map(|obstacle| obstacle.touch_point(x, y, far));
        let (depth, normal) = touches.fold((0.0, [0.0; 2]), |a, b| if b.0 > a.0 { b } else { a });
        (far - depth - self.reach(), normal)
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

    /// Compiled for the instruction set S, so that fused multiply-adds are single instructions.
    #[inline(always)]
    fn advance_with<S: Simd, const NEAR_WALL: bool>(&mut self, _: S, steps: u64) {
        let factors = |rate: f64, dt: f64| {
            let damping = 0.5 * dt * rate;
            ((1.0 - damping) / (1.0 + damping), dt / MASS / (1.0 + damping))
        };
        let (mut keep, mut push) = factors(self.effects.far_rate, self.dt);
        // Local copies stay in registers; a step would wait for memory otherwise.
        let Self { mut position, mut velocity, dt, .. } = *self;
        let mut skin = self.near.skin;
        for _ in 0..steps {
            if NEAR_WALL {
                (keep, push) = factors(self.drag_rate(position), dt);
            }
            let force = self.force(position);
            for k in 0..2 {
                // x + dt u+, with the part that does not depend on the force first.
                let coasting = (dt * keep).mul_add(velocity[k], position[k]);
                velocity[k] = velocity[k].mul_add(keep, force[k] * push);
                position[k] = (dt * push).mul_add(force[k], coasting);
            }
            if skin.moved(dt * (velocity[0].abs() + velocity[1].abs())) {
                self.position = position;
                self.list_near();
                skin = self.near.skin;
            }
        }
        (self.position, self.velocity, self.near.skin) = (position, velocity, skin);
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

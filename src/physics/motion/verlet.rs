//! Modified velocity-Verlet with implicit drag, for a ring of vertices.
//!
//! The scheme
//!
//! ```text
//! x+ = x + dt v + dt^2/2 a
//! v+ = [v + dt/2 (a + F+/m)] / (1 + dt lambda+/2),     a+ = F+/m - lambda+ v+
//! ```
//!
//! is computed with its half-step velocity `u = v + dt/2 a`, so that no acceleration is stored:
//!
//! ```text
//! u+ = [(1 - dt lambda/2) u + (dt/m) F] / (1 + dt lambda/2),     x+ = x + dt u+
//! ```
//!
//! with `F` and `lambda` at the present positions. The velocity `v = [u + dt/2 F/m]/(1 + dt lambda/2)` is computed only
//! for observations. A step is one pass over the ring (`ring/passes.rs`): forces, velocities, positions, and the edges
//! and the area at the new positions. Contact and other forces are added before it, if they can act.

use crate::physics::motion::{Interruption, in_pieces};
use crate::physics::observation::Observation;
use crate::physics::ring::passes::{edge_pass, net_forces, step_pass};
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::InstructionSet;
use std::sync::atomic::AtomicBool;

/// Vertices times steps between two checks of `stop`: about 10 ms.
const PIECE: u64 = 1 << 22;

/// A ring advanced by Verlet steps.
#[derive(Debug)]
pub struct VerletMotion {
    /// The ring.
    pub ring: Ring,
    /// All that acts on the ring.
    pub effects: RingEffects,
    pub(super) dt: f64,
    pub(super) instruction_set: InstructionSet,
}

impl VerletMotion {
    /// A ring at rest: `v` is zero now if half a step before `u = -dt/2 F/m`.
    pub fn start(ring: Ring, effects: RingEffects, dt: f64, instruction_set: InstructionSet) -> Self {
        let mut motion = Self::resume(ring, effects, dt, instruction_set);
        let (fx, fy) = motion.forces();
        let ring = &mut motion.ring;
        let kick = 0.5 * dt / ring.vertex_mass();
        for i in 0..ring.n {
            (ring.ux[i], ring.uy[i]) = (-kick * fx[i], -kick * fy[i]);
        }
        motion
    }

    /// A ring in motion whose half-step velocities belong to steps of `dt`.
    pub(super) fn resume(ring: Ring, effects: RingEffects, dt: f64, instruction_set: InstructionSet) -> Self {
        let mut motion = Self { ring, effects, dt, instruction_set };
        motion.moved(f64::INFINITY);
        motion
    }

    /// Tells the effects that no vertex moved further than `distance`.
    #[inline(always)]
    fn moved(&mut self, distance: f64) {
        self.effects.moved(distance, &self.ring);
        self.effects.drag.update(distance, &self.ring);
    }

    /// Takes `steps` time steps.
    ///
    /// # Errors
    /// [`Interruption::Stopped`], once `stop` is set.
    pub fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        let piece = (PIECE / self.ring.n as u64).max(1);
        in_pieces(steps, piece, stop, |steps| self.advance_piece(steps))
    }

    fn advance_piece(&mut self, steps: u64) {
        let mut area = edge_pass(self.instruction_set, &mut self.ring, self.effects.edge_law());
        for _ in 0..steps {
            let pushed = self.effects.push(&mut self.ring);
            let forces = self.effects.forces(area, pushed);
            let fastest_squared;
            (area, fastest_squared) =
                step_pass(self.instruction_set, &mut self.ring, &forces, self.effects.drag.rates(), self.dt);
            self.moved(self.dt * fastest_squared.sqrt());
        }
    }

    /// Changes the step to `dt` and keeps the velocities `v`.
    pub(super) fn change_step(&mut self, dt: f64) {
        let (fx, fy) = self.forces();
        let kick = |dt: f64| 0.5 * dt / self.ring.vertex_mass();
        let (kick_before, kick_after) = (kick(self.dt), kick(dt));
        for i in 0..self.ring.n {
            let rate = self.effects.drag.rates().at(i);
            let damping = |dt: f64| 1.0 + 0.5 * dt * rate;
            let (before, after) = (damping(self.dt), damping(dt));
            self.ring.ux[i] = after * ((self.ring.ux[i] + kick_before * fx[i]) / before) - kick_after * fx[i];
            self.ring.uy[i] = after * ((self.ring.uy[i] + kick_before * fy[i]) / before) - kick_after * fy[i];
        }
        self.dt = dt;
    }

    /// Puts the ring back to `saved`, whose half-step velocities belong to steps of `dt`.
    pub(super) fn put_back(&mut self, saved: &Ring, dt: f64) {
        self.ring.clone_from(saved);
        self.dt = dt;
        self.moved(f64::INFINITY);
    }

    /// Moves the local origin next to the ring. Call it only at times that are fixed by the job.
    pub fn follow(&mut self) {
        self.ring.follow();
        self.moved(0.0);
    }

    /// Forces on the vertices at the present positions, without drag.
    pub fn forces(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (ring, effects) = (&mut self.ring, &self.effects);
        let area = edge_pass(self.instruction_set, ring, effects.edge_law());
        let pushed = effects.push(ring);
        let (mut fx, mut fy) = (vec![0.0; ring.ux.len()], vec![0.0; ring.ux.len()]);
        net_forces(self.instruction_set, ring, &effects.forces(area, pushed), &mut fx, &mut fy);
        (fx, fy)
    }

    fn velocities(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (mut vx, mut vy) = self.forces();
        let kick = 0.5 * self.dt / self.ring.vertex_mass();
        for i in 0..self.ring.n {
            let rate = self.effects.drag.rates().at(i);
            let damping = 1.0 + 0.5 * self.dt * rate;
            vx[i] = (self.ring.ux[i] + kick * vx[i]) / damping;
            vy[i] = (self.ring.uy[i] + kick * vy[i]) / damping;
        }
        (vx, vy)
    }

    /// Measures everything that is recorded.
    pub fn observe(&mut self) -> Observation {
        let (vx, vy) = self.velocities();
        self.effects.observe(&self.ring, &vx, &vy)
    }
}

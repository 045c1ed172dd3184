//! Modified velocity-Verlet with implicit drag, for a ring of vertices.
//!
//! The scheme
//!
//! ```text
//! x+ = x + dt v + dt^2/2 a
//! v+ = [v + dt/2 (a + F+/m)] / (1 + dt lambda+/2),     a+ = F+/m - lambda+ v+
//! ```
//!
//! is carried in its half-step velocity `u = v + dt/2 a`, which needs no stored acceleration:
//!
//! ```text
//! u+ = [(1 - dt lambda/2) u + (dt/m) F] / (1 + dt lambda/2),     x+ = x + dt u+
//! ```
//!
//! with `F` and `lambda` at the present positions; `v = [u + dt/2 F/m]/(1 + dt lambda/2)` is only made to be observed.
//! A step is one pass over the ring ([`crate::physics::ring::passes`]): forces, kick and drift, and the edges and the area where that leads. Contact and
//! the like stand before it, and only while they can act.

use crate::physics::motion::in_pieces;
use crate::physics::observation::Observation;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::area::Area;
use crate::physics::ring::forces::contact::{Load, WallContact};
use crate::physics::ring::forces::gravity::Gravity;
use crate::physics::ring::forces::{Drag, EdgeForce, RingForce};
use crate::physics::ring::passes::{EdgeLaw, RingForces, edge_pass, net_forces, step_pass};
use crate::physics::simd::InstructionSet;
use crate::results::outline::{LoadRecord, Outline};
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

/// Vertices times steps between two looks at whether to stop: about 10 ms.
const PIECE: u64 = 1 << 22;

/// The effects on a ring; those inside its vertex loops are types.
#[derive(Debug)]
pub struct RingEffects<E, D> {
    /// Forces along the edges.
    pub edge: E,
    /// Area elasticity.
    pub area: Area,
    /// Weight of the vertices.
    pub gravity: Gravity,
    /// Drag.
    pub drag: D,
    /// Square of the smoothing length eps.
    pub eps_squared: f64,
    /// Contact with the walls.
    pub walls: Box<dyn WallContact>,
    /// Whatever else pushes.
    pub others: Vec<Box<dyn RingForce>>,
}

impl<E: EdgeForce, D: Drag> RingEffects<E, D> {
    /// Potential energy of all effects on `ring`.
    pub fn potential_energy(&self, ring: &Ring) -> f64 {
        self.energy_with(ring, self.walls.energy(ring))
    }

    /// The same, the energy of the contacts being known.
    fn energy_with(&self, ring: &Ring, contact: f64) -> f64 {
        let mut energy = self.area.energy(ring.area_and_perimeter().0) + contact;
        energy += self.others.iter().map(|other| other.energy(ring)).sum::<f64>();
        for i in 0..ring.n {
            let (ex, ey) = (ring.x[i + 1] - ring.x[i], ring.y[i + 1] - ring.y[i]);
            energy += self.edge.energy((ex * ex + ey * ey + self.eps_squared).sqrt());
            energy += self.gravity.energy(ring.x[i] + ring.origin[0]);
        }
        energy
    }

    /// The tension along the edges.
    pub(super) fn edge_law(&self) -> EdgeLaw {
        EdgeLaw { tension: self.edge.law(), eps_squared: self.eps_squared }
    }

    /// The forces on a ring of this area; `pushed` if [`add_forces`] set some.
    pub(super) fn forces(&self, area: f64, pushed: bool) -> RingForces {
        let half_pressure = 0.5 * self.area.pressure(area);
        RingForces { law: self.edge_law(), half_pressure, weight: self.gravity.force(), pushed }
    }

    /// Tells the effects that an implicit step has ended here.
    pub(super) fn settled(&mut self, ring: &Ring) {
        self.walls.settled(ring);
        self.others.iter_mut().for_each(|other| other.settled(ring));
    }

    /// Has the effects hold on to what they pushed; false if there is nothing to hold.
    pub(super) fn hold(&mut self, ring: &Ring) -> bool {
        let held = self.walls.hold(ring);
        self.others.iter_mut().fold(held, |held, other| other.hold(ring) | held)
    }

    /// Has the effects let go.
    pub(super) fn let_go(&mut self) {
        self.walls.let_go();
        self.others.iter_mut().for_each(|other| other.let_go());
    }

    /// Everything that is recorded of `ring`, whose vertices have the velocities `v`.
    pub fn observe(&self, ring: &Ring, vx: &[f64], vy: &[f64]) -> Observation {
        let (area, perimeter) = ring.area_and_perimeter();
        let (centroid, velocity) = ring.centroid(vx, vy);
        let squares: f64 = vx[..ring.n].iter().zip(vy).map(|(x, y)| x * x + y * y).sum();
        let contact = self.walls.state(ring);
        Observation {
            x: centroid[0] + ring.origin[0],
            y: centroid[1] + ring.origin[1],
            velocity: velocity[0],
            kinetic: 0.5 * ring.vertex_mass() * squares,
            potential: self.energy_with(ring, contact.energy),
            shape: Some(perimeter * perimeter / (4.0 * PI * area)),
            area_error: Some(area / self.area.rest - 1.0),
            overlap: contact.overlap,
            contacts: contact.loads.len() as u32,
        }
    }

    /// The outline of `ring` at time `t`, and the loads on it.
    pub fn outline(&self, ring: &Ring, t: f64) -> Outline {
        let [x0, y0] = ring.origin;
        let (x, y) = ring.world_vertices().map(|[x, y]| (x, y)).unzip();
        let world = |load: &Load| LoadRecord {
            obstacle: load.id,
            x: load.at[0] + x0,
            y: load.at[1] + y0,
            fx: load.force[0],
            fy: load.force[1],
            turn: load.turn,
        };
        Outline { t, x, y, loads: self.walls.state(ring).loads.iter().map(world).collect() }
    }

    /// World position of an obstacle inside `ring`, if there is one.
    pub fn engulfed(&self, ring: &Ring) -> Option<[f64; 2]> {
        self.walls.engulfed(ring).map(|[x, y]| [x + ring.origin[0], y + ring.origin[1]])
    }
}

/// A ring with its effects, ready to be advanced.
#[derive(Debug)]
pub struct RingMotion<E, D> {
    /// The ring.
    pub ring: Ring,
    /// Its effects.
    pub effects: RingEffects<E, D>,
    /// Time step.
    pub dt: f64,
    instruction_set: InstructionSet,
}

impl<E: EdgeForce, D: Drag> RingMotion<E, D> {
    /// A ring at rest: its velocity half a step before, `u = -dt/2 F/m`, is what makes `v` zero now.
    pub fn start(ring: Ring, effects: RingEffects<E, D>, dt: f64, instruction_set: InstructionSet) -> Self {
        let mut motion = Self { ring, effects, dt, instruction_set };
        motion.moved(f64::INFINITY);
        let (fx, fy) = motion.forces();
        let ring = &mut motion.ring;
        let kick = 0.5 * dt / ring.vertex_mass();
        for i in 0..ring.n {
            (ring.ux[i], ring.uy[i]) = (-kick * fx[i], -kick * fy[i]);
        }
        motion
    }

    /// A ring in motion, its half-step velocities being of steps of `dt`.
    pub(super) fn resume(ring: Ring, effects: RingEffects<E, D>, dt: f64, instruction_set: InstructionSet) -> Self {
        let mut motion = Self { ring, effects, dt, instruction_set };
        motion.moved(f64::INFINITY);
        motion
    }

    /// Takes `steps` time steps, in pieces whose length the ring alone decides; false, and somewhere on the way, once `stop` is set.
    pub fn advance_unless(&mut self, stop: &AtomicBool, steps: u64) -> bool {
        let piece = (PIECE / self.ring.n as u64).max(1);
        in_pieces(stop, steps, piece, |steps| self.advance(steps))
    }

    /// Tells the effects that no vertex moved further than `distance`.
    #[inline(always)]
    fn moved(&mut self, distance: f64) {
        self.effects.walls.moved(distance, &self.ring);
        for other in &mut self.effects.others {
            other.moved(distance, &self.ring);
        }
        self.effects.drag.update(distance, &self.ring);
    }

    /// Takes `steps` time steps.
    pub fn advance(&mut self, steps: u64) {
        let mut area = edge_pass(self.instruction_set, &mut self.ring, self.effects.edge_law());
        for _ in 0..steps {
            let pushed = add_forces(&mut self.ring, &self.effects);
            let forces = self.effects.forces(area, pushed);
            let fastest_squared;
            (area, fastest_squared) =
                step_pass(self.instruction_set, &mut self.ring, &forces, self.effects.drag.rates(), self.dt);
            self.moved(self.dt * fastest_squared.sqrt());
        }
    }

    /// Goes on with steps of `dt`, from the same velocities.
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

    /// Puts the ring back to where `saved` was, in steps of `dt`: half-step velocities belong to a step.
    pub(super) fn put_back(&mut self, saved: &Ring, dt: f64) {
        self.ring.clone_from(saved);
        self.dt = dt;
        self.moved(f64::INFINITY);
    }

    /// Moves the ring's origin next to it. Call at instants that do not depend on how a run is cut up.
    pub fn follow(&mut self) {
        self.ring.follow();
        self.moved(0.0);
    }

    /// Forces on the vertices at the present positions, drag apart.
    pub fn forces(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (ring, effects) = (&mut self.ring, &self.effects);
        let area = edge_pass(self.instruction_set, ring, effects.edge_law());
        let pushed = add_forces(ring, effects);
        let (mut fx, mut fy) = (vec![0.0; ring.ux.len()], vec![0.0; ring.ux.len()]);
        net_forces(self.instruction_set, ring, &effects.forces(area, pushed), &mut fx, &mut fy);
        (fx, fy)
    }

    /// Full-step velocities at the present positions: `v = [u + dt/2 F/m]/(1 + dt lambda/2)`.
    pub fn velocities(&mut self) -> (Vec<f64>, Vec<f64>) {
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

    /// Potential energy of all effects at the present positions.
    pub fn potential_energy(&self) -> f64 {
        self.effects.potential_energy(&self.ring)
    }

    /// Kinetic and potential energy at the present positions.
    pub fn total_energy(&mut self) -> f64 {
        self.observe().energy()
    }

    /// Everything that is recorded, at the present positions.
    pub fn observe(&mut self) -> Observation {
        let (vx, vy) = self.velocities();
        self.effects.observe(&self.ring, &vx, &vy)
    }

    /// World position of an obstacle inside the ring, if there is one.
    pub fn engulfed(&self) -> Option<[f64; 2]> {
        self.effects.engulfed(&self.ring)
    }
}

/// Sets the forces of walls and the like; false, and nothing done, if none can act now.
#[inline(always)]
pub(super) fn add_forces<E, D>(ring: &mut Ring, effects: &RingEffects<E, D>) -> bool {
    if !effects.walls.acts() && !effects.others.iter().any(|other| other.acts()) {
        return false;
    }
    ring.force_x.fill(0.0);
    ring.force_y.fill(0.0);
    if effects.walls.acts() {
        effects.walls.add(ring);
    }
    for other in effects.others.iter().filter(|other| other.acts()) {
        other.add(ring);
    }
    let n = ring.n;
    ring.force_x[0] += ring.force_x[n];
    ring.force_y[0] += ring.force_y[n];
    true
}

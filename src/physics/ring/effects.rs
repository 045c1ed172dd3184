//! All that acts on one ring: elasticity, weight, drag, walls, and other forces. Both integrators take their forces
//! from here, and everything that is recorded of a ring is measured here.

use crate::parameters::{Deformable, MASS, regular_edge};
use crate::physics::observation::Observation;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::contact::{Load, WallContact};
use crate::physics::ring::forces::{RingForce, area::Area, drag::Drag, gravity::Gravity, tension::EdgeTension};
use crate::physics::ring::passes::{EdgeLaw, RingForces};
use crate::results::outline::{LoadRecord, Outline};
use std::f64::consts::PI;

/// The effects on a ring.
#[derive(Debug)]
pub struct RingEffects {
    /// Tension along the edges.
    pub tension: EdgeTension,
    /// Area elasticity.
    pub area: Area,
    /// Weight of the vertices.
    pub gravity: Gravity,
    /// The drag.
    pub drag: Drag,
    /// Square of the smoothing length eps.
    pub eps_squared: f64,
    /// Contact with the walls.
    pub walls: Box<dyn WallContact>,
    /// Other forces: those of the ring on itself, and of hydrostatic pressure.
    pub others: Vec<Box<dyn RingForce>>,
}

/// What is measured on a ring at one instant.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) seen: Observation,
    /// Both components of the velocity of the centroid.
    pub(crate) velocity: [f64; 2],
    /// The loads of the obstacles that push.
    pub(crate) loads: Vec<Load>,
}

impl RingEffects {
    /// The elasticity of a droplet among `walls`, without weight or drag.
    pub fn elastic(ring: &Deformable, walls: Box<dyn WallContact>) -> Self {
        let smoothing = ring.eps * regular_edge(ring.n_vertices);
        Self {
            tension: EdgeTension::of(ring),
            area: Area { stiffness: ring.k_a, rest: MASS },
            gravity: Gravity::off(),
            drag: Drag::Far { rate: 0.0 },
            eps_squared: smoothing * smoothing,
            walls,
            others: Vec::new(),
        }
    }

    /// Tells walls and other forces that no vertex of `ring` moved further than `distance`. The drag is updated
    /// separately.
    #[inline(always)]
    pub(crate) fn moved(&mut self, distance: f64, ring: &Ring) {
        self.walls.moved(distance, ring);
        for other in &mut self.others {
            other.moved(distance, ring);
        }
    }

    pub(crate) fn edge_law(&self) -> EdgeLaw {
        EdgeLaw { tension: self.tension.law(), eps_squared: self.eps_squared }
    }

    /// The forces on a ring of this area; `pushed` is the answer of [`push`](Self::push).
    pub(crate) fn forces(&self, area: f64, pushed: bool) -> RingForces {
        let half_pressure = 0.5 * self.area.pressure(area);
        RingForces { law: self.edge_law(), half_pressure, weight: self.gravity.force(), pushed }
    }

    /// Sets the forces of walls and other forces on the vertices. False, and nothing is set, if none can act now.
    #[inline(always)]
    pub(crate) fn push(&self, ring: &mut Ring) -> bool {
        if !self.walls.acts() && !self.others.iter().any(|other| other.acts()) {
            return false;
        }
        ring.force_x.fill(0.0);
        ring.force_y.fill(0.0);
        if self.walls.acts() {
            self.walls.add(ring);
        }
        for other in self.others.iter().filter(|other| other.acts()) {
            other.add(ring);
        }
        let n = ring.n;
        ring.force_x[0] += ring.force_x[n];
        ring.force_y[0] += ring.force_y[n];
        true
    }

    pub(crate) fn settled(&mut self, ring: &Ring) {
        self.walls.settled(ring);
        self.others.iter_mut().for_each(|other| other.settled(ring));
    }

    /// The forces whose second derivatives are not known and that can act now.
    pub(crate) fn acting_without_stiffness(&self) -> impl Iterator<Item = &dyn RingForce> {
        self.others.iter().map(AsRef::as_ref).filter(|other| !other.has_stiffness() && other.acts())
    }

    /// Whether a force acts now whose second derivatives are not known.
    pub(crate) fn lack_stiffness(&self, ring: &Ring) -> bool {
        self.acting_without_stiffness().any(|other| other.energy(ring) != 0.0)
    }

    /// [`RingForce::hold`] of all effects; true if any of them holds.
    pub(crate) fn hold(&mut self, ring: &Ring) -> bool {
        let held = self.walls.hold(ring);
        self.others.iter_mut().fold(held, |held, other| other.hold(ring) | held)
    }

    pub(crate) fn let_go(&mut self) {
        self.walls.let_go();
        self.others.iter_mut().for_each(|other| other.let_go());
    }

    /// [`RingForce::memory`] of the walls, and then of each other force.
    pub(crate) fn memory(&self) -> Vec<Vec<f64>> {
        std::iter::once(self.walls.memory()).chain(self.others.iter().map(|other| other.memory())).collect()
    }

    /// [`RingForce::recall`] of all effects; false if the memory does not fit them.
    pub(crate) fn recall(&mut self, memory: &[Vec<f64>]) -> bool {
        let Some((of_walls, of_others)) = memory.split_first() else { return false };
        of_others.len() == self.others.len()
            && self.walls.recall(of_walls)
            && self.others.iter_mut().zip(of_others).all(|(other, memory)| other.recall(memory))
    }

    /// Potential energy of all effects on `ring`.
    pub fn potential_energy(&self, ring: &Ring) -> f64 {
        self.energy_with(ring, self.walls.energy(ring))
    }

    /// Potential energy, given the energy of the contacts.
    fn energy_with(&self, ring: &Ring, contact: f64) -> f64 {
        let mut energy = self.area.energy(ring.area_and_perimeter().0) + contact;
        energy += self.others.iter().map(|other| other.energy(ring)).sum::<f64>();
        for i in 0..ring.n {
            let (ex, ey) = (ring.x[i + 1] - ring.x[i], ring.y[i + 1] - ring.y[i]);
            energy += self.tension.energy((ex * ex + ey * ey + self.eps_squared).sqrt());
            energy += self.gravity.energy(ring.x[i] + ring.origin[0]);
        }
        energy
    }

    /// Measures everything that is recorded of `ring`, whose vertices have the velocities `v`.
    pub(crate) fn observe(&self, ring: &Ring, vx: &[f64], vy: &[f64]) -> Observation {
        self.measure(ring, vx, vy).seen
    }

    /// As [`observe`](Self::observe), with what else is found on the way.
    pub(crate) fn measure(&self, ring: &Ring, vx: &[f64], vy: &[f64]) -> Measured {
        let (area, perimeter) = ring.area_and_perimeter();
        let (centroid, velocity) = ring.centroid(vx, vy);
        let squares: f64 = vx[..ring.n].iter().zip(vy).map(|(x, y)| x * x + y * y).sum();
        let contact = self.walls.state(ring);
        let seen = Observation {
            x: centroid[0] + ring.origin[0],
            y: centroid[1] + ring.origin[1],
            velocity: velocity[0],
            kinetic: 0.5 * ring.vertex_mass() * squares,
            potential: self.energy_with(ring, contact.energy),
            shape: Some(perimeter * perimeter / (4.0 * PI * area)),
            area_error: Some(area / self.area.rest - 1.0),
            overlap: contact.overlap,
            contacts: contact.loads.len() as u32,
        };
        Measured { seen, velocity, loads: contact.loads }
    }

    /// The outline of `ring` at time `t`, and the loads on it.
    pub(crate) fn outline(&self, ring: &Ring, t: f64) -> Outline {
        outline_of(ring, t, &self.walls.state(ring).loads)
    }

    /// World position of an obstacle inside `ring`, if there is one.
    pub(crate) fn engulfed(&self, ring: &Ring) -> Option<[f64; 2]> {
        self.walls.engulfed(ring).map(|[x, y]| [x + ring.origin[0], y + ring.origin[1]])
    }
}

/// The outline of `ring` at time `t`, with these loads.
pub(crate) fn outline_of(ring: &Ring, t: f64, loads: &[Load]) -> Outline {
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
    Outline { t, x, y, loads: loads.iter().map(world).collect() }
}

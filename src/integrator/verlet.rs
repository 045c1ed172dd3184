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
//! A step is two passes over the ring: edges and area, then forces, kick and drift. Contact and the like stand between
//! them, and only while they can act.

use crate::droplet::Observation;
use crate::droplet::deformable::Ring;
use crate::effects::area::Area;
use crate::effects::contact::{Load, WallContact};
use crate::effects::gravity::Gravity;
use crate::effects::{Drag, EdgeForce, RingForce};
use crate::on_level;
use crate::shape::{LoadRecord, ShapeRecord};
use crate::vector::{LANES, inverse_sqrt, load, max_lanes, store, sum_lanes};
use fearless_simd::{Fallback, Level, f64x8, prelude::*};
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

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

    /// The shape of `ring` at time `t`, and the loads on it.
    pub fn shape(&self, ring: &Ring, t: f64) -> ShapeRecord {
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
        ShapeRecord { t, x, y, loads: self.walls.state(ring).loads.iter().map(world).collect() }
    }

    /// World position of a shape inside `ring`, if there is one.
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
    level: Level,
}

impl<E: EdgeForce, D: Drag> RingMotion<E, D> {
    /// A ring at rest, its first half step taken.
    pub fn start(ring: Ring, effects: RingEffects<E, D>, dt: f64, level: Level) -> Self {
        let mut motion = Self { ring, effects, dt, level };
        motion.moved(f64::INFINITY);
        let (fx, fy) = motion.forces();
        let ring = &mut motion.ring;
        let kick = 0.5 * dt / ring.vertex_mass();
        let mut fastest_squared: f64 = 0.0;
        for i in 0..ring.n {
            (ring.ux[i], ring.uy[i]) = (kick * fx[i], kick * fy[i]);
            ring.x[i] += dt * ring.ux[i];
            ring.y[i] += dt * ring.uy[i];
            fastest_squared = fastest_squared.max(ring.ux[i] * ring.ux[i] + ring.uy[i] * ring.uy[i]);
        }
        ring.close();
        motion.moved(dt * fastest_squared.sqrt());
        motion
    }

    /// A ring in motion, its half-step velocities being of steps of `dt`.
    pub(super) fn resume(ring: Ring, effects: RingEffects<E, D>, dt: f64, level: Level) -> Self {
        let mut motion = Self { ring, effects, dt, level };
        motion.moved(f64::INFINITY);
        motion
    }

    /// Takes `steps` time steps, in pieces whose length the ring alone decides; false, and somewhere on the way, once `stop` is set.
    pub fn advance_unless(&mut self, stop: &AtomicBool, steps: u64) -> bool {
        let piece = (PIECE / self.ring.n as u64).max(1);
        let mut left = steps;
        while left > 0 {
            if stop.load(Ordering::Relaxed) {
                return false;
            }
            self.advance(left.min(piece));
            left -= left.min(piece);
        }
        true
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
        let (level, dt) = (self.level, self.dt);
        for _ in 0..steps {
            let (ring, effects) = (&mut self.ring, &self.effects);
            let area = on_level!(level, simd => edge_pass(simd, ring, effects.edge, effects.eps_squared));
            let pushed = add_forces(ring, effects);
            let kick = Kick::of(effects, area, dt);
            let fastest_squared = if pushed {
                on_level!(level, simd => kick.kick_and_drift::<_, true>(simd, ring))
            } else {
                on_level!(level, simd => kick.kick_and_drift::<_, false>(simd, ring))
            };
            ring.close();
            self.moved(dt * fastest_squared.sqrt());
        }
    }

    /// Goes on with steps of `dt`, from the same velocities.
    pub(super) fn change_step(&mut self, dt: f64) {
        let (fx, fy) = self.forces();
        let simd = Fallback::new();
        let kick = |dt: f64| 0.5 * dt / self.ring.vertex_mass();
        let (kick_before, kick_after) = (kick(self.dt), kick(dt));
        for i in 0..self.ring.n {
            let rate = self.effects.drag.rate(simd, i / LANES * LANES).as_slice()[i % LANES];
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
        // Seldom needed, and the same bits on every instruction set: the plain one keeps the program small.
        let simd = Fallback::new();
        let (ring, effects) = (&mut self.ring, &self.effects);
        let area = edge_pass(simd, ring, effects.edge, effects.eps_squared);
        if !add_forces(ring, effects) {
            ring.force_x.fill(0.0);
            ring.force_y.fill(0.0);
        }
        let kick = Kick::of(effects, area, self.dt);
        let (mut fx, mut fy) = (vec![0.0; ring.ux.len()], vec![0.0; ring.ux.len()]);
        for i in (0..ring.ux.len()).step_by(LANES) {
            let (x, y) = kick.net_force::<_, true>(simd, ring, i);
            store(x, &mut fx, i);
            store(y, &mut fy, i);
        }
        (fx, fy)
    }

    /// Full-step velocities at the present positions: `v = [u + dt/2 F/m]/(1 + dt lambda/2)`.
    pub fn velocities(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (mut vx, mut vy) = self.forces();
        let simd = Fallback::new();
        let kick = 0.5 * self.dt / self.ring.vertex_mass();
        for i in 0..self.ring.n {
            let rate = self.effects.drag.rate(simd, i / LANES * LANES).as_slice()[i % LANES];
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
        let seen = self.observe();
        seen.kinetic + seen.potential
    }

    /// Everything that is recorded, at the present positions.
    pub fn observe(&mut self) -> Observation {
        let (vx, vy) = self.velocities();
        self.effects.observe(&self.ring, &vx, &vy)
    }

    /// World position of a shape inside the ring, if there is one.
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

/// Edge vectors and their tension coefficients; returns the area.
#[inline(always)]
pub(super) fn edge_pass<S: Simd, E: EdgeForce>(simd: S, ring: &mut Ring, edge: E, eps_squared: f64) -> f64 {
    let (n, long) = (ring.n, ring.ux.len());
    // Slices of one known length let the compiler drop the bounds checks.
    let (x, y) = (&ring.x[..long + LANES], &ring.y[..long + LANES]);
    let edge_x = &mut ring.edge_x[..long + LANES];
    let edge_y = &mut ring.edge_y[..long + LANES];
    let coefficient = &mut ring.coefficient[..long + LANES];
    let mut cross = f64x8::splat(simd, 0.0);
    let mut i = 0;
    while i + LANES <= long {
        let (x0, y0) = (load(simd, x, i), load(simd, y, i));
        let (ex, ey) = (load(simd, x, i + 1) - x0, load(simd, y, i + 1) - y0);
        cross += x0 * ey - y0 * ex;
        store(ex, edge_x, i + LANES);
        store(ey, edge_y, i + LANES);
        if E::NEEDS_LENGTH {
            let inverse_length = inverse_sqrt(simd, ex * ex + ey * ey + eps_squared);
            store(edge.coefficient(simd, inverse_length), coefficient, i + LANES);
        }
        i += LANES;
    }
    for edges in [edge_x, edge_y, coefficient] {
        edges[LANES - 1] = edges[LANES - 1 + n];
    }
    0.5 * sum_lanes(cross)
}

/// Everything the second pass needs.
pub(super) struct Kick<'a, E, D> {
    pub(super) half_pressure: f64,
    pub(super) weight: f64,
    /// Read only where the tension does not depend on the length.
    pub(super) stiffness: E,
    pub(super) drag: &'a D,
    pub(super) dt: f64,
}

impl<'a, E: EdgeForce, D: Drag> Kick<'a, E, D> {
    /// The second pass of a step of `dt`, at this area of the ring.
    #[inline(always)]
    pub(super) fn of(effects: &'a RingEffects<E, D>, area: f64, dt: f64) -> Self {
        Self {
            half_pressure: 0.5 * effects.area.pressure(area),
            weight: effects.gravity.force(),
            stiffness: effects.edge,
            drag: &effects.drag,
            dt,
        }
    }

    /// Sum of all forces but drag on the vertices `i..i + 8`.
    #[inline(always)]
    pub(super) fn net_force<S: Simd, const PUSHED: bool>(
        &self,
        simd: S,
        ring: &Ring,
        i: usize,
    ) -> (f64x8<S>, f64x8<S>) {
        let (ex, ey) = (load(simd, &ring.edge_x, i + LANES), load(simd, &ring.edge_y, i + LANES));
        let (back_x, back_y) = (load(simd, &ring.edge_x, i + LANES - 1), load(simd, &ring.edge_y, i + LANES - 1));
        let (pull_x, pull_y) = if E::NEEDS_LENGTH {
            let ahead = load(simd, &ring.coefficient, i + LANES);
            let behind = load(simd, &ring.coefficient, i + LANES - 1);
            (ahead * ex - behind * back_x, ahead * ey - behind * back_y)
        } else {
            let stiffness = self.stiffness.coefficient(simd, f64x8::splat(simd, 0.0));
            (stiffness * (ex - back_x), stiffness * (ey - back_y))
        };
        let mut fx = pull_x + (ey + back_y) * self.half_pressure + self.weight;
        let mut fy = pull_y - (ex + back_x) * self.half_pressure;
        if PUSHED {
            fx += load(simd, &ring.force_x, i);
            fy += load(simd, &ring.force_y, i);
        }
        (fx, fy)
    }

    /// New half-step velocities and positions; returns the largest squared speed.
    #[inline(always)]
    fn kick_and_drift<S: Simd, const PUSHED: bool>(&self, simd: S, ring: &mut Ring) -> f64 {
        let (half_dt, kick) = (0.5 * self.dt, self.dt / ring.vertex_mass());
        let (mut fastest, mut last) = (f64x8::splat(simd, 0.0), 0.0);
        let long = ring.ux.len();
        let mut i = 0;
        while i + LANES <= long {
            let (fx, fy) = self.net_force::<S, PUSHED>(simd, ring, i);
            let damping = self.drag.rate(simd, i) * half_dt;
            let share = 1.0 / (1.0 + damping);
            let (keep, push) = ((1.0 - damping) * share, share * kick);
            let ux = load(simd, &ring.ux, i) * keep + fx * push;
            let uy = load(simd, &ring.uy, i) * keep + fy * push;
            store(ux, &mut ring.ux, i);
            store(uy, &mut ring.uy, i);
            let speed_squared = ux * ux + uy * uy;
            if i + LANES <= ring.n {
                fastest = fastest.max(speed_squared);
            } else {
                last = speed_squared.as_slice()[..ring.n - i].iter().fold(0.0, |a: f64, &b| a.max(b));
            }
            let (x, y) = (load(simd, &ring.x, i) + ux * self.dt, load(simd, &ring.y, i) + uy * self.dt);
            store(x, &mut ring.x, i);
            store(y, &mut ring.y, i);
            i += LANES;
        }
        max_lanes(fastest).max(last)
    }
}

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
//! A step is two passes over the ring: edges and area, then forces, kick and drift; contact stands between them where
//! a disc is in reach.

use crate::droplet::Observation;
use crate::droplet::deformable::Ring;
use crate::effects::area::Area;
use crate::effects::contact::Contact;
use crate::effects::{BodyForce, Drag, EdgeForce};
use crate::scene::obstacles::ObstacleArray;
use crate::vector::{LANES, inverse_sqrt, load, max_lanes, store, sum_lanes};
use fearless_simd::{Fallback, Level, dispatch, f64x8, prelude::*};
use std::f64::consts::PI;
use std::sync::Arc;

/// The effects on a ring, as types.
#[derive(Clone, Copy, Debug)]
pub struct RingEffects<E, G, D> {
    /// Forces along the edges.
    pub edge: E,
    /// Area elasticity.
    pub area: Area,
    /// Gravity, or none.
    pub gravity: G,
    /// Drag.
    pub drag: D,
    /// Square of the smoothing length eps.
    pub eps_squared: f64,
}

/// A ring among discs, with its effects, ready to be advanced.
#[derive(Clone, Debug)]
pub struct RingMotion<E, G, D> {
    /// The ring.
    pub ring: Ring,
    /// Its effects.
    pub effects: RingEffects<E, G, D>,
    /// Contact with the discs.
    pub contact: Contact,
    /// The discs.
    pub discs: Arc<ObstacleArray>,
    /// Time step.
    pub dt: f64,
    level: Level,
}

impl<E: EdgeForce, G: BodyForce, D: Drag> RingMotion<E, G, D> {
    /// A ring at rest, its first half step taken.
    pub fn start(
        ring: Ring,
        effects: RingEffects<E, G, D>,
        contact: Contact,
        discs: Arc<ObstacleArray>,
        dt: f64,
        level: Level,
    ) -> Self {
        let mut motion = Self { ring, effects, contact, discs, dt, level };
        motion.contact.moved(f64::INFINITY, &motion.ring, &motion.discs);
        let (fx, fy) = motion.forces();
        let n = motion.ring.n;
        let kick = 0.5 * dt / motion.ring.vertex_mass();
        motion.ring.ux[..n].copy_from_slice(&fx[..n]);
        motion.ring.uy[..n].copy_from_slice(&fy[..n]);
        motion.ring.ux[..n].iter_mut().chain(&mut motion.ring.uy[..n]).for_each(|u| *u *= kick);
        motion.drift();
        motion
    }

    /// Positions follow the half-step velocities.
    fn drift(&mut self) {
        let (ring, dt) = (&mut self.ring, self.dt);
        let mut fastest: f64 = 0.0;
        for i in 0..ring.n {
            ring.x[i] += dt * ring.ux[i];
            ring.y[i] += dt * ring.uy[i];
            fastest = fastest.max(ring.ux[i] * ring.ux[i] + ring.uy[i] * ring.uy[i]);
        }
        ring.close();
        self.contact.moved(dt * fastest.sqrt(), &self.ring, &self.discs);
    }

    /// Takes `steps` time steps.
    pub fn advance(&mut self, steps: u64) {
        let level = self.level;
        dispatch!(level, simd => self.advance_with(simd, steps));
    }

    #[inline(always)]
    fn advance_with<S: Simd>(&mut self, simd: S, steps: u64) {
        simd.vectorize(
            #[inline(always)]
            || {
                for _ in 0..steps {
                    let area = edge_pass(simd, &mut self.ring, &self.effects);
                    let fastest_squared = if self.contact.in_reach() {
                        self.contact.apply(simd, &mut self.ring);
                        kick_and_drift::<S, E, G, D, true>(simd, &mut self.ring, &self.effects, area, self.dt)
                    } else {
                        kick_and_drift::<S, E, G, D, false>(simd, &mut self.ring, &self.effects, area, self.dt)
                    };
                    self.ring.close();
                    self.contact.moved(self.dt * fastest_squared.sqrt(), &self.ring, &self.discs);
                }
            },
        );
    }

    /// Moves the ring's origin next to it. Call at instants that do not depend on how a run is cut up.
    pub fn follow(&mut self) {
        self.ring.follow();
        self.contact.follow(&self.ring, &self.discs);
    }

    /// Forces on the vertices at the present positions, drag apart.
    pub fn forces(&mut self) -> (Vec<f64>, Vec<f64>) {
        // Seldom needed, and the same bits on every instruction set: the plain one keeps the program small.
        self.forces_with(Fallback::new())
    }

    fn forces_with<S: Simd>(&mut self, simd: S) -> (Vec<f64>, Vec<f64>) {
        let area = edge_pass(simd, &mut self.ring, &self.effects);
        self.contact.apply(simd, &mut self.ring);
        let (ring, effects) = (&self.ring, &self.effects);
        let half_pressure = 0.5 * effects.area.pressure(area);
        let (mut fx, mut fy) = (vec![0.0; ring.ux.len()], vec![0.0; ring.ux.len()]);
        for i in (0..ring.ux.len()).step_by(LANES) {
            let (x, y) = net_force::<S, E, G, D, true>(simd, ring, effects, half_pressure, i);
            store(x, &mut fx, i);
            store(y, &mut fy, i);
        }
        (fx, fy)
    }

    /// Full-step velocities at the present positions: `v = [u + dt/2 F/m]/(1 + dt lambda/2)`.
    pub fn velocities(&mut self) -> (Vec<f64>, Vec<f64>) {
        let (mut vx, mut vy) = self.forces();
        let rates = drag_rates(Fallback::new(), self.effects.drag, self.ring.ux.len());
        let kick = 0.5 * self.dt / self.ring.vertex_mass();
        for i in 0..self.ring.n {
            let damping = 1.0 + 0.5 * self.dt * rates[i];
            vx[i] = (self.ring.ux[i] + kick * vx[i]) / damping;
            vy[i] = (self.ring.uy[i] + kick * vy[i]) / damping;
        }
        (vx, vy)
    }

    /// Potential energy of all effects at the present positions.
    pub fn potential_energy(&self) -> f64 {
        let (ring, effects) = (&self.ring, &self.effects);
        let mut energy = effects.area.energy(ring.area_and_perimeter().0) + self.contact.state(ring).energy;
        for i in 0..ring.n {
            let (ex, ey) = (ring.x[i + 1] - ring.x[i], ring.y[i + 1] - ring.y[i]);
            energy += effects.edge.energy((ex * ex + ey * ey + effects.eps_squared).sqrt());
            energy += effects.gravity.energy(ring.x[i] + ring.origin[0]);
        }
        energy
    }

    /// Everything that is recorded, at the present positions.
    pub fn observe(&mut self) -> Observation {
        let (vx, vy) = self.velocities();
        let ring = &self.ring;
        let (area, perimeter) = ring.area_and_perimeter();
        let (centroid, velocity) = ring.centroid(&vx, &vy);
        let squares: f64 = vx[..ring.n].iter().zip(&vy).map(|(x, y)| x * x + y * y).sum();
        let contact = self.contact.state(ring);
        Observation {
            x: centroid[0] + ring.origin[0],
            y: centroid[1] + ring.origin[1],
            velocity: velocity[0],
            kinetic: 0.5 * ring.vertex_mass() * squares,
            potential: self.potential_energy(),
            shape: Some(perimeter * perimeter / (4.0 * PI * area)),
            area_error: Some(area / self.effects.area.rest - 1.0),
            overlap: contact.overlap,
            contacts: contact.loaded,
        }
    }

    /// World position of the centre of a disc inside the ring, if there is one.
    pub fn engulfed(&self) -> Option<[f64; 2]> {
        let origin = self.ring.origin;
        self.contact.engulfed(&self.ring, &self.discs).map(|disc| [disc.x + origin[0], disc.y + origin[1]])
    }
}

#[inline(always)]
fn drag_rates<S: Simd, D: Drag>(simd: S, drag: D, n: usize) -> Vec<f64> {
    let mut rates = vec![0.0; n];
    for i in (0..n).step_by(LANES) {
        store(drag.rate(simd, i), &mut rates, i);
    }
    rates
}

/// Edge vectors and their tension coefficients; returns the area.
#[inline(always)]
fn edge_pass<S: Simd, E: EdgeForce, G: Copy, D: Copy>(simd: S, ring: &mut Ring, effects: &RingEffects<E, G, D>) -> f64 {
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
            let inverse_length = inverse_sqrt(simd, ex * ex + ey * ey + effects.eps_squared);
            store(effects.edge.coefficient(simd, inverse_length), coefficient, i + LANES);
        }
        i += LANES;
    }
    for edges in [edge_x, edge_y, coefficient] {
        edges[LANES - 1] = edges[LANES - 1 + n];
    }
    0.5 * sum_lanes(cross)
}

/// Sum of all forces but drag on the vertices `i..i + 8`.
#[inline(always)]
fn net_force<S: Simd, E: EdgeForce, G: BodyForce, D: Copy, const CONTACT: bool>(
    simd: S,
    ring: &Ring,
    effects: &RingEffects<E, G, D>,
    half_pressure: f64,
    i: usize,
) -> (f64x8<S>, f64x8<S>) {
    let (ex, ey) = (load(simd, &ring.edge_x, i + LANES), load(simd, &ring.edge_y, i + LANES));
    let (back_x, back_y) = (load(simd, &ring.edge_x, i + LANES - 1), load(simd, &ring.edge_y, i + LANES - 1));
    let (pull_x, pull_y) = if E::NEEDS_LENGTH {
        let ahead = load(simd, &ring.coefficient, i + LANES);
        let behind = load(simd, &ring.coefficient, i + LANES - 1);
        (ahead * ex - behind * back_x, ahead * ey - behind * back_y)
    } else {
        let stiffness = effects.edge.coefficient(simd, f64x8::splat(simd, 0.0));
        (stiffness * (ex - back_x), stiffness * (ey - back_y))
    };
    let mut fx = pull_x + (ey + back_y) * half_pressure + effects.gravity.force();
    let mut fy = pull_y - (ex + back_x) * half_pressure;
    if CONTACT {
        fx += load(simd, &ring.contact_x, i);
        fy += load(simd, &ring.contact_y, i);
    }
    (fx, fy)
}

/// New half-step velocities and positions; returns the largest squared speed.
#[inline(always)]
fn kick_and_drift<S: Simd, E: EdgeForce, G: BodyForce, D: Drag, const CONTACT: bool>(
    simd: S,
    ring: &mut Ring,
    effects: &RingEffects<E, G, D>,
    area: f64,
    dt: f64,
) -> f64 {
    let half_pressure = 0.5 * effects.area.pressure(area);
    let (half_dt, kick) = (0.5 * dt, dt / ring.vertex_mass());
    let (mut fastest, mut last) = (f64x8::splat(simd, 0.0), 0.0);
    let long = ring.ux.len();
    let mut i = 0;
    while i + LANES <= long {
        let (fx, fy) = net_force::<S, E, G, D, CONTACT>(simd, ring, effects, half_pressure, i);
        let damping = effects.drag.rate(simd, i) * half_dt;
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
        let (x, y) = (load(simd, &ring.x, i) + ux * dt, load(simd, &ring.y, i) + uy * dt);
        store(x, &mut ring.x, i);
        store(y, &mut ring.y, i);
        i += LANES;
    }
    max_lanes(fastest).max(last)
}

//! Contact of the ring with walls: `U = sum (k_w/2)(delta/2 - d)^2` where `d < delta/2` ([C24] eq. 3).
//!
//! The sum is over edges (default): `d` is the distance from the nearest point of the edge to the surface, negative inside
//! it; that point divides the edge at `q` in [0, 1], and the force is shared `1 - q` to `q` between its vertices. The
//! literal form of the paper sums over vertices.
//!
//! Only stretches of the ring with a wall in reach are looked at. A stretch is a run of blocks of eight edges; the list
//! holds until some vertex has moved by the skin. Walls are visited in the order of their ids, and edges out of
//! reach add exact zeros, so no result depends on when the list was made.

mod curvature;

use crate::on_instruction_set;
use crate::parameters::ContactKind;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::RingForce;
use crate::physics::ring::forces::stiffness::{Parts, Stiffness};
use crate::physics::simd::InstructionSet;
use crate::physics::simd::{LANES, load, padded, store};
use crate::physics::walls::wall::{Asking, Edges, Obstacle, Touch, Walls};
use fearless_simd::{Fallback, f64x8, prelude::*};
use std::sync::Arc;

/// How far a vertex may move before the list is made again, in sigma.
const SKIN: f64 = 0.02;

/// How far from a wall an edge is still held, in sigma.
const HELD_WITHIN: f64 = 1e-4;

/// The eight edges from edge `i` on, their vectors times `share`: 1 where edges touch, 0 where vertices alone do, for an edge
/// of no length stands for its first vertex.
#[inline(always)]
fn edges_at<S: Simd>(simd: S, ring: &Ring, i: usize, share: f64) -> Edges<S> {
    // Made here, for the ring's own edge vectors are those of the step before while the list is made.
    let (x, y) = (load(simd, &ring.x, i), load(simd, &ring.y, i));
    Edges { x, y, ex: (load(simd, &ring.x, i + 1) - x) * share, ey: (load(simd, &ring.y, i + 1) - y) * share }
}

/// Edges of the ring that an obstacle may touch before the list is made again.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch<T> {
    obstacle: T,
    /// First edge, a multiple of eight.
    start: usize,
    /// End, a multiple of eight.
    end: usize,
}

/// The load that one obstacle carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Which obstacle.
    pub id: u32,
    /// Where it acts on average, in local coordinates.
    pub at: [f64; 2],
    /// Force on the droplet.
    pub force: [f64; 2],
    /// Length of the ring in contact, as an angle turned by the normal, in radians.
    pub turn: f64,
}

/// What the contacts amount to at one instant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactState {
    /// Energy.
    pub energy: f64,
    /// Deepest overlap `delta/2 - d`, in sigma.
    pub overlap: f64,
    /// Loads, by the order of the obstacles.
    pub loads: Vec<Load>,
}

/// Contact with the walls of any scene.
pub trait WallContact: RingForce {
    /// Energy, overlap and loads at the present positions.
    fn state(&self, ring: &Ring) -> ContactState;

    /// Where an obstacle lies inside the ring, if one does, in local coordinates.
    fn engulfed(&self, ring: &Ring) -> Option<[f64; 2]>;
}

/// The contact effect and its neighbour list.
#[derive(Clone, Debug)]
pub struct Contact<W: Walls> {
    walls: Arc<W>,
    instruction_set: InstructionSet,
    /// k_w of each edge, zero in the padding.
    stiffness: Vec<f64>,
    /// Distance from a skeleton below which an edge touches: surface + delta/2.
    reach: f64,
    stretches: Vec<Stretch<W::Obstacle>>,
    /// Distance that the fastest vertex may still go.
    slack: f64,
    list_origin: [f64; 2],
    /// 1 where edges touch, 0 where vertices do.
    share: f64,
    /// What each edge was pushed with at the end of the last implicit step.
    pushes: Vec<f64>,
    /// Whether those edges are held.
    holds: bool,
}

impl<W: Walls> Contact<W> {
    /// Contact of a ring of `n_vertices`, each edge of stiffness `k_w`, with `walls`.
    pub fn new(
        walls: Arc<W>,
        kind: ContactKind,
        n_vertices: usize,
        k_w: f64,
        delta: f64,
        instruction_set: InstructionSet,
    ) -> Self {
        let mut stiffness = vec![0.0; padded(n_vertices)];
        stiffness[..n_vertices].fill(k_w);
        let reach = walls.surface() + 0.5 * delta;
        let share = match kind {
            ContactKind::Edge => 1.0,
            ContactKind::Vertex => 0.0,
        };
        let (stretches, slack, list_origin) = (Vec::new(), f64::NEG_INFINITY, [f64::NAN; 2]);
        let pushes = vec![0.0; padded(n_vertices)];
        Self { walls, instruction_set, stiffness, reach, stretches, slack, list_origin, share, pushes, holds: false }
    }

    /// Makes the list of stretches that any obstacle could touch while no vertex moves further than the skin.
    #[inline(never)]
    fn list(&mut self, ring: &Ring) {
        self.slack = SKIN;
        self.list_origin = ring.origin;
        self.stretches.clear();
        let [x0, x1, y0, y1] = ring.bounds();
        let far = self.reach + SKIN;
        // A ring that has burst would ask for the whole scene.
        if !((x1 - x0) + (y1 - y0) < 1e3) {
            return;
        }
        let mut near: Vec<W::Obstacle> = Vec::new();
        self.walls.for_each_near(ring.origin, [x0 - far, x1 + far, y0 - far, y1 + far], |obstacle| near.push(obstacle));
        near.sort_by_key(Obstacle::id);
        let (stretches, blocks, share) = (&mut self.stretches, self.stiffness.len(), self.share);
        on_instruction_set!(self.instruction_set, simd => {
            for &obstacle in &near {
                let mut open = false;
                for start in (0..blocks).step_by(LANES) {
                    let distance = simd.distance(&obstacle, edges_at(simd, ring, start, share));
                    let close = distance.simd_lt(f64x8::splat(simd, far)).any_true();
                    match (close, open) {
                        (true, false) => stretches.push(Stretch { obstacle, start, end: start + LANES }),
                        (true, true) => stretches.last_mut().into_iter().for_each(|s| s.end = start + LANES),
                        _ => {}
                    }
                    open = close;
                }
            }
        });
    }

    /// How the edges `i..i + 8` touch an obstacle; the overlap of those that are held may be negative.
    #[inline(always)]
    fn touch<S: Asking>(&self, simd: S, obstacle: W::Obstacle, edges: Edges<S>, i: usize) -> Option<Touch<S>> {
        if self.holds { self.touch_or_hold(simd, obstacle, edges, i) } else { simd.touch(&obstacle, edges, self.reach) }
    }

    #[inline(always)]
    fn touch_or_hold<S: Asking>(&self, simd: S, obstacle: W::Obstacle, edges: Edges<S>, i: usize) -> Option<Touch<S>> {
        let zero = f64x8::splat(simd, 0.0);
        let touch = simd.touch(&obstacle, edges, self.reach + HELD_WITHIN)?;
        let held = load(simd, &self.pushes, i).simd_gt(zero) & touch.overlap.simd_gt(zero);
        let overlap = touch.overlap - HELD_WITHIN;
        Some(Touch { overlap: held.select(overlap, overlap.max(zero)), ..touch })
    }

    /// Whether an edge that was pushed touches no longer.
    #[inline(always)]
    fn has_lost<S: Asking>(&self, simd: S, ring: &Ring) -> bool {
        for stretch in &self.stretches {
            for i in (stretch.start..stretch.end).step_by(LANES) {
                let touch = self.touch_or_hold(simd, stretch.obstacle, edges_at(simd, ring, i, self.share), i);
                if let Some(touch) = touch
                    && touch.overlap.simd_lt(f64x8::splat(simd, 0.0)).any_true()
                {
                    return true;
                }
            }
        }
        false
    }

    /// Notes what each edge is pushed with.
    #[inline(always)]
    fn note_pushes<S: Asking>(&mut self, simd: S, ring: &Ring) {
        self.pushes.fill(0.0);
        for stretch in &self.stretches {
            for i in (stretch.start..stretch.end).step_by(LANES) {
                let edges = edges_at(simd, ring, i, self.share);
                let Some(touch) = simd.touch(&stretch.obstacle, edges, self.reach) else { continue };
                let push = load(simd, &self.stiffness, i) * touch.overlap;
                store(load(simd, &self.pushes, i) + push, &mut self.pushes, i);
            }
        }
    }

    #[inline(always)]
    fn add_with<S: Asking>(&self, simd: S, ring: &mut Ring) {
        for stretch in &self.stretches {
            let mut i = stretch.start;
            while i < stretch.end {
                if let Some(Touch { q, overlap, nx, ny }) =
                    self.touch(simd, stretch.obstacle, edges_at(simd, ring, i, self.share), i)
                {
                    let push = load(simd, &self.stiffness, i) * overlap;
                    let (fx, fy) = (push * nx, push * ny);
                    // An edge that stands for its first vertex leaves nothing to the second.
                    add_shared(simd, ring, i, q * self.share, fx, fy);
                }
                i += LANES;
            }
        }
    }
}

impl<W: Walls> Contact<W> {
    #[inline(always)]
    fn add_stiffness_with<S: Asking>(&self, simd: S, ring: &Ring, parts: Parts, stiffness: &mut Stiffness) {
        for stretch in &self.stretches {
            for i in (stretch.start..stretch.end).step_by(LANES) {
                let edges = edges_at(simd, ring, i, self.share);
                let Some(touch) = self.touch(simd, stretch.obstacle, edges, i) else { continue };
                let touch = Touch { q: touch.q * self.share, ..touch };
                let curvature = match parts {
                    Parts::All => {
                        stretch.obstacle.curvature(simd, edges.x + touch.q * edges.ex, edges.y + touch.q * edges.ey)
                    }
                    Parts::Positive => f64x8::splat(simd, 0.0),
                };
                let k_w = load(simd, &self.stiffness, i);
                curvature::second_derivatives(simd, edges, touch, k_w, curvature, W::Obstacle::LEVEL)
                    .add_to(simd, stiffness, i);
            }
        }
    }
}

/// Adds a force at the point `q` of each edge `i..i + 8` to its vertices, by the lever rule.
#[inline(always)]
pub fn add_shared<S: Simd>(simd: S, ring: &mut Ring, i: usize, q: f64x8<S>, fx: f64x8<S>, fy: f64x8<S>) {
    let (ahead_x, ahead_y) = (q * fx, q * fy);
    let x0 = load(simd, &ring.force_x, i) + (fx - ahead_x);
    store(x0, &mut ring.force_x, i);
    let y0 = load(simd, &ring.force_y, i) + (fy - ahead_y);
    store(y0, &mut ring.force_y, i);
    let x1 = load(simd, &ring.force_x, i + 1) + ahead_x;
    store(x1, &mut ring.force_x, i + 1);
    let y1 = load(simd, &ring.force_y, i + 1) + ahead_y;
    store(y1, &mut ring.force_y, i + 1);
}

impl<W: Walls> RingForce for Contact<W> {
    #[inline]
    fn moved(&mut self, distance: f64, ring: &Ring) {
        self.slack -= distance;
        // Written so that a NaN, too, leads to a new list.
        if !(self.slack >= 0.0) || self.list_origin != ring.origin {
            self.list(ring);
        }
    }

    fn acts(&self) -> bool {
        !self.stretches.is_empty()
    }

    fn add(&self, ring: &mut Ring) {
        on_instruction_set!(self.instruction_set, simd => self.add_with(simd, ring));
    }

    fn energy(&self, ring: &Ring) -> f64 {
        self.state(ring).energy
    }

    fn settled(&mut self, ring: &Ring) {
        on_instruction_set!(self.instruction_set, simd => self.note_pushes(simd, ring));
    }

    fn hold(&mut self, ring: &Ring) -> bool {
        self.holds = on_instruction_set!(self.instruction_set, simd => self.has_lost(simd, ring));
        self.holds
    }

    fn let_go(&mut self) {
        self.holds = false;
    }

    /// The pushes, which are those before the origin last moved; none if nothing was pushed.
    fn memory(&self) -> Vec<f64> {
        if self.pushes.iter().any(|push| *push != 0.0) { self.pushes.clone() } else { Vec::new() }
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        if memory.is_empty() {
            self.pushes.fill(0.0);
        } else if memory.len() == self.pushes.len() {
            self.pushes.copy_from_slice(memory);
        }
        memory.is_empty() || memory.len() == self.pushes.len()
    }

    fn add_stiffness(&self, ring: &Ring, parts: Parts, stiffness: &mut Stiffness) {
        on_instruction_set!(self.instruction_set, simd => self.add_stiffness_with(simd, ring, parts, stiffness));
    }
}

impl<W: Walls> WallContact for Contact<W> {
    fn state(&self, ring: &Ring) -> ContactState {
        let simd = Fallback::new();
        let mut state = ContactState::default();
        for stretch in &self.stretches {
            let id = stretch.obstacle.id();
            for start in (stretch.start..stretch.end).step_by(LANES) {
                let edges = edges_at(simd, ring, start, self.share);
                let Some(touch) = simd.touch(&stretch.obstacle, edges, self.reach) else { continue };
                for lane in 0..LANES.min(ring.n.saturating_sub(start)) {
                    let overlap = touch.overlap.as_slice()[lane];
                    if overlap <= 0.0 {
                        continue;
                    }
                    let stiffness = self.stiffness[start + lane];
                    state.energy += 0.5 * stiffness * overlap * overlap;
                    state.overlap = state.overlap.max(overlap);
                    let [q, x, y, ex, ey] =
                        [touch.q, edges.x, edges.y, edges.ex, edges.ey].map(|vector| vector.as_slice()[lane]);
                    let normal = [touch.nx.as_slice()[lane], touch.ny.as_slice()[lane]];
                    add_load(&mut state.loads, id, [x + q * ex, y + q * ey], normal, stiffness * overlap);
                }
            }
        }
        state.loads.iter_mut().for_each(finish_load);
        state
    }

    fn engulfed(&self, ring: &Ring) -> Option<[f64; 2]> {
        let [x0, x1, y0, y1] = ring.bounds();
        let mut found = None;
        self.walls.for_each_near(ring.origin, [x0, x1, y0, y1], |obstacle| {
            let inside = obstacle.heart().filter(|&[x, y]| ring.contains(x, y));
            found = found.or(inside);
        });
        found
    }
}

/// Adds the push of one edge to the load of obstacle `id`; `at` is summed with the push as weight until it is finished.
fn add_load(loads: &mut Vec<Load>, id: u32, at: [f64; 2], normal: [f64; 2], push: f64) {
    if loads.last().is_none_or(|load| load.id != id) {
        loads.push(Load { id, at: [0.0; 2], force: [0.0; 2], turn: 0.0 });
    }
    if let Some(load) = loads.last_mut() {
        for k in 0..2 {
            load.at[k] += push * at[k];
            load.force[k] += push * normal[k];
        }
        load.turn += push;
    }
}

/// Divides the sums by the total push. The normals of a wide contact cancel in part: for normals spread evenly over an
/// angle `turn`, `|force| = push sin(turn/2)/(turn/2)`, which is solved for the angle.
fn finish_load(load: &mut Load) {
    let push = load.turn;
    load.at = load.at.map(|sum| sum / push);
    let share = (load.force[0] * load.force[0] + load.force[1] * load.force[1]).sqrt() / push;
    let (mut low, mut high) = (0.0, 2.0 * std::f64::consts::PI);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if libm::sin(0.5 * middle) / (0.5 * middle) > share { low = middle } else { high = middle }
    }
    load.turn = 0.5 * (low + high);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::walls::arrays::obstacles::ObstacleArray;

    fn discs(x: &[f64], y: &[f64]) -> Arc<ObstacleArray> {
        Arc::new(ObstacleArray::from_centres(20.0, 0.15, x, y))
    }

    fn contact(discs: &Arc<ObstacleArray>, n: usize) -> Contact<ObstacleArray> {
        Contact::new(discs.clone(), ContactKind::Edge, n, 100.0, 0.0123, InstructionSet::new())
    }

    #[test]
    fn the_list_holds_every_edge_that_touches_within_the_skin() {
        let discs = discs(&[10.5, 10.0, 9.0], &[10.3, 9.4, 10.0]);
        let ring = Ring::regular(100, [10.0, 10.0], 0.5);
        let mut listed = contact(&discs, 100);
        listed.moved(0.0, &ring);
        for k in 0..64 {
            let (sin, cos) = libm::sincos(0.1 * f64::from(k));
            let mut moved = ring.clone();
            moved.x.iter_mut().for_each(|x| *x += 0.999 * SKIN * cos);
            moved.y.iter_mut().for_each(|y| *y += 0.999 * SKIN * sin);
            let mut fresh = contact(&discs, 100);
            fresh.moved(0.0, &moved);
            assert_eq!(listed.state(&moved), fresh.state(&moved));
        }
    }

    #[test]
    fn a_disc_inside_the_ring_is_found() {
        let discs = discs(&[10.1], &[10.05]);
        let contact = contact(&discs, 64);
        assert!(contact.engulfed(&Ring::regular(64, [10.0, 10.0], 0.5)).is_some());
        assert!(contact.engulfed(&Ring::regular(64, [10.7, 10.0], 0.5)).is_none());
    }
}

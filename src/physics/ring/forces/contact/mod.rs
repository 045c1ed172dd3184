//! Contact of the ring with walls: `U = sum (k_w/2)(delta/2 - d)^2` where `d < delta/2` ([C24] eq. 3).
//!
//! By default the sum is over edges, and `d` is the distance from the surface to the nearest point of the edge,
//! negative inside the wall. That point divides the edge at `q` in [0, 1], and its force is shared by the edge's two
//! vertices as `1 - q` to `q`. The literal form of the paper sums over vertices.
//!
//! Only stretches of the ring that are near a wall are examined (`stretches`); if there are none, the effect is left
//! out of the step. Walls are visited in the order of their ids, and edges out of reach add exact zeros, so no result
//! depends on when the list of stretches was made.

mod curvature;
mod holding;
mod loads;
mod stretches;

pub use loads::{ContactState, Load};
pub(crate) use loads::{add_load, finish_load};

use crate::on_instruction_set;
use crate::parameters::ContactKind;
use crate::physics::ring::forces::stiffness::{Parts, Stiffness};
use crate::physics::ring::{Ring, forces::RingForce};
use crate::physics::simd::{InstructionSet, LANES, load, padded, store};
use crate::physics::walls::neighbours::Neighbours;
use crate::physics::walls::wall::{Obstacle, ObstacleQueries, Touch, Walls};
use fearless_simd::{f64x8, prelude::*};
use std::sync::Arc;
use stretches::{Stretch, edges_at};

/// How far a vertex may move before the list is made again, in sigma.
const SKIN: f64 = 0.02;

/// Contact with the walls of any scene.
pub trait WallContact: RingForce {
    /// Energy, overlap and loads at the present positions.
    fn state(&self, ring: &Ring) -> ContactState;

    /// Position of an obstacle inside the ring, if there is one, in local coordinates.
    fn engulfed(&self, ring: &Ring) -> Option<[f64; 2]>;
}

/// Contact of a ring with walls.
#[derive(Clone, Debug)]
pub struct Contact<W: Walls> {
    walls: Arc<W>,
    instruction_set: InstructionSet,
    /// k_w of each edge, zero in the padding.
    stiffness: Vec<f64>,
    /// Distance from a skeleton below which an edge touches: surface + delta/2.
    reach: f64,
    stretches: Neighbours<Stretch<W::Obstacle>>,
    /// 1 where edges touch, 0 where vertices do.
    share: f64,
    /// The force with which each edge was pushed at the end of the last implicit step.
    pushes: Vec<f64>,
    /// Whether edges that were pushed are held.
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
        let share = match kind {
            ContactKind::Edge => 1.0,
            ContactKind::Vertex => 0.0,
        };
        Self {
            instruction_set,
            stiffness,
            reach: walls.surface() + 0.5 * delta,
            walls,
            stretches: Neighbours::new(SKIN),
            share,
            pushes: vec![0.0; padded(n_vertices)],
            holds: false,
        }
    }

    #[inline(always)]
    fn add_with<S: ObstacleQueries>(&self, simd: S, ring: &mut Ring) {
        for stretch in &self.stretches.items {
            let mut i = stretch.start;
            while i < stretch.end {
                if let Some(Touch { q, overlap, nx, ny }) =
                    self.touch(simd, stretch.obstacle, edges_at(simd, ring, i, self.share), i)
                {
                    let push = load(simd, &self.stiffness, i) * overlap;
                    let (fx, fy) = (push * nx, push * ny);
                    // Where vertices touch, the second vertex of an edge gets no force.
                    add_shared(simd, ring, i, q * self.share, fx, fy);
                }
                i += LANES;
            }
        }
    }

    #[inline(always)]
    fn add_stiffness_with<S: ObstacleQueries>(&self, simd: S, ring: &Ring, parts: Parts, stiffness: &mut Stiffness) {
        for stretch in &self.stretches.items {
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
                curvature::second_derivatives(simd, edges, touch, k_w, curvature, W::Obstacle::BETA)
                    .add_to(simd, stiffness, i);
            }
        }
    }
}

/// Adds a force at the point `q` of each edge `i..i + 8` to its vertices, by the lever rule.
#[inline(always)]
fn add_shared<S: Simd>(simd: S, ring: &mut Ring, i: usize, q: f64x8<S>, fx: f64x8<S>, fy: f64x8<S>) {
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
        if self.stretches.moved(distance, ring.origin) {
            self.list(ring);
        }
    }

    fn acts(&self) -> bool {
        !self.stretches.items.is_empty()
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

    /// The pushes at the end of the last implicit step; empty if there were none. Computed again from the positions,
    /// their last bits could differ, because the origin may have moved.
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
        self.state_at(ring)
    }

    fn engulfed(&self, ring: &Ring) -> Option<[f64; 2]> {
        let [x0, x1, y0, y1] = ring.bounds();
        let mut found = None;
        self.walls.for_each_near(ring.origin, [x0, x1, y0, y1], |obstacle| {
            let inside = obstacle.inner_point().filter(|&[x, y]| ring.contains(x, y));
            found = found.or(inside);
        });
        found
    }
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

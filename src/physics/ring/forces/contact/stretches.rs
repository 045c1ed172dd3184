//! Which stretches of the ring an obstacle may touch.
//!
//! A stretch consists of consecutive blocks of eight edges. A block is listed if one of its edges comes within reach
//! plus skin of the obstacle.

use crate::on_instruction_set;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::contact::{Contact, SKIN};
use crate::physics::simd::{LANES, load};
use crate::physics::walls::neighbours::obstacles_near;
use crate::physics::walls::wall::{Edges, ObstacleQueries, Walls};
use fearless_simd::{f64x8, prelude::*};

/// Consecutive edges of the ring that an obstacle may touch before the list is made again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch<T> {
    pub(super) obstacle: T,
    /// First edge, a multiple of eight.
    pub(super) start: usize,
    /// One past the last edge, a multiple of eight.
    pub(super) end: usize,
}

/// The eight edges from edge `i` on, with their vectors times `share`. That is 1 if edges touch, and 0 if only vertices
/// do: an edge without length is its first vertex.
#[inline(always)]
pub(super) fn edges_at<S: Simd>(simd: S, ring: &Ring, i: usize, share: f64) -> Edges<S> {
    // Not the ring's own edge vectors: when the list is made, these are still those of the step before.
    let (x, y) = (load(simd, &ring.x, i), load(simd, &ring.y, i));
    Edges { x, y, ex: (load(simd, &ring.x, i + 1) - x) * share, ey: (load(simd, &ring.y, i + 1) - y) * share }
}

impl<W: Walls> Contact<W> {
    /// Makes the list of stretches, in the order of the obstacles' ids.
    #[inline(never)]
    pub(super) fn list(&mut self, ring: &Ring) {
        self.stretches.renew(ring.origin);
        let far = self.reach + SKIN;
        let near = obstacles_near(&*self.walls, ring.origin, ring.bounds(), far);
        let (stretches, edges, share) = (&mut self.stretches.items, self.stiffness.len(), self.share);
        on_instruction_set!(self.instruction_set, simd => {
            for &obstacle in &near {
                let mut open = false;
                for start in (0..edges).step_by(LANES) {
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
}

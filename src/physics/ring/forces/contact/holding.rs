//! Contacts that pull for a while, for the implicit integrator.
//!
//! Newton's method alternates where an edge touches in one iteration and not in the next. So an edge that was pushed
//! when the last time step ended can be held: while it is within [`HELD_WITHIN`] of touching, its spring pulls.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::contact::{Contact, stretches::edges_at};
use crate::physics::simd::{LANES, load, store};
use crate::physics::walls::wall::{Edges, ObstacleQueries, Touch, Walls};
use fearless_simd::{f64x8, prelude::*};

/// Largest distance from touching at which an edge is held, in sigma.
const HELD_WITHIN: f64 = 1e-4;

impl<W: Walls> Contact<W> {
    /// How the edges `i..i + 8` touch an obstacle; the overlap of those that are held may be negative.
    #[inline(always)]
    pub(super) fn touch<S: ObstacleQueries>(
        &self,
        simd: S,
        obstacle: W::Obstacle,
        edges: Edges<S>,
        i: usize,
    ) -> Option<Touch<S>> {
        if self.holds { self.touch_or_hold(simd, obstacle, edges, i) } else { simd.touch(&obstacle, edges, self.reach) }
    }

    #[inline(always)]
    fn touch_or_hold<S: ObstacleQueries>(
        &self,
        simd: S,
        obstacle: W::Obstacle,
        edges: Edges<S>,
        i: usize,
    ) -> Option<Touch<S>> {
        let zero = f64x8::splat(simd, 0.0);
        let touch = simd.touch(&obstacle, edges, self.reach + HELD_WITHIN)?;
        let held = load(simd, &self.pushes, i).simd_gt(zero) & touch.overlap.simd_gt(zero);
        let overlap = touch.overlap - HELD_WITHIN;
        Some(Touch { overlap: held.select(overlap, overlap.max(zero)), ..touch })
    }

    /// Whether an edge that was pushed no longer touches, but is near enough to be held.
    #[inline(always)]
    pub(super) fn has_lost<S: ObstacleQueries>(&self, simd: S, ring: &Ring) -> bool {
        for stretch in &self.stretches.items {
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

    /// Stores the force with which each edge is pushed.
    #[inline(always)]
    pub(super) fn note_pushes<S: ObstacleQueries>(&mut self, simd: S, ring: &Ring) {
        self.pushes.fill(0.0);
        for stretch in &self.stretches.items {
            for i in (stretch.start..stretch.end).step_by(LANES) {
                let edges = edges_at(simd, ring, i, self.share);
                let Some(touch) = simd.touch(&stretch.obstacle, edges, self.reach) else { continue };
                let push = load(simd, &self.stiffness, i) * touch.overlap;
                store(load(simd, &self.pushes, i) + push, &mut self.pushes, i);
            }
        }
    }
}

//! The state of a ring that is saved, so that its motion goes on with the same bits.
//!
//! Lists of near walls are not saved: they are made again from the positions, and no bit depends on when that is done.
//! Where later bits do depend on an effect's past, the effect has a memory
//! ([`RingForce::memory`](crate::physics::ring::forces::RingForce::memory)).

use crate::physics::ring::Ring;
use serde::{Deserialize, Serialize};

/// Positions and velocities of a ring; the rest of a [`Ring`] is scratch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RingState {
    x: Vec<f64>,
    y: Vec<f64>,
    ux: Vec<f64>,
    uy: Vec<f64>,
    origin: [f64; 2],
}

impl RingState {
    pub(super) fn of(ring: &Ring) -> Self {
        let [x, y, ux, uy] = [&ring.x, &ring.y, &ring.ux, &ring.uy].map(|column| column[..ring.n].to_vec());
        Self { x, y, ux, uy, origin: ring.origin }
    }

    /// The ring in this state; `None` if the state is not that of `n` vertices.
    pub(super) fn ring(&self, n: usize) -> Option<Ring> {
        let mut ring = Ring::at(n, self.origin);
        let columns =
            [(&mut ring.x, &self.x), (&mut ring.y, &self.y), (&mut ring.ux, &self.ux), (&mut ring.uy, &self.uy)];
        for (column, saved) in columns {
            if saved.len() != n {
                return None;
            }
            column[..n].copy_from_slice(saved);
        }
        ring.close();
        Some(ring)
    }
}

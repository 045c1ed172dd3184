//! What has to be kept of a ring in motion so that it goes on with the same bits.
//!
//! Lists of near walls are made again from the positions: no bit depends on when. What does depend on it, an effect keeps as
//! its memory ([`RingForce::memory`](crate::physics::ring::forces::RingForce::memory)).

use crate::physics::motion::verlet::RingEffects;
use crate::physics::ring::Ring;
use crate::physics::simd::aligned::Aligned;
use crate::physics::simd::{LANES, padded};
use serde::{Deserialize, Serialize};

/// A state that does not belong to the droplet it was given to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the saved state is that of another droplet")]
pub struct WrongState;

/// Positions and velocities of a ring; the rest of a [`Ring`] is scratch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RingState {
    x: Vec<f64>,
    y: Vec<f64>,
    ux: Vec<f64>,
    uy: Vec<f64>,
    origin: [f64; 2],
}

impl RingState {
    /// The state of `ring`.
    pub fn of(ring: &Ring) -> Self {
        let [x, y, ux, uy] = [&ring.x, &ring.y, &ring.ux, &ring.uy].map(|column| column[..ring.n].to_vec());
        Self { x, y, ux, uy, origin: ring.origin }
    }

    /// The ring of `n` vertices in this state.
    ///
    /// # Errors
    /// [`WrongState`] if it has not `n` vertices.
    pub fn ring(&self, n: usize) -> Result<Ring, WrongState> {
        if [&self.x, &self.y, &self.ux, &self.uy].iter().any(|column| column.len() != n) {
            return Err(WrongState);
        }
        let long = |column: &[f64], length: usize| {
            let mut long = Aligned::zeros(length);
            long[..column.len()].copy_from_slice(column);
            long
        };
        let (short, scratch) = (padded(n), || Aligned::zeros(padded(n) + LANES));
        let mut ring = Ring {
            n,
            x: long(&self.x, short + LANES),
            y: long(&self.y, short + LANES),
            ux: long(&self.ux, short),
            uy: long(&self.uy, short),
            edge_x: scratch(),
            edge_y: scratch(),
            coefficient: scratch(),
            force_x: scratch(),
            force_y: scratch(),
            origin: self.origin,
        };
        ring.close();
        Ok(ring)
    }
}

impl<E, D> RingEffects<E, D> {
    /// What the walls and each of the others remember.
    pub fn memory(&self) -> Vec<Vec<f64>> {
        std::iter::once(self.walls.memory()).chain(self.others.iter().map(|other| other.memory())).collect()
    }

    /// Has them remember that, their lists being made.
    ///
    /// # Errors
    /// [`WrongState`] if it is not what they would write.
    pub fn recall(&mut self, memory: &[Vec<f64>]) -> Result<(), WrongState> {
        let Some((of_walls, of_others)) = memory.split_first() else { return Err(WrongState) };
        let known = of_others.len() == self.others.len()
            && self.walls.recall(of_walls)
            && self.others.iter_mut().zip(of_others).all(|(other, memory)| other.recall(memory));
        if known { Ok(()) } else { Err(WrongState) }
    }
}

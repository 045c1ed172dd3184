//! Drag: a viscous force `-m lambda_i v_i` on each vertex, which every integrator treats implicitly.
//!
//! Far from walls ([C24] eqs 5, 6 with b0 = 0) it is `-(b_inf/N_v) v_i` with `b_inf = M/V_t`. The damping rate is then
//! `b_inf/M = 1/V_t` for any number of vertices: 33 per t0 at V_t = 0.03. [`NearWallDrag`] has a rate for each vertex.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::near_wall_drag::NearWallDrag;
use crate::physics::simd::load;
use fearless_simd::{f64x8, prelude::*};

/// The drag on a ring.
#[derive(Debug)]
pub enum Drag {
    /// The same drag on every vertex.
    Far {
        /// Damping rate `1/V_t`, in 1/t0.
        rate: f64,
    },
    /// Drag that grows towards a wall.
    NearWall(NearWallDrag),
}

impl Drag {
    /// Updates the damping rates after no vertex has moved further than `distance`.
    #[inline(always)]
    pub(crate) fn update(&mut self, distance: f64, ring: &Ring) {
        match self {
            Self::Far { .. } => {}
            Self::NearWall(drag) => drag.update(distance, ring),
        }
    }

    /// The damping rates as a pass over the ring reads them.
    #[inline(always)]
    pub(crate) fn rates(&self) -> Rates<'_> {
        match self {
            Self::Far { rate } => Rates::Even(*rate),
            Self::NearWall(drag) => Rates::Each(drag.rates()),
        }
    }
}

/// Damping rates `lambda` of the vertices of a ring, in 1/t0.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rates<'a> {
    /// One rate for all vertices.
    Even(f64),
    /// One rate for each vertex, padded to whole vectors.
    Each(&'a [f64]),
}

impl Rates<'_> {
    pub(crate) fn at(self, i: usize) -> f64 {
        match self {
            Self::Even(rate) => rate,
            Self::Each(rates) => rates[i],
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(self, simd: S, i: usize) -> f64x8<S> {
        match self {
            Self::Even(rate) => f64x8::splat(simd, rate),
            Self::Each(rates) => load(simd, rates, i),
        }
    }
}

//! Drag far from walls ([C24] eqs 5, 6 with b0 = 0): `-(b_inf/N_v) v_i`, `b_inf = M/V_t`.
//!
//! The damping rate is `b_inf/M = 1/V_t`, whatever the number of vertices: 33 per t0 at V_t = 0.03.

use crate::physics::ring::Ring;
use crate::physics::ring::forces::{Drag, Rates};

/// The same drag on every vertex.
#[derive(Clone, Copy, Debug)]
pub struct FarDrag {
    /// Damping rate `1/V_t`, in 1/t0.
    pub rate: f64,
}

impl Drag for FarDrag {
    fn update(&mut self, _: f64, _: &Ring) {}

    fn rates(&self) -> Rates<'_> {
        Rates::Even(self.rate)
    }
}

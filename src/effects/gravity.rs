//! Gravity along +x: `U = -M x_c` with x_c the mean vertex, so each vertex feels `M/N_v`.

use super::BodyForce;
use crate::job::MASS;

/// Gravity on each vertex.
#[derive(Clone, Copy, Debug)]
pub struct Gravity {
    vertex_weight: f64,
}

impl Gravity {
    /// Weight shared by `n_vertices`.
    pub fn new(n_vertices: usize) -> Self {
        Self { vertex_weight: MASS / n_vertices as f64 }
    }

    /// No gravity, while a droplet is put in place.
    pub fn off() -> Self {
        Self { vertex_weight: 0.0 }
    }
}

impl BodyForce for Gravity {
    #[inline(always)]
    fn force(self) -> f64 {
        self.vertex_weight
    }
}

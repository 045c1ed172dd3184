//! Gravity along +x: `U = -M x_c` with x_c the mean x of the vertices, so the force on each vertex is `M/N_v`.

use crate::parameters::MASS;

/// Weight of each vertex.
#[derive(Clone, Copy, Debug)]
pub struct Gravity {
    vertex_weight: f64,
}

impl Gravity {
    /// Weight shared by `n_vertices`.
    pub fn new(n_vertices: usize) -> Self {
        Self { vertex_weight: MASS / n_vertices as f64 }
    }

    /// No weight: while a droplet is put at its start, or if hydrostatic pressure drives it.
    pub fn off() -> Self {
        Self { vertex_weight: 0.0 }
    }

    #[inline(always)]
    pub(crate) fn force(self) -> f64 {
        self.vertex_weight
    }

    pub(crate) fn energy(self, x: f64) -> f64 {
        -self.vertex_weight * x
    }
}

//! Perimeter elasticity: `U = (K_l N_v/2) sum (l_i - l0)^2` ([C24] eq. 1), with the smoothed length.
//!
//! Weak at the default `kappa = K_l/Gamma = 1e-3`: it keeps vertices from drifting together, and little more.

use crate::physics::ring::forces::{EdgeForce, TensionLaw};

/// Spring of each edge, `T = K_l N_v (l - l0)`.
#[derive(Clone, Copy, Debug)]
pub struct Perimeter {
    /// `K_l N_v`.
    pub stiffness: f64,
    /// Rest length l0.
    pub rest: f64,
}

impl EdgeForce for Perimeter {
    fn law(self) -> TensionLaw {
        TensionLaw { constant: -self.stiffness * self.rest, per_length: self.stiffness }
    }

    fn energy(self, length: f64) -> f64 {
        0.5 * self.stiffness * (length - self.rest) * (length - self.rest)
    }
}

//! Line tension: `U = Gamma * sum l_i` ([C24] eq. 2 with equal tensions), with the smoothed length
//! `l_eps = sqrt(l^2 + eps^2)`.
//!
//! Example: a circle of radius R under Gamma = 1 holds against a pressure `Gamma/R`.

use crate::physics::ring::forces::{EdgeForce, TensionLaw};

/// Constant tension `T = Gamma`.
#[derive(Clone, Copy, Debug)]
pub struct Tension {
    /// Line tension Gamma.
    pub gamma: f64,
}

impl EdgeForce for Tension {
    fn law(self) -> TensionLaw {
        TensionLaw { constant: self.gamma, per_length: 0.0 }
    }

    fn energy(self, length: f64) -> f64 {
        self.gamma * length
    }
}

/// Tension and perimeter together at `kappa = 1/(N_v l0)`: a linear spring of zero rest length, `T = Gamma l/l0`.
///
/// The smoothing cancels: `Gamma/l_eps + (Gamma/l0)(1 - l0/l_eps) = Gamma/l0`.
#[derive(Clone, Copy, Debug)]
pub struct LinearTension {
    /// `Gamma/l0`.
    pub stiffness: f64,
    /// Rest edge length l0, which only sets the zero of the energy.
    pub rest: f64,
}

impl EdgeForce for LinearTension {
    fn law(self) -> TensionLaw {
        TensionLaw { constant: 0.0, per_length: self.stiffness }
    }

    fn energy(self, length: f64) -> f64 {
        0.5 * self.stiffness * (length * length + self.rest * self.rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ring::forces::perimeter::Perimeter;

    #[test]
    fn the_linear_spring_is_tension_plus_perimeter_at_its_kappa() {
        let (gamma, rest) = (1.3, 0.0123);
        let pair = (Tension { gamma }, Perimeter { stiffness: gamma / rest, rest });
        let linear = LinearTension { stiffness: gamma / rest, rest };
        for length in [0.001, 0.0123, 0.2] {
            assert!((pair.energy(length) / linear.energy(length) - 1.0).abs() < 1e-12);
        }
    }
}

//! Tension along the edges of a ring: line tension and perimeter elasticity.
//!
//! Line tension is `U = Gamma sum l_i` ([C24] eq. 2 with equal tensions), perimeter elasticity `U = (K_l N_v/2) sum
//! (l_i - l0)^2` ([C24] eq. 1). Both take the smoothed length `l_eps = sqrt(l^2 + eps^2)`, so that an edge pulls with
//! `T = Gamma + K_l N_v (l_eps - l0)`.
//!
//! | case | when | |
//! |---|---|---|
//! | line tension alone | `kappa = K_l/Gamma = 0` | `T = Gamma` |
//! | with springs | other kappa | weak at the default `kappa = 1e-3`: they only keep vertices from drifting together |
//! | linear spring | `kappa = 1/(N_v l0)` | `T = Gamma l/l0`: the smoothing cancels, and no edge length is needed |
//!
//! Example: a circle of radius R balances a pressure `Gamma/R`.

use crate::parameters::{Deformable, regular_edge};
use crate::physics::simd::{Instructions, fma};
use fearless_simd::{f64x8, prelude::*};

/// The tension along the edges of a ring.
///
/// ```
/// use meniscus::parameters::Deformable;
/// use meniscus::physics::ring::forces::tension::EdgeTension;
/// let droplet = Deformable { kappa: 0.0, ..Deformable::of_tension(1.5) };
/// assert_eq!(EdgeTension::of(&droplet), EdgeTension::Line { gamma: 1.5 });
/// assert_eq!(EdgeTension::of(&droplet).energy(0.02), 1.5 * 0.02);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EdgeTension {
    /// Line tension alone, `T = Gamma`.
    Line {
        /// Line tension Gamma.
        gamma: f64,
    },
    /// Line tension and a spring of each edge, `T = Gamma + K_l N_v (l_eps - l0)`.
    Springs {
        /// Line tension Gamma.
        gamma: f64,
        /// `K_l N_v`.
        stiffness: f64,
        /// Rest length l0.
        rest: f64,
    },
    /// A linear spring of zero rest length, `T = Gamma l/l0`.
    Linear {
        /// `Gamma/l0`.
        stiffness: f64,
        /// Rest length l0, which only sets the zero of the energy.
        rest: f64,
    },
}

impl EdgeTension {
    /// No tension at all.
    pub const NONE: Self = Self::Line { gamma: 0.0 };

    /// The tension of a droplet.
    pub fn of(ring: &Deformable) -> Self {
        let (n, gamma, rest) = (ring.n_vertices as f64, ring.gamma, regular_edge(ring.n_vertices));
        if ring.kappa == 0.0 {
            Self::Line { gamma }
        } else if is_linear(ring) {
            Self::Linear { stiffness: gamma / rest, rest }
        } else {
            Self::Springs { gamma, stiffness: ring.kappa * gamma * n, rest }
        }
    }

    /// The tension as a pass over the ring reads it.
    pub(crate) fn law(self) -> TensionLaw {
        match self {
            Self::Line { gamma } => TensionLaw { constant: gamma, per_length: 0.0 },
            Self::Springs { gamma, stiffness, rest } => {
                TensionLaw { constant: gamma + -stiffness * rest, per_length: stiffness }
            }
            Self::Linear { stiffness, .. } => TensionLaw { constant: 0.0, per_length: stiffness },
        }
    }

    /// Energy of one edge of smoothed length `l_eps`.
    pub fn energy(self, length: f64) -> f64 {
        match self {
            Self::Line { gamma } => gamma * length,
            Self::Springs { gamma, stiffness, rest } => {
                gamma * length + 0.5 * stiffness * (length - rest) * (length - rest)
            }
            Self::Linear { stiffness, rest } => 0.5 * stiffness * (length * length + rest * rest),
        }
    }
}

/// Whether tension and perimeter add up to the linear spring, `kappa = 1/(N_v l0)`.
pub(crate) fn is_linear(ring: &Deformable) -> bool {
    (ring.kappa / ring.linear_kappa() - 1.0).abs() < 1e-9
}

/// A tension that depends on the smoothed length alone, `T = constant + per_length l_eps`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TensionLaw {
    /// The part that does not depend on the length.
    pub(crate) constant: f64,
    /// The part that grows with the length.
    pub(crate) per_length: f64,
}

impl TensionLaw {
    /// Whether edge lengths are needed. A spring of zero rest length has no constant part, and needs none.
    pub(crate) fn needs_length(self) -> bool {
        self.constant != 0.0
    }

    /// `T/l_eps` from `1/l_eps`, eight edges at a time: the edge pulls its first vertex with `T/l_eps` times the edge
    /// vector, and its second with the opposite.
    #[inline(always)]
    pub(crate) fn coefficient<S: Instructions>(self, simd: S, inverse_length: f64x8<S>) -> f64x8<S> {
        fma(inverse_length, f64x8::splat(simd, self.constant), f64x8::splat(simd, self.per_length))
    }

    /// `(1/l_eps) d(T/l_eps)/dl_eps` from `1/l_eps`; with the edge vector e, the second derivative of the energy is
    /// `T/l_eps + slope e e^T`. Only the implicit integrator reads it.
    #[inline(always)]
    pub(crate) fn slope<S: Simd>(self, inverse_length: f64x8<S>) -> f64x8<S> {
        inverse_length * inverse_length * inverse_length * -self.constant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_linear_spring_is_tension_plus_perimeter_at_its_kappa() {
        let (gamma, rest) = (1.3, 0.0123);
        let both = EdgeTension::Springs { gamma, stiffness: gamma / rest, rest };
        let linear = EdgeTension::Linear { stiffness: gamma / rest, rest };
        for length in [0.001, 0.0123, 0.2] {
            assert!((both.energy(length) / linear.energy(length) - 1.0).abs() < 1e-12);
        }
    }
}

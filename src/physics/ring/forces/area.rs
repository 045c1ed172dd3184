//! Area elasticity: `U = (K_a/2)(a - a0)^2` ([C24] eq. 1), with the area a by the shoelace formula.
//!
//! It acts as a pressure `p = -K_a (a - a0)` that pushes every vertex with `p/2` times the normal of the chord between
//! its two neighbours. At K_a = 1e4 and Gamma = 1 a circle shrinks by `2 Gamma/(sigma K_a)`, 0.03% of its area.

/// Area stiffness and rest area.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    /// K_a.
    pub stiffness: f64,
    /// a0.
    pub rest: f64,
}

impl Area {
    /// Pressure `-K_a (a - a0)` at area `a`.
    #[inline(always)]
    pub fn pressure(self, area: f64) -> f64 {
        -self.stiffness * (area - self.rest)
    }

    pub(crate) fn energy(self, area: f64) -> f64 {
        0.5 * self.stiffness * (area - self.rest) * (area - self.rest)
    }
}

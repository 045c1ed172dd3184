//! When two parts of a ring lie apart along it, so that they repel each other, and when they are neighbours.
//!
//! In a *fold* the way along the ring between two parts that meet is long. In a *pile*, where gravity has driven many
//! vertices together, that way is short, although there are many vertices between the two parts. Whether piles occur
//! depends on the tension and the gravity of a droplet ([`Apart::of`]).

use crate::parameters::{Deformable, GravityForm, MASS, regular_edge};
use std::f64::consts::PI;

/// How two parts of a ring are told to lie apart along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Apart {
    /// If the way between them is longer than [`WAY`] times delta. Vertices of a pile do not repel each other.
    Way,
    /// If the way is as long, or if there are more vertices between them than [`places_within`]. Vertices that gravity
    /// drives down the interface then stand on each other instead of passing through one another.
    Places,
}

impl Apart {
    /// By places if vertices pile up. That happens if the tension of a long edge is too weak to hold the vertices below
    /// it; each flank of a round droplet bears a weight of `M/pi`. Other droplets crowd their vertices a little when at
    /// rest, and each crowd would cost a hundred pairs, so for them the way decides.
    pub(crate) fn of(ring: &Deformable) -> Self {
        let long = match ring.gravity {
            GravityForm::Vertex => LONG,
            // Hydrostatic pressure does not balance the drag vertex by vertex, not even in free fall: at Gamma = 0.1
            // and kappa = 1/pi the vertices are swept upstream into a tail that crosses itself.
            GravityForm::Centroid => 1.0,
        };
        // T = gamma + K_l N_v (l - l0) at l = long l0, N_v l0 = pi.
        let tension = ring.gamma * (1.0 + ring.kappa * PI * (long - 1.0));
        if tension < MASS / PI { Self::Places } else { Self::Way }
    }

    /// Skin of the list of pairs, for the sum of the movements of two vertices. If it is less than `(WAY - 1) delta`,
    /// bends of a round ring are not listed.
    pub(super) fn skin(self, delta: f64) -> f64 {
        match self {
            Self::Way => 0.02,
            Self::Places => 0.5 * delta,
        }
    }

    /// Stiffness k times the number of vertices. In a pile a few contacts may carry the weight of the droplet, and must
    /// not give way. At N_v = 256 and 4e4 one contact bears a force of 1.9, more than twice that weight. With 1e5 a
    /// simulation would take five times as long, and a droplet of kappa = 1e-4 that pinches off a lobe would still
    /// cross itself.
    pub(crate) const fn total_stiffness(self) -> f64 {
        match self {
            Self::Way => 1e4,
            Self::Places => 4e4,
        }
    }
}

/// Length of an edge, in units of l0, at which the tension must bear the weight of a flank. With 8 instead of 3, piles
/// would be expected only below Gamma = 0.031 for kappa = 1/pi. At Gamma = 0.0316, 14 of 60 droplets then crossed
/// themselves when their tail was drawn over an obstacle; at 0.1 none of 60 did.
const LONG: f64 = 3.0;

/// Shortest way along the ring between two parts that repel each other, in units of delta. For comparison: the way
/// round a hairpin that is delta wide is pi/2.
pub(super) const WAY: f64 = 3.0;

/// Number of edges at rest, of a ring of `n` vertices, within a way of `pi delta`. A loop of that length is too small
/// to hold a vertex.
pub(super) fn places_within(n: usize, delta: f64) -> usize {
    ((PI * delta / regular_edge(n)) as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_pile_up_at_small_tension_on_weak_springs() {
        let apart = |gamma, kappa| Apart::of(&Deformable { kappa, ..Deformable::of_tension(gamma) });
        assert_eq!([apart(0.24, 1e-3), apart(0.26, 1e-3)], [Apart::Places, Apart::Way]);
        assert_eq!([apart(0.08, 1.0 / PI), apart(0.09, 1.0 / PI)], [Apart::Places, Apart::Way]);
        let hydrostatic = Deformable { kappa: 1.0 / PI, gravity: GravityForm::Centroid, ..Deformable::of_tension(0.2) };
        assert_eq!(Apart::of(&hydrostatic), Apart::Places);
    }

    #[test]
    fn neighbours_stand_as_far_apart_however_fine_the_ring() {
        assert_eq!([256, 1024].map(|n| places_within(n, PI / 256.0)), [3, 12]);
    }
}

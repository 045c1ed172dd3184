//! What of a ring lies apart along it, so that it can touch itself there; the rest are neighbours.

use crate::parameters::{Deformable, GravityForm, MASS, regular_edge};
use std::f64::consts::PI;

/// How two parts of a ring are told to lie apart along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Apart {
    /// The way between them is longer than [`WAY`] times delta: closer ones are a bend. Vertices may then crowd as they like.
    Way,
    /// That, or there are more vertices between them than [`places_within`]: vertices that gravity drives down the interface then stand on each other
    /// instead of passing through one another.
    Places,
}

impl Apart {
    /// By places where vertices pile up: where the tension of a long edge is too weak to hold up the vertices below, whose weight, in
    /// a round droplet, is `M/pi` of each flank. Everywhere else the way: a droplet at rest crowds its vertices a little, and
    /// every crowd would cost a hundred pairs.
    pub fn of(ring: &Deformable) -> Self {
        let long = match ring.gravity {
            GravityForm::Vertex => LONG,
            // Hydrostatic pressure leaves it to the ring to share out the drag, in free fall too: at Gamma = 0.1 and kappa = 1/pi
            // the vertices are swept upstream into a tail that crosses itself.
            GravityForm::Centroid => 1.0,
        };
        // T = gamma + K_l N_v (l - l0) at l = long l0, N_v l0 = pi.
        let tension = ring.gamma * (1.0 + ring.kappa * PI * (long - 1.0));
        if tension < MASS / PI { Self::Places } else { Self::Way }
    }

    /// Sum of the movements of two vertices after which a list of pairs may miss one; less than `(WAY - 1) delta` keeps bends of a
    /// round ring off it.
    pub(super) fn skin(self, delta: f64) -> f64 {
        match self {
            Self::Way => 0.02,
            Self::Places => 0.5 * delta,
        }
    }

    /// Stiffness k times the number of vertices. In a pile a few long edges may carry the weight of the droplet, which must not push
    /// them through one another: at N_v = 256 one contact of 4e4 bears 1.9 before it gives way, more than twice that weight. (1e5
    /// costs five times as much, and a droplet of kappa = 1e-4 that pinches off a lobe crosses itself all the same.)
    pub const fn total_stiffness(self) -> f64 {
        match self {
            Self::Way => 1e4,
            Self::Places => 4e4,
        }
    }
}

/// Length of an edge, in units of l0, at which the tension must bear that weight. With 8 the rule ends at Gamma = 0.031 for kappa = 1/pi,
/// and of 60 droplets at 0.0316 the tail of 14, drawn back over an obstacle, crossed itself; at 0.1 none of 60 did.
const LONG: f64 = 3.0;

/// Shortest way along the ring between two parts that can touch, in units of delta; a hairpin of that width has pi/2.
pub(super) const WAY: f64 = 3.0;

/// Places along a ring of `n` vertices at rest that lie within `pi delta`: the loop between them could not hold one vertex.
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

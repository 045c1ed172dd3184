//! Lists of what is near a droplet, and for how long they are valid.
//!
//! Contact, near-wall drag, self-contact and the soft particle have a reach, and need only what is nearer. Each keeps a
//! list of what is within `reach + skin`. As long as nothing has moved further than `skin`, the list contains
//! everything within `reach`. So a step costs only one subtraction of the distance travelled. The list is made again
//! when the skin is used up, or when the origin of the coordinates of its items has moved.
//!
//! Items that are listed but out of reach add exact zeros, so no result depends on when a list was made. Where an owner
//! measures something else when it makes its list, that is part of the owner's saved state.

use crate::physics::walls::wall::{Obstacle, Walls};

/// No obstacles are listed for a box larger than this, in sigma. A ring that has burst would list the whole scene.
const LARGEST: f64 = 1e3;

/// How far things may move before a list of what is near them is made again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Skin {
    pub(crate) width: f64,
    /// The part of the width that is left.
    pub(crate) left: f64,
}

impl Skin {
    /// Notes that nothing moved further than `distance`. True if the list must be made again.
    #[inline(always)]
    pub(crate) fn moved(&mut self, distance: f64) -> bool {
        self.left -= distance;
        // Negated, so that a NaN too leads to a new list.
        !(self.left >= 0.0)
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Neighbours<T> {
    /// What was near when the list was made, in coordinates relative to `origin`.
    pub(crate) items: Vec<T>,
    pub(crate) skin: Skin,
    origin: [f64; 2],
}

impl<T> Neighbours<T> {
    pub(crate) const fn new(skin: f64) -> Self {
        Self { items: Vec::new(), skin: Skin { width: skin, left: f64::NEG_INFINITY }, origin: [f64::NAN; 2] }
    }

    /// Notes that nothing moved further than `distance`, and the present origin. True if the list must be made again.
    #[inline(always)]
    pub(crate) fn moved(&mut self, distance: f64, origin: [f64; 2]) -> bool {
        self.skin.moved(distance) || self.origin != origin
    }

    /// Empties the list and restores the skin.
    pub(crate) fn renew(&mut self, origin: [f64; 2]) {
        self.items.clear();
        self.skin.left = self.skin.width;
        self.origin = origin;
    }
}

/// The obstacles whose skeletons may come within `far` of the box `[x_min, x_max, y_min, y_max]`, in the order of their
/// ids. Box and obstacles are in coordinates relative to `origin`.
pub(crate) fn obstacles_near<W: Walls>(walls: &W, origin: [f64; 2], bounds: [f64; 4], far: f64) -> Vec<W::Obstacle> {
    let [x0, x1, y0, y1] = bounds;
    let mut near = Vec::new();
    if (x1 - x0) + (y1 - y0) < LARGEST {
        walls.for_each_near(origin, [x0 - far, x1 + far, y0 - far, y1 + far], |obstacle| near.push(obstacle));
        near.sort_by_key(Obstacle::id);
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_holds_until_its_skin_is_used_up_or_the_origin_moves() {
        let mut near = Neighbours::<()>::new(0.3);
        assert!(near.moved(0.0, [4.0, 0.0]), "it is yet to be made");
        near.renew([4.0, 0.0]);
        assert!(!near.moved(0.125, [4.0, 0.0]) && !near.moved(0.125, [4.0, 0.0]));
        assert!(near.clone().moved(0.0, [8.0, 0.0]));
        assert!(near.clone().moved(f64::NAN, [4.0, 0.0]));
        assert!(near.moved(0.125, [4.0, 0.0]));
    }
}

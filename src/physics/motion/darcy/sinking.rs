//! Steps of a liquid droplet for the [descent](crate::physics::motion::descent) to its equilibrium. It has no inertia
//! anyway, so they are steps of backward Euler, without respacing, of whatever length the descent asks for.

use crate::physics::motion::darcy::DarcyMotion;
use crate::physics::motion::descent::{Equilibrium, Sinking};
use crate::physics::walls::wall::Walls;

/// Changes of a shape below this end a step, in sigma.
pub(super) const PRECISION: f64 = 1e-7;

impl<W: Walls> Sinking for DarcyMotion<W> {
    fn sink(&mut self, h: f64) -> Option<f64> {
        self.shapes.follow();
        (self.course.known, self.course.spaces) = (0, false);
        self.attempt(h).ok()?;
        let [now, before, _] = &self.shapes.last;
        // A droplet that breaks rests nowhere.
        Some(if self.course.pinched.is_none() { now.largest_distance(before) } else { f64::NAN })
    }

    fn here(&self) -> Equilibrium {
        let ([x, y], energy) = (self.readings[1].place, self.readings[1].potential);
        Equilibrium { x, y, energy }
    }
}

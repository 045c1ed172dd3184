//! What implicit steps of any length need of a soft particle. Here its velocity is that of the time of its place.

use crate::parameters::MASS;
use crate::physics::point::radau::{self, Acceleration, Phase};
use crate::physics::point::{NEAREST, SKIN, SoftMotion};
use crate::physics::walls::wall::{Obstacle, Walls};

impl<W: Walls> SoftMotion<W> {
    /// Sets the velocity to zero.
    pub(in crate::physics) fn halt(&mut self) {
        self.velocity = [0.0; 2];
    }

    /// Place, relative to the origin, and velocity.
    pub(in crate::physics) fn phase(&self) -> Phase {
        [self.position, self.velocity]
    }

    /// Makes the list of near walls again, if it does not hold for a way this long.
    pub(in crate::physics) fn list_within(&mut self, way: f64) {
        if self.near.skin.left < way {
            self.list_near();
        }
    }

    /// Where a step of length `h` would end, and its estimated error, in sigma; `None` if it is not solved.
    pub(in crate::physics) fn step(&self, h: f64, precision: f64) -> Option<(Phase, f64)> {
        radau::step(self.phase(), h, precision, |phase| self.acceleration(phase))
    }

    /// Goes to the end of a step, which is `moved` away.
    pub(in crate::physics) fn go_to(&mut self, [place, velocity]: Phase, moved: f64) {
        (self.position, self.velocity) = (place, velocity);
        self.near.skin.left -= moved;
    }

    /// The distance that is left to the nearest listed wall that does not push yet.
    pub(in crate::physics) fn gap(&self) -> f64 {
        let ([x, y], far) = (self.position, self.far + SKIN);
        let depths = self.near.items.iter().filter_map(|wall| wall.touch_point(x, y, far).map(|(depth, _)| depth));
        let gaps = depths.map(|depth| far - depth - self.reach()).filter(|gap| *gap > 0.0);
        gaps.fold(SKIN, f64::min)
    }

    /// `F/M - lambda v`, and its derivatives.
    fn acceleration(&self, [place, velocity]: Phase) -> Acceleration {
        let (force, [xx, xy, yy]) = self.force_and_stiffness(place);
        let (rate, slope) =
            if self.effects.b0 > 0.0 { self.drag_and_slope(place) } else { (self.effects.far_rate, [0.0; 2]) };
        let value = [0, 1].map(|k| force[k] / MASS - rate * velocity[k]);
        let stiffness = [[xx, xy], [xy, yy]];
        let by_place = [0, 1].map(|k| [0, 1].map(|l| -stiffness[k][l] / MASS - velocity[k] * slope[l]));
        Acceleration { value, by_place, rate }
    }

    /// The damping rate and its gradient: `d lambda/dd` times the normal of the nearest wall.
    fn drag_and_slope(&self, at: [f64; 2]) -> (f64, [f64; 2]) {
        let (effects, (distance, normal)) = (&self.effects, self.nearest_wall(at));
        let drag = self.near_wall_drag(distance);
        let slope = if distance > NEAREST { -effects.far_rate * effects.alpha * drag / distance } else { 0.0 };
        (effects.far_rate * (1.0 + drag), normal.map(|n| slope * n))
    }
}

//! The narrow place between two walls, and the contour along which a droplet touches them.
//!
//! The walls are mirror images of each other in the axis y = 0. The contour of the upper one lies `R = r + delta/2`
//! from its skeleton, with the radius r of the disc or of the tip: there an outline touches. It is an arc round the
//! point (0, c) with `c = gap/2 + r`, and at a wedge of angle a two faces that are tangent to the arc.
//!
//! A place on the contour is a number u. On the arc it is the angle t from the throat, `(R sin t, c - R cos t)`; on a
//! face it is `+-(a + s)` at the distance s from the end of the arc. The tangent has the angle t there.

use crate::parameters::{Model, Point, Scene};
use std::f64::consts::PI;

/// A throat between two walls, all lengths in sigma.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Throat {
    /// c, how far from the axis the centre of the arc lies.
    centre: f64,
    /// R, the radius of the arc.
    reach: f64,
    /// The arc goes from -arc to arc, in radians.
    arc: f64,
    /// Whether a face begins at either end of the arc; a disc has none.
    faces: bool,
}

/// A place on the contour, with the integrals from the throat up to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    /// x and y.
    pub(super) at: [f64; 2],
    /// Angle of the tangent.
    pub(super) angle: f64,
    /// Length of the contour.
    pub(super) way: f64,
    /// Integral of y dx.
    pub(super) area: f64,
    /// Integral of x y dx.
    pub(super) moment: f64,
}

impl Throat {
    /// The orifice of width `w` between wedges whose faces rise by `angle` degrees from the axis, with tips of
    /// radius `tip_radius`, for an outline that touches walls at `delta/2`.
    pub fn channel(w: f64, angle: f64, tip_radius: f64, delta: f64) -> Self {
        let reach = tip_radius + 0.5 * delta;
        Self { centre: 0.5 * w + tip_radius, reach, arc: angle.to_radians(), faces: true }
    }

    /// The gap of width `w_ob` between two discs of diameter `sigma_ob` that lie side by side across gravity.
    pub fn discs(w_ob: f64, sigma_ob: f64, delta: f64) -> Self {
        let radius = 0.5 * sigma_ob;
        Self { centre: 0.5 * w_ob + radius, reach: radius + 0.5 * delta, arc: PI, faces: false }
    }

    /// The throat of a grid point: the orifice of its channel, or the narrowest gap of its array. `None` for plates,
    /// for single discs, and for the soft particle, which has no line tension.
    pub fn of(point: &Point) -> Option<Self> {
        match (&point.model, &point.scene) {
            (Model::Deformable(ring), Scene::Channel(channel)) => {
                Some(Self::channel(channel.w, channel.angle, channel.tip_radius, ring.delta))
            }
            (Model::Deformable(ring), Scene::Obstacles(field)) => {
                Some(Self::discs(field.w_ob, field.sigma_ob, ring.delta))
            }
            _ => None,
        }
    }

    /// The room between the two contours, the gap less delta.
    pub fn room(&self) -> f64 {
        2.0 * (self.centre - self.reach)
    }

    /// The largest length of the throat's arc, c + R.
    pub(super) fn size(&self) -> f64 {
        self.centre + self.reach
    }

    /// Where the centre of a circle of this radius first touches both walls on its way along x, and at which place of
    /// the contour. `None` if it passes without touching.
    pub(super) fn first_touch(&self, radius: f64) -> Option<[f64; 2]> {
        let far = self.reach + radius;
        if self.centre >= far {
            return None;
        }
        let on_arc = -libm::acos(self.centre / far);
        if !self.faces || on_arc >= -self.arc {
            return Some([far * libm::sin(on_arc), on_arc]);
        }
        let (sin, cos) = libm::sincos(self.arc);
        let along = (far * cos - self.centre) / sin;
        Some([-far * sin - along * cos, -self.arc - along])
    }

    /// Whether the contour has a place of this number.
    pub(super) fn has(&self, place: f64) -> bool {
        self.faces || place.abs() <= self.arc
    }

    /// The place of number u.
    pub(super) fn mark(&self, u: f64) -> Mark {
        let (c, r) = (self.centre, self.reach);
        let t = u.clamp(-self.arc, self.arc);
        let (sin, cos) = libm::sincos(t);
        let at = [r * sin, c - r * cos];
        let area = c * r * sin - 0.5 * r * r * (t + sin * cos);
        let moment = 0.5 * c * r * r * sin * sin + r * r * r * (cos * cos * cos - 1.0) / 3.0;
        let on_arc = Mark { at, angle: t, way: r * t, area, moment };
        on_arc.further(u - t)
    }
}

impl Mark {
    /// The place that lies further along the tangent by `step`.
    fn further(self, step: f64) -> Self {
        let ([x, y], (sin, cos)) = (self.at, libm::sincos(self.angle));
        let (dx, dy) = (step * cos, step * sin);
        Self {
            at: [x + dx, y + dy],
            way: self.way + step,
            area: self.area + dx * (y + 0.5 * dy),
            moment: self.moment + dx * (x * y + 0.5 * (x * dy + y * dx) + dx * dy / 3.0),
            ..self
        }
    }

    /// The place seen in a mirror that stands at x = 0; its integrals are left as they are.
    pub(super) fn mirrored(self) -> Self {
        Self { at: [-self.at[0], self.at[1]], angle: -self.angle, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::simd::Instructions;
    use crate::physics::walls::wall::{Obstacle, Walls};
    use crate::physics::walls::wedge::ChannelWalls;
    use fearless_simd::{f64x8, prelude::*};

    const DELTA: f64 = 0.02;

    fn throats() -> [Throat; 4] {
        [
            Throat::channel(0.7, 45.0, 0.0, DELTA),
            Throat::channel(0.3, 20.0, 0.4, DELTA),
            Throat::channel(0.9, 80.0, 0.05, DELTA),
            Throat::discs(0.4, 0.3, DELTA),
        ]
    }

    #[test]
    fn the_contour_lies_half_of_delta_from_the_walls_that_droplets_meet() {
        fn distance<S: Instructions>(simd: S, walls: &ChannelWalls, [x, y]: [f64; 2]) -> f64 {
            let mut least = f64::INFINITY;
            walls.for_each_near([0.0, 0.0], [-9.0, 9.0, -9.0, 9.0], |wedge| {
                let [x, y] = [x, y].map(|place| f64x8::splat(simd, place));
                least = least.min(wedge.distance_to(simd, x, y).as_slice()[0] - walls.surface());
            });
            least
        }
        for (w, angle, tip) in [(0.7, 45.0, 0.0), (0.3, 20.0, 0.4), (0.9, 80.0, 0.05)] {
            let (throat, walls) = (Throat::channel(w, angle, tip, DELTA), ChannelWalls::new(w, angle, tip));
            for k in -40..=40 {
                let at = throat.mark(0.05 * f64::from(k)).at;
                let away = distance(fearless_simd::Fallback::new(), &walls, at);
                assert!((away - 0.5 * DELTA).abs() < 1e-14, "{w} {angle} {k}: {away}");
            }
            assert!((throat.room() - (w - DELTA)).abs() < 1e-15);
        }
    }

    #[test]
    fn tangent_length_and_integrals_are_those_of_the_contour() {
        for throat in throats() {
            for k in -30..30 {
                let [a, b] = [0.05, 0.0501].map(|step| throat.mark(0.05 * f64::from(k) + step));
                let (dx, dy) = (b.at[0] - a.at[0], b.at[1] - a.at[1]);
                let [x, y] = [0, 1].map(|axis| 0.5 * (a.at[axis] + b.at[axis]));
                assert!((b.way - a.way - (dx * dx + dy * dy).sqrt()).abs() < 1e-12);
                assert!((b.area - a.area - y * dx).abs() < 1e-12 && (b.moment - a.moment - x * y * dx).abs() < 1e-12);
                assert!((libm::atan2(dy, dx) - 0.5 * (a.angle + b.angle)).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_circle_touches_first_where_its_distance_from_the_contour_is_its_radius() {
        for throat in throats() {
            let [h, place] = throat.first_touch(0.5).expect("each is narrower than the circle");
            let distance = |u: f64| {
                let at = throat.mark(u).at;
                libm::hypot(at[0] - h, at[1])
            };
            assert!((distance(place) - 0.5).abs() < 1e-14);
            assert!((-60..=60).all(|k| distance(0.05 * f64::from(k)) > 0.5 - 1e-14));
        }
        assert_eq!(Throat::discs(1.1, 0.3, DELTA).first_touch(0.5), None);
    }
}

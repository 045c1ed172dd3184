//! A free surface of the droplet, from a wall to the axis: an arc of the Young-Laplace equation.
//!
//! The pressure inside over the tension is `k(x) = p + m x`, and it is the curvature of the surface. The surface leaves
//! the wall along its tangent, because a film wets the wall, and meets the axis at a right angle. With the angle
//! q that is left to turn, 0 on the axis and `q_c = t + pi/2` on the wall, the equation has the first integral
//!
//! ```text
//! k(q)^2 = k_a^2 - 4 m sin^2(q/2),      ds = dq/k,   dx = -sin q ds,   dy = cos q ds
//! ```
//!
//! so that `x = x_c + (k - k_c)/m` needs no integral, and height, length, area and moment are integrals over q. A
//! surface that is nearly flat on the axis has `k ~ sqrt(k_a^2 + |m| q^2)` there with a small k_a. The substitution
//! `q = b sinh v` with `b ~ k_a/sqrt(|m|)` makes the integrands smooth, and Gauss' rule converges geometrically.

use crate::study::threshold::quadrature::Rule;
use crate::study::threshold::throat::Mark;
use std::f64::consts::FRAC_PI_2;

/// The upper half of a surface that closes the droplet towards +x.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Where it leaves the wall.
    wall: [f64; 2],
    /// The angle q_c that it turns from there to the axis.
    turn: f64,
    /// The rise m of the pressure over the tension along x.
    slope: f64,
    /// Its curvature k_c on the wall.
    at_wall: f64,
    /// Its curvature k_a on the axis.
    at_axis: f64,
}

/// Integrals over a surface.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cap {
    /// How far the surface rises from the axis to its end; the right one ends on the wall.
    pub(super) height: f64,
    /// Length.
    pub(super) length: f64,
    /// Integral of y dx from the wall to the axis.
    pub(super) area: f64,
    /// Integral of x y dx.
    pub(super) moment: f64,
    /// x on the axis.
    pub(super) apex: f64,
}

impl Surface {
    /// The surface that leaves the wall at `mark` with this curvature; `None` if it does not come to the axis.
    pub(super) fn from_wall(mark: &Mark, at_wall: f64, slope: f64) -> Option<Self> {
        let squared = at_wall * at_wall + 4.0 * slope * half_sine_squared(mark.angle + FRAC_PI_2);
        (at_wall > 0.0 && squared > 0.0).then(|| Self::between(mark, at_wall, squared.sqrt(), slope))
    }

    /// The surface that leaves the wall at `mark` and has this curvature on the axis; `None` if there is none.
    pub(super) fn from_axis(mark: &Mark, at_axis: f64, slope: f64) -> Option<Self> {
        let squared = at_axis * at_axis - 4.0 * slope * half_sine_squared(mark.angle + FRAC_PI_2);
        (at_axis > 0.0 && squared > 0.0).then(|| Self::between(mark, squared.sqrt(), at_axis, slope))
    }

    fn between(mark: &Mark, at_wall: f64, at_axis: f64, slope: f64) -> Self {
        Self { wall: mark.at, turn: mark.angle + FRAC_PI_2, slope, at_wall, at_axis }
    }

    /// Its curvature on the wall.
    pub(super) fn at_wall(&self) -> f64 {
        self.at_wall
    }

    /// The curvature k and x at the angle q.
    fn at(&self, angle: f64) -> Option<[f64; 2]> {
        let s = half_sine_squared(angle);
        let squared = self.at_axis * self.at_axis - 4.0 * self.slope * s;
        (squared > 0.0).then(|| {
            let k = squared.sqrt();
            [k, self.wall[0] + 4.0 * (half_sine_squared(self.turn) - s) / (k + self.at_wall)]
        })
    }

    /// Its integrals; `None` if the curvature changes sign on the way.
    pub(super) fn cap(&self, rule: &Rule) -> Option<Cap> {
        let mut cap = Cap { apex: self.at(0.0)?[1], ..Cap::default() };
        self.walk([0.0, self.turn], rule, |[k, x, angle], weight| {
            let (way, rise) = (weight / k, weight * libm::cos(angle) / k);
            cap.length += way;
            cap.height += rise;
            cap.area += x * rise;
            cap.moment += 0.5 * x * x * rise;
        })?;
        // Integrals of y dx by parts: y vanishes on the axis.
        let [x, y] = self.wall;
        cap.area -= x * y;
        cap.moment -= 0.5 * x * x * y;
        Some(cap)
    }

    /// Points of the surface from the wall, which is left out, to the axis, at `count` even steps of the angle.
    pub(super) fn points(&self, rule: &Rule, count: usize) -> Option<Vec<[f64; 2]>> {
        let (mut y, mut points) = (0.0, Vec::with_capacity(count));
        for step in 0..count {
            let [from, to] = [step, step + 1].map(|k| self.turn * k as f64 / count as f64);
            points.push([self.at(from)?[1], y]);
            self.walk([from, to], rule, |[k, _, angle], weight| y += weight * libm::cos(angle) / k)?;
        }
        points.reverse();
        Some(points)
    }

    /// Visits the nodes of the rule between two angles, with k, x, the angle, and the weight.
    fn walk(&self, ends: [f64; 2], rule: &Rule, mut visit: impl FnMut([f64; 3], f64)) -> Option<()> {
        let apex = self.at_axis;
        // Where the slope does not flatten the surface, any b of the order of the angles will do.
        let b = if self.slope < 0.0 { apex / (0.0625 * apex * apex - self.slope).sqrt() } else { 4.0 };
        let [begin, end] = ends.map(|angle| libm::asinh(angle / b));
        for [node, weight] in rule.nodes() {
            let v = begin + (end - begin) * node;
            let angle = b * libm::sinh(v);
            let [k, x] = self.at(angle)?;
            visit([k, x, angle], weight * (end - begin) * b * libm::cosh(v));
        }
        Some(())
    }
}

fn half_sine_squared(angle: f64) -> f64 {
    let sine = libm::sin(0.5 * angle);
    sine * sine
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::threshold::throat::Throat;

    /// The same surface by small steps of `dq/ds = -k(x)` from the wall to the axis, of second order.
    fn by_steps(mark: &Mark, [pressure, slope]: [f64; 2]) -> Cap {
        let ([mut x, mut y], mut q, ds) = (mark.at, mark.angle + FRAC_PI_2, 2e-5);
        let mut cap = Cap { apex: mark.at[1], ..Cap::default() };
        while q > 0.0 {
            let half = q - 0.5 * ds * (pressure + slope * x);
            let (dx, dy) = (ds * libm::sin(half), -ds * libm::cos(half));
            q -= ds * (pressure + slope * (x + 0.5 * dx));
            cap.area += (y + 0.5 * dy) * dx;
            cap.moment += (x + 0.5 * dx) * (y + 0.5 * dy) * dx;
            (x, y, cap.length) = (x + dx, y + dy, cap.length + ds);
        }
        cap.height = mark.at[1] - y;
        Cap { apex: x, ..cap }
    }

    #[test]
    fn a_surface_is_that_of_the_young_laplace_equation() {
        let throat = Throat::channel(0.5, 45.0, 0.1, 0.02);
        for (place, pressure, slope) in [(-0.3, 2.5, 1.0), (0.5, 3.0, 0.0), (1.1, 2.6, -1.0), (1.6, 10.8, -8.2)] {
            let mut mark = throat.mark(place);
            let cap = |mark: &Mark| {
                let surface = Surface::from_wall(mark, pressure + slope * mark.at[0], slope).expect("there is one");
                surface.cap(&Rule::new(48)).expect("it is convex")
            };
            // Put where it comes down to the axis.
            mark.at[1] = cap(&mark).height;
            let exact = cap(&mark);
            let stepped = by_steps(&mark, [pressure, slope]);
            let both = |of: fn(&Cap) -> f64| (of(&exact), of(&stepped));
            let of: [fn(&Cap) -> f64; 5] =
                [|cap| cap.height, |cap| cap.length, |cap| cap.area, |cap| cap.moment, |cap| cap.apex];
            for (exact, stepped) in of.map(both) {
                assert!((exact - stepped).abs() < 1e-4, "{place}: {exact} {stepped}");
            }
        }
    }

    #[test]
    fn no_surface_leaves_a_wall_where_the_pressure_is_too_low() {
        let mark = Throat::channel(0.5, 45.0, 0.1, 0.02).mark(0.5);
        assert!(Surface::from_wall(&mark, -1.0, 0.0).is_none());
        assert!(Surface::from_wall(&mark, 1.0, -9.0).is_none());
    }

    #[test]
    fn a_surface_is_the_same_from_either_of_its_ends() {
        let mark = Throat::channel(0.5, 45.0, 0.1, 0.02).mark(0.5);
        for slope in [-3.0, 0.0, 2.0] {
            let one = Surface::from_wall(&mark, 5.0, slope).expect("there is one");
            let other = Surface::from_axis(&mark, one.at_axis, slope).expect("there is one");
            assert!((other.at_wall() - 5.0).abs() < 1e-14);
        }
    }
}

//! A free surface of the droplet, from a wall to the axis: an arc of the Young-Laplace equation.
//!
//! The pressure inside over the tension is `k(x) = p + m x`, and it is the curvature of the surface. The surface leaves
//! the wall along its tangent, because a film wets the wall, and meets the axis at a right angle. With the angle
//! q that is left to turn, 0 on the axis and `q_c = t + pi/2` on the wall, the equation has the first integral
//!
//! ```text
//! k(q)^2 = k_c^2 + 4 m (sin^2(q_c/2) - sin^2(q/2)),      ds = dq/k,   dx = -sin q ds,   dy = cos q ds
//! ```
//!
//! so that `x = x_c + (k - k_c)/m` needs no integral, and height, length, area and moment are integrals over q. A
//! surface that is nearly flat on the axis has `k ~ sqrt(k_a^2 + |m| q^2)` there with a small k_a. The substitution
//! `q = b sinh v` with `b ~ k_a/sqrt(|m|)` makes the integrands smooth, and Gauss' rule converges geometrically.

use crate::study::threshold::quadrature::Rule;
use crate::study::threshold::throat::Mark;
use std::f64::consts::FRAC_PI_2;

/// The pressure over the tension, linear along x.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    /// At x = 0, in 1/sigma.
    pub(super) pressure: f64,
    /// Its rise along x, in 1/sigma^2.
    pub(super) slope: f64,
}

impl Load {
    /// As seen in a mirror that stands at x = 0.
    pub(super) fn mirrored(self) -> Self {
        Self { slope: -self.slope, ..self }
    }
}

/// Integrals over the upper half of a surface that closes the droplet towards +x.
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

/// What the first integral needs: x and k at the wall, `sin^2(q_c/2)`, and the pressure.
struct Surface {
    x: f64,
    curvature: f64,
    turn: f64,
    slope: f64,
}

impl Surface {
    /// The curvature k and x at the angle q; `None` where there is no such surface.
    fn at(&self, angle: f64) -> Option<[f64; 2]> {
        let half = libm::sin(0.5 * angle);
        let left = self.turn - half * half;
        let squared = self.curvature * self.curvature + 4.0 * self.slope * left;
        (squared > 0.0).then(|| {
            let k = squared.sqrt();
            [k, self.x + 4.0 * left / (k + self.curvature)]
        })
    }
}

/// The surface that leaves the wall at `mark` towards +x; `None` if none does so under this load.
pub(super) fn cap(mark: &Mark, load: Load, rule: &Rule) -> Option<Cap> {
    let (begin, end) = (mark.angle + FRAC_PI_2, mark.at);
    let mut cap = Cap::default();
    walk(mark, load, [0.0, begin], rule, |[k, x, angle], weight| {
        let (way, rise) = (weight / k, weight * libm::cos(angle) / k);
        cap.length += way;
        cap.height += rise;
        cap.area += x * rise;
        cap.moment += 0.5 * x * x * rise;
    })?;
    // Integrals of y dx by parts: y vanishes on the axis.
    cap.area -= end[0] * end[1];
    cap.moment -= 0.5 * end[0] * end[0] * end[1];
    cap.apex = surface(mark, load)?.at(0.0)?[1];
    Some(cap)
}

/// Points of the surface from the wall, which is left out, to the axis, at `count` even steps of the angle.
pub(super) fn points(mark: &Mark, load: Load, rule: &Rule, count: usize) -> Option<Vec<[f64; 2]>> {
    let (surface, begin) = (surface(mark, load)?, mark.angle + FRAC_PI_2);
    let (mut y, mut points) = (0.0, Vec::with_capacity(count));
    for step in 0..count {
        let [from, to] = [step, step + 1].map(|k| begin * k as f64 / count as f64);
        points.push([surface.at(from)?[1], y]);
        walk(mark, load, [from, to], rule, |[k, _, angle], weight| y += weight * libm::cos(angle) / k)?;
    }
    points.reverse();
    Some(points)
}

fn surface(mark: &Mark, load: Load) -> Option<Surface> {
    let (x, half) = (mark.at[0], libm::sin(0.5 * (mark.angle + FRAC_PI_2)));
    let curvature = load.pressure + load.slope * x;
    (curvature > 0.0).then_some(Surface { x, curvature, turn: half * half, slope: load.slope })
}

/// Visits the nodes of the rule between two angles, with k, x, the angle, and the weight.
fn walk(
    mark: &Mark,
    load: Load,
    [from, to]: [f64; 2],
    rule: &Rule,
    mut visit: impl FnMut([f64; 3], f64),
) -> Option<()> {
    let surface = surface(mark, load)?;
    let [apex, _] = surface.at(0.0)?;
    // Without a slope any b of the order of the angles will do.
    let b = if load.slope < 0.0 { apex / (0.0625 * apex * apex - load.slope).sqrt() } else { 4.0 };
    let [begin, end] = [from, to].map(|angle| libm::asinh(angle / b));
    for [node, weight] in rule.nodes() {
        let v = begin + (end - begin) * node;
        let angle = b * libm::sinh(v);
        let [k, x] = surface.at(angle)?;
        visit([k, x, angle], weight * (end - begin) * b * libm::cosh(v));
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::threshold::throat::Throat;

    /// The same surface by small steps of `dq/ds = -k(x)` from the wall to the axis, of second order.
    fn by_steps(mark: &Mark, load: Load) -> Cap {
        let ([mut x, mut y], mut q, ds) = (mark.at, mark.angle + FRAC_PI_2, 2e-5);
        let mut cap = Cap { apex: mark.at[1], ..Cap::default() };
        while q > 0.0 {
            let half = q - 0.5 * ds * (load.pressure + load.slope * x);
            let (dx, dy) = (ds * libm::sin(half), -ds * libm::cos(half));
            q -= ds * (load.pressure + load.slope * (x + 0.5 * dx));
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
        for (place, pressure, slope) in [(-0.3, 2.5, 1.0), (0.5, 3.0, 0.0), (1.1, 2.0, -1.0), (1.6, 7.0, -8.2)] {
            let (mark, load) = (throat.mark(place), Load { pressure, slope });
            let (exact, stepped) = (cap(&mark, load, &Rule::new(48)).expect("there is one"), by_steps(&mark, load));
            let both = |of: fn(&Cap) -> f64| (of(&exact), of(&stepped));
            let of: [fn(&Cap) -> f64; 5] =
                [|cap| cap.height, |cap| cap.length, |cap| cap.area, |cap| cap.moment, |cap| cap.apex];
            for (exact, stepped) in of.map(both) {
                assert!((exact - stepped).abs() < 1e-4, "{place}: {exact} {stepped}");
            }
        }
    }

    #[test]
    fn no_surface_leaves_a_wall_that_presses_against_the_droplet_too_little() {
        let mark = Throat::channel(0.5, 45.0, 0.1, 0.02).mark(0.5);
        let load = |pressure, slope| Load { pressure, slope };
        assert!(cap(&mark, load(-1.0, 0.0), &Rule::new(16)).is_none());
        assert!(cap(&mark, load(1.0, -9.0), &Rule::new(16)).is_none());
    }
}

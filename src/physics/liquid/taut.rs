//! An edge that is pressed against a round wall: it bends round the wall like a taut string.
//!
//! A polygon whose straight edges touch a sharp tip is wrong by first order in the length of an edge: it cuts off the
//! kink of the interface, and it is held back whenever a vertex must pass the tip. So an edge whose chord would enter a
//! wall follows the shortest way round it: a tangent from its first vertex, an arc, and a tangent to its second vertex.
//!
//! With the vertices at distances `p`, `q` from the centre of the wall, seen from there under the angle `g`, and the
//! wall of radius `r`:
//!
//! ```text
//! t1 = sqrt(p^2 - r^2),  t2 = sqrt(q^2 - r^2),  psi = g - atan2(t1, r) - atan2(t2, r)
//! length of the way      L = t1 + t2 + r psi
//! area behind the chord  A = (r (t1 + t2) + r^2 psi - p x q)/2      (the liquid does not fill it)
//! ```
//!
//! The string touches where `psi > 0`. The wall gives way by an indentation `s` of energy `k_w s^2/2`, and `s` is that
//! of least energy: `k_w s = (Gamma + P r) psi + P (t1 + t2)/2` with the radius `r = R - s` and the pressure P of the
//! liquid at the edge. Where the wall gives way so far that the edge stays straight, the energy is `k_w o^2/2` with the
//! overlap `o` of the chord. Both pieces join smoothly.

use crate::physics::liquid::jet::{Differentiable, Jet, Slope};
use std::f64::consts::PI;

/// The variables of a taut edge: its two vertices and the indentation.
const VARIABLES: usize = 5;

/// An edge whose chord would enter a round wall.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Taut {
    /// Number of the edge.
    pub(crate) edge: usize,
    /// Number of the obstacle.
    pub(crate) obstacle: u32,
    /// The two vertices relative to the centre of the wall.
    pub(crate) ends: [[f64; 2]; 2],
    /// Centre of the wall, from the origin of the droplet.
    pub(crate) centre: [f64; 2],
    /// Radius R of the wall that has not given way.
    radius: f64,
    /// How deep the chord is inside that wall.
    overlap: f64,
    /// Distances of the vertices from the centre.
    far: [f64; 2],
    /// The angle under which the edge is seen from the centre.
    angle: f64,
    /// The indentation s.
    pub(crate) indentation: f64,
}

/// What a taut edge adds to the energy: derivatives are with respect to x and y of its first vertex, then of its
/// second.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TautForce {
    pub(crate) energy: f64,
    /// Length above that of the chord.
    pub(crate) length: f64,
    pub(crate) gradient: [f64; 4],
    /// Derivatives of the area behind the chord, which counts as a negative number.
    pub(crate) area_gradient: [f64; 4],
    /// Derivatives of the x moment of that area about the centroid.
    pub(crate) moment_gradient: [f64; 4],
}

/// Pressure and weight of the liquid, and the stiffnesses.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Load {
    pub(crate) gamma: f64,
    pub(crate) k_w: f64,
    /// Pressure at the height of the centroid.
    pub(crate) pressure: f64,
    /// Weight per area, `M/a`.
    pub(crate) weight: f64,
    /// x of the centroid.
    pub(crate) centroid: f64,
}

impl Load {
    /// Pressure at the place x.
    fn at(&self, x: f64) -> f64 {
        self.pressure + self.weight * (x - self.centroid)
    }
}

impl Taut {
    /// The edge of number `edge` from `a` to `b`, if its chord enters the wall of `radius` around `centre`.
    ///
    /// A wall far behind the chord touches the other side of the droplet: chords whose distance from the centre is
    /// less than minus half their length are left out.
    pub(crate) fn of(
        edge: usize,
        obstacle: u32,
        a: [f64; 2],
        b: [f64; 2],
        centre: [f64; 2],
        radius: f64,
    ) -> Option<Self> {
        let [p, q] = [a, b].map(|end| [end[0] - centre[0], end[1] - centre[1]]);
        let (ex, ey) = (q[0] - p[0], q[1] - p[1]);
        let length = (ex * ex + ey * ey).sqrt();
        let along = -(p[0] * ex + p[1] * ey);
        let cross = q[0] * p[1] - q[1] * p[0];
        let distance = cross / length;
        if along <= 0.0 || along >= length * length || distance >= radius || distance < -0.5 * length {
            return None;
        }
        let mut angle = libm::atan2(cross, p[0] * q[0] + p[1] * q[1]);
        if angle < -0.5 {
            angle += 2.0 * PI;
        }
        let far = [p, q].map(|v| (v[0] * v[0] + v[1] * v[1]).sqrt());
        let overlap = radius - distance;
        Some(Self { edge, obstacle, ends: [p, q], centre, radius, overlap, far, angle, indentation: 0.0 })
    }

    /// x of the middle of the chord, from the origin of the droplet.
    pub(crate) fn middle(&self) -> f64 {
        self.centre[0] + 0.5 * (self.ends[0][0] + self.ends[1][0])
    }

    /// t1, t2 and psi for a wall of radius `r`. A vertex inside it counts as lying on it.
    fn way(&self, r: f64) -> ([f64; 2], f64) {
        let t = self.far.map(|d| if d > r { ((d - r) * (d + r)).sqrt() } else { 0.0 });
        (t, self.angle - libm::atan2(t[0], r) - libm::atan2(t[1], r))
    }

    /// Whether the edge stays straight, because the wall gives way to it.
    pub(crate) fn is_straight(&self) -> bool {
        self.indentation >= self.overlap
    }

    /// Finds the indentation of least energy, by Newton's method between bounds.
    pub(crate) fn settle(&mut self, load: &Load) {
        let pressure = load.at(self.middle());
        let slope = |s: f64| {
            let r = self.radius - s;
            let (t, psi) = self.way(r);
            let inverse: f64 = t.iter().map(|t| if *t > 0.0 { 1.0 / t } else { 0.0 }).sum();
            let first = load.k_w * s - (load.gamma + pressure * r) * psi - 0.5 * pressure * (t[0] + t[1]);
            let second = load.k_w + (load.gamma + 0.5 * pressure * r) * inverse + pressure * psi;
            (first, second)
        };
        if slope(self.overlap).0 <= 0.0 {
            self.indentation = self.overlap;
            return;
        }
        let (mut low, mut high) = (0.0, self.overlap);
        let mut s = self.indentation.clamp(low, high);
        for _ in 0..60 {
            let (first, second) = slope(s);
            if first > 0.0 {
                high = s
            } else {
                low = s
            }
            let newton = s - first / second;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let moved = (next - s).abs();
            s = next;
            if moved < 1e-15 {
                break;
            }
        }
        self.indentation = s;
    }

    /// The area behind the chord, as a negative number.
    pub(crate) fn area(&self) -> f64 {
        if self.is_straight() {
            return 0.0;
        }
        let r = self.radius - self.indentation;
        let (t, psi) = self.way(r);
        let [p, q] = self.ends;
        -0.5 * (r * (t[0] + t[1]) + r * r * psi - (q[0] * p[1] - q[1] * p[0]))
    }

    /// The points where the string meets the wall and leaves it, relative to the centre; `None` if the edge is
    /// straight.
    pub(crate) fn touching(&self) -> Option<[[f64; 2]; 2]> {
        if self.is_straight() {
            return None;
        }
        let r = self.radius - self.indentation;
        let (t, _) = self.way(r);
        let on = |end: [f64; 2], far: f64, t: f64, side: f64| {
            let (along, across) = (r * r / (far * far), side * r * t / (far * far));
            [end[0] * along + end[1] * across, end[1] * along - end[0] * across]
        };
        Some([on(self.ends[0], self.far[0], t[0], 1.0), on(self.ends[1], self.far[1], t[1], -1.0)])
    }

    /// The angle psi over which the string touches the wall.
    pub(crate) fn turn(&self) -> f64 {
        if self.is_straight() { 0.0 } else { self.way(self.radius - self.indentation).1 }
    }

    /// Energy and first derivatives, for the indentation that [`settle`](Self::settle) has found.
    pub(crate) fn force(&self, load: &Load) -> TautForce {
        if self.is_straight() {
            let energy: Slope<4> = self.pressed(load);
            return TautForce { energy: energy.value, gradient: energy.gradient, ..TautForce::default() };
        }
        let Bend { energy, length, area, total, by_indentation } = self.bent::<Slope<VARIABLES>>(load);
        // The indentation follows the vertices, so it is eliminated.
        let follow: [f64; 4] = std::array::from_fn(|k| by_indentation.gradient[k] / by_indentation.gradient[4]);
        let moment = area * self.lever::<Slope<VARIABLES>>(load);
        let reduced =
            |slope: &Slope<VARIABLES>| std::array::from_fn(|k| slope.gradient[k] - follow[k] * slope.gradient[4]);
        TautForce {
            energy: energy.value,
            length: length.value,
            gradient: std::array::from_fn(|k| total.gradient[k]),
            area_gradient: reduced(&area),
            moment_gradient: reduced(&moment),
        }
    }

    /// Second derivatives at fixed pressure, by x and y of both vertices.
    pub(crate) fn stiffness(&self, load: &Load) -> [[f64; 4]; 4] {
        if self.is_straight() {
            return self.pressed::<Jet<4>>(load).hessian;
        }
        let total = self.bent::<Jet<VARIABLES>>(load).total.hessian;
        std::array::from_fn(|i| std::array::from_fn(|j| total[i][j] - total[i][4] / total[4][4] * total[4][j]))
    }

    /// x of the middle of the chord, from the centroid.
    #[inline(always)]
    fn lever<N: Differentiable>(&self, load: &Load) -> N {
        let [a, b] = [N::variable(self.ends[0][0], 0), N::variable(self.ends[1][0], 2)];
        (a + b) * 0.5 + N::constant(self.centre[0] - load.centroid)
    }

    #[inline(always)]
    fn bent<N: Differentiable>(&self, load: &Load) -> Bend<N> {
        let [p, q] = self.ends;
        let (ax, ay) = (N::variable(p[0], 0), N::variable(p[1], 1));
        let (bx, by) = (N::variable(q[0], 2), N::variable(q[1], 3));
        let s = N::variable(self.indentation, 4);
        let r = N::constant(self.radius) - s;
        let (ex, ey) = (bx - ax, by - ay);
        let chord = (ex * ex + ey * ey).sqrt();
        let cross = bx * ay - by * ax;
        let [t1, t2] = [ax * ax + ay * ay, bx * bx + by * by].map(|squared| {
            let left = squared - r * r;
            if left.value() > 1e-9 * r.value() * r.value() { left.sqrt() } else { N::constant(0.0) }
        });
        let mut angle = N::atan2(cross, ax * bx + ay * by);
        if angle.value() < -0.5 {
            angle = angle + N::constant(2.0 * PI);
        }
        let psi = angle - N::atan2(t1, r) - N::atan2(t2, r);
        let length = t1 + t2 + psi * r - chord;
        let area = ((t1 + t2) * r + psi * r * r - cross) * -0.5;
        let pressure = N::constant(load.pressure) + self.lever::<N>(load) * load.weight;
        let energy = length * load.gamma + s * s * (0.5 * load.k_w);
        let total = energy - area * pressure;
        let by_indentation = s * load.k_w - psi * load.gamma - pressure * (psi * r + (t1 + t2) * 0.5);
        Bend { energy, length, area, total, by_indentation }
    }

    /// The energy `k_w o^2/2` of a straight edge, `o = R - d` with the distance `d = (q x p)/l` of the chord.
    #[inline(always)]
    fn pressed<N: Differentiable>(&self, load: &Load) -> N {
        let [p, q] = self.ends;
        let (ax, ay) = (N::variable(p[0], 0), N::variable(p[1], 1));
        let (bx, by) = (N::variable(q[0], 2), N::variable(q[1], 3));
        let (ex, ey) = (bx - ax, by - ay);
        let (cross, squared) = (bx * ay - by * ax, ex * ex + ey * ey);
        let overlap = N::constant(self.radius) - cross * squared.sqrt().reciprocal();
        overlap * overlap * (0.5 * load.k_w)
    }
}

/// What a bent edge adds, with derivatives by both vertices and the indentation.
struct Bend<N> {
    energy: N,
    /// Length above that of the chord.
    length: N,
    /// The area behind the chord, as a negative number.
    area: N,
    /// The energy and the work against the pressure.
    total: N,
    /// The derivative of `total` by the indentation, which is zero where that is settled.
    by_indentation: N,
}

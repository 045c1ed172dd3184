//! A constriction between two infinite wedges, `|y| >= w/2 + |x| tan(angle)` ([C24] 2.3).
//!
//! A tip radius rounds the wedges. The skeleton is then a sharp wedge whose tip stands further from the axis by that
//! radius, so that the orifice keeps its width.
//!
//! For a point at (x, y) relative to the tip of a wedge that opens upwards, mirrored to the right face (x >= 0), with s
//! and c the sine and cosine of the angle:
//!
//! ```text
//! x c + y s <= 0:  the tip is nearest,   d = sqrt(x^2 + y^2),   n = (x, y)/d
//! otherwise:       the face is nearest,  d = x s - y c,         n = (s, -c)
//! ```
//!
//! The nearest point of an edge is the best of six candidates, see `Wedge::nearest`.

use crate::physics::walls::wall::{Edges, FACE_BETA, Obstacle, Touch, Walls};
use fearless_simd::{Fallback, f64x8, prelude::*};

/// The two wedges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelWalls {
    half_width: f64,
    tip_radius: f64,
    sin: f64,
    cos: f64,
}

impl ChannelWalls {
    /// An orifice of width `w` between wedges whose faces rise by `angle` degrees from the axis.
    pub fn new(w: f64, angle: f64, tip_radius: f64) -> Self {
        let (sin, cos) = libm::sincos(angle.to_radians());
        Self { half_width: 0.5 * w, tip_radius, sin, cos }
    }
}

impl Walls for ChannelWalls {
    type Obstacle = Wedge;

    fn surface(&self) -> f64 {
        self.tip_radius
    }

    fn for_each_near(&self, origin: [f64; 2], bounds: [f64; 4], mut visit: impl FnMut(Wedge)) {
        for (id, side) in [(0, 1.0), (1, -1.0)] {
            let y = side * (self.half_width + self.tip_radius) - origin[1];
            let wedge = Wedge { id, x: -origin[0], y, side, sin: self.sin, cos: self.cos };
            if wedge.meets(bounds) {
                visit(wedge);
            }
        }
    }
}

/// A sharp wedge with its tip at (x, y), opening towards `+y` (`side = 1`) or `-y` (`side = -1`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wedge {
    id: u32,
    x: f64,
    y: f64,
    side: f64,
    sin: f64,
    cos: f64,
}

/// Signed distance of eight points from a wedge, and the unit normals there.
struct Separation<S: Simd> {
    distance: f64x8<S>,
    nx: f64x8<S>,
    ny: f64x8<S>,
}

impl Wedge {
    /// Whether the wedge reaches into the box `[x_min, x_max, y_min, y_max]`. The deepest point of the box lies on its
    /// side towards the wedge, where that side is nearest to the line x = 0.
    fn meets(&self, [x0, x1, y0, y1]: [f64; 4]) -> bool {
        let off_axis = (x0 - self.x).max(self.x - x1).max(0.0);
        let deep = ((y0 - self.y) * self.side).max((y1 - self.y) * self.side);
        off_axis * self.sin <= deep * self.cos
    }

    /// The separation of points that are given relative to the tip of a wedge that opens upwards.
    #[inline(always)]
    fn separation<S: Simd>(&self, simd: S, rx: f64x8<S>, ry: f64x8<S>) -> Separation<S> {
        let zero = f64x8::splat(simd, 0.0);
        // Mirrored to the right face, which is then the nearer face.
        let mirrored = rx.abs();
        let along = mirrored * self.cos + ry * self.sin;
        let face = mirrored * self.sin - ry * self.cos;
        let tip = (rx * rx + ry * ry).max(f64x8::splat(simd, 1e-300)).sqrt();
        let at_tip = along.simd_le(zero);
        let sign = f64x8::splat(simd, 1.0).copysign(rx);
        Separation {
            distance: at_tip.select(tip, face),
            nx: at_tip.select(rx / tip, sign * self.sin),
            ny: at_tip.select(ry / tip, f64x8::splat(simd, -self.cos)),
        }
    }

    /// The point of each edge where `d(q) + beta (q - 1/2)^2` is smallest: that value, the normal there, and q.
    ///
    /// The function is convex. Its minimum lies at an end of the edge, or is the minimum of one of its pieces (right
    /// face, left face, tip), or lies at x = 0, where the nearer face changes. So it is the smallest of the values at
    /// these candidates.
    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, edges: Edges<S>, beta: f64) -> (Separation<S>, f64x8<S>) {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let (rx, ry) = (edges.x - self.x, (edges.y - self.y) * self.side);
        let (ex, ey) = (edges.ex, edges.ey * self.side);
        let tiny = f64x8::splat(simd, 1e-300);
        let squared = (ex * ex + ey * ey).max(tiny);
        let to_tip = -(rx * ex + ry * ey) / squared;
        let across = (rx * ey - ry * ex) * (rx * ey - ry * ex) / squared;
        let crosses = (ex * ex).simd_gt(tiny);
        let to_axis = clamp(simd, -rx / crosses.select(ex, one));
        // On a face the distance is linear in q.
        let lean = 0.5 / beta.max(1e-300);
        let on_right = clamp(simd, 0.5 - (ex * self.sin - ey * self.cos) * lean);
        let on_left = clamp(simd, 0.5 - (-ex * self.sin - ey * self.cos) * lean);
        // Near the tip it is a hyperbola, on which a few Newton steps lead from the vertex to the minimum.
        let mut at_tip = clamp(simd, to_tip);
        for _ in 0..3 {
            let away = at_tip - to_tip;
            let distance = (squared * away * away + across).max(tiny).sqrt();
            let slope = squared * away / distance + 2.0 * beta * (at_tip - 0.5);
            let curvature = squared * across / (distance * distance * distance) + 2.0 * beta;
            at_tip = clamp(simd, at_tip - slope / curvature.max(tiny));
        }
        let mut best_q = zero;
        let mut best = self.separation(simd, rx, ry);
        best.distance += 0.25 * beta;
        for q in [one, on_right, on_left, at_tip, to_axis] {
            let there = self.separation(simd, rx + q * ex, ry + q * ey);
            let distance = there.distance + beta * (q - 0.5) * (q - 0.5);
            let nearer = distance.simd_lt(best.distance);
            best_q = nearer.select(q, best_q);
            best = Separation {
                distance: nearer.select(distance, best.distance),
                nx: nearer.select(there.nx, best.nx),
                ny: nearer.select(there.ny, best.ny),
            };
        }
        (best, best_q)
    }
}

#[inline(always)]
fn clamp<S: Simd>(simd: S, q: f64x8<S>) -> f64x8<S> {
    q.max(f64x8::splat(simd, 0.0)).min(f64x8::splat(simd, 1.0))
}

impl Obstacle for Wedge {
    const BETA: f64 = FACE_BETA;

    fn id(&self) -> u32 {
        self.id
    }

    #[inline(always)]
    fn distance<S: Simd>(&self, simd: S, edges: Edges<S>) -> f64x8<S> {
        self.nearest(simd, edges, 0.0).0.distance
    }

    #[inline(always)]
    fn distance_to<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        self.separation(simd, x - self.x, (y - self.y) * self.side).distance
    }

    #[inline(always)]
    fn touch<S: Simd>(&self, simd: S, edges: Edges<S>, reach: f64) -> Option<Touch<S>> {
        let (nearest, q) = self.nearest(simd, edges, FACE_BETA);
        let overlap = (reach - nearest.distance).max(f64x8::splat(simd, 0.0));
        let touches = overlap.simd_gt(f64x8::splat(simd, 0.0)).any_true();
        touches.then(|| Touch { q, overlap, nx: nearest.nx, ny: nearest.ny * self.side })
    }

    fn touch_point(&self, x: f64, y: f64, reach: f64) -> Option<(f64, [f64; 2])> {
        let simd = Fallback::new();
        let splat = |v: f64| f64x8::splat(simd, v);
        let there = self.separation(simd, splat(x - self.x), splat((y - self.y) * self.side));
        let overlap = reach - there.distance.as_slice()[0];
        (overlap > 0.0).then(|| (overlap, [there.nx.as_slice()[0], there.ny.as_slice()[0] * self.side]))
    }

    #[inline(always)]
    fn curvature<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let (rx, ry) = (x - self.x, (y - self.y) * self.side);
        let zero = f64x8::splat(simd, 0.0);
        let at_tip = (rx.abs() * self.cos + ry * self.sin).simd_le(zero);
        at_tip.select(1.0 / (rx * rx + ry * ry).max(f64x8::splat(simd, 1e-300)).sqrt(), zero)
    }

    fn corner(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }

    fn inner_point(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERYWHERE: [f64; 4] = [-9.0, 9.0, -9.0, 9.0];

    fn distance(wedge: &Wedge, from: [f64; 2], to: [f64; 2]) -> f64 {
        let simd = Fallback::new();
        let splat = |v: f64| f64x8::splat(simd, v);
        let edges =
            Edges { x: splat(from[0]), y: splat(from[1]), ex: splat(to[0] - from[0]), ey: splat(to[1] - from[1]) };
        wedge.distance(simd, edges).as_slice()[0]
    }

    /// Signed distance of a point from the region above both faces, by the definition.
    fn by_definition(w: f64, angle: f64, p: [f64; 2]) -> f64 {
        let (sin, cos) = libm::sincos(angle.to_radians());
        let (x, y) = (p[0].abs(), p[1] - 0.5 * w);
        if x * cos + y * sin <= 0.0 { (x * x + y * y).sqrt() } else { x * sin - y * cos }
    }

    #[test]
    fn an_edge_is_as_near_as_its_nearest_point() {
        for angle in [30.0, 45.0, 80.0] {
            let walls = ChannelWalls::new(0.7, angle, 0.0);
            let mut wedges = Vec::new();
            walls.for_each_near([0.0, 0.0], EVERYWHERE, |wedge| wedges.push(wedge));
            for k in 0..400 {
                let t = f64::from(k);
                let from = [libm::sin(1.7 * t), 0.35 + libm::cos(2.3 * t)];
                let to = [from[0] + libm::sin(0.9 * t), from[1] + libm::cos(3.1 * t)];
                let sampled = (0..=4000)
                    .map(|i| f64::from(i) / 4000.0)
                    .map(|q| by_definition(0.7, angle, [0, 1].map(|c| from[c] + q * (to[c] - from[c]))))
                    .fold(f64::INFINITY, f64::min);
                let exact = distance(&wedges[0], from, to);
                assert!(exact <= sampled + 1e-12 && exact > sampled - 1e-3, "{angle} {k}: {exact} {sampled}");
                // The lower wedge is the mirror image.
                assert_eq!(exact, distance(&wedges[1], [from[0], -from[1]], [to[0], -to[1]]));
            }
        }
    }

    #[test]
    fn a_box_meets_a_wedge_if_one_of_its_points_lies_inside() {
        let walls = ChannelWalls::new(0.7, 40.0, 0.0);
        let mut met = 0;
        for k in 0..400 {
            let [x0, y0] = [3.0 * libm::sin(1.7 * f64::from(k)), 3.0 * libm::cos(2.3 * f64::from(k))];
            let bounds = [x0, x0 + 1.0, y0, y0 + 0.5];
            let mut upper = false;
            walls.for_each_near([0.0, 0.0], bounds, |wedge| upper |= wedge.id == 0);
            let inside = |i: i32| by_definition(0.7, 40.0, [x0 + f64::from(i) / 1000.0, y0 + 0.5]) <= 0.0;
            assert_eq!(upper, (0..=1000).any(inside), "{bounds:?}");
            met += i32::from(upper);
        }
        assert!(met > 50 && met < 350);
    }

    #[test]
    fn a_rounded_tip_keeps_the_width_of_the_orifice() {
        let walls = ChannelWalls::new(0.7, 45.0, 0.1);
        walls.for_each_near([0.0, 0.0], EVERYWHERE, |wedge| {
            let centre = distance(&wedge, [0.0, 0.0], [0.0, 0.0]) - walls.surface();
            assert!((centre - 0.35).abs() < 1e-15);
        });
    }
}

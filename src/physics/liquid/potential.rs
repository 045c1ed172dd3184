//! The energy of the droplet, its gradient, and its second derivatives.
//!
//! ```text
//! U = Gamma P + (K_a/2)(a - a0)^2 - M x_c + contacts
//! ```
//!
//! with the perimeter P, the area a and the centroid x_c of the outline: its edges are straight, or bent round walls
//! ([`taut`](crate::physics::liquid::taut)). With the pressure `p = -K_a (a - a0)` at the height of the centroid, that
//! at the place x is `p + (M/a)(x - x_c)`, which is hydrostatics. A vertex within `delta/2` of a wall is pushed off
//! with the energy `(k_w/2)(delta/2 - d)^2`. Strings touch the wall at a radius that is smaller by `MARGIN Gamma/k_w`,
//! so that a pressed vertex lies outside of it.

use crate::physics::liquid::curvature::Curvature;
use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::{Edges, Polygon, following, preceding};
use crate::physics::liquid::self_contact::{Pair, SelfContact, Touch};
use crate::physics::liquid::taut::{Load, Taut};
use crate::physics::walls::wall::{Obstacle, Walls};
use std::sync::Arc;

/// Room between the radius at which vertices touch and that of strings, in `Gamma/k_w`. At a sharp tip a vertex carries
/// at most twice the tension.
const MARGIN: f64 = 6.0;

/// How often pressure and indentations are made consistent. The wall is so stiff that each round is a thousand times
/// nearer.
const ROUNDS: usize = 6;

/// Area and centroid are consistent with the indentations when a round changes them by less than this: with K_a = 1e4
/// the pressure is then known to 1e-11.
const CONSISTENT: f64 = 1e-15;

/// What the energy of a droplet is made of.
#[derive(Debug)]
pub(crate) struct Potential<W: Walls> {
    pub(crate) walls: Arc<W>,
    /// Line tension Gamma.
    pub(crate) gamma: f64,
    /// Area stiffness K_a.
    pub(crate) k_a: f64,
    /// The area at rest, a0.
    pub(crate) rest: f64,
    /// The weight, M.
    pub(crate) weight: f64,
    /// Stiffness of a contact, k_w.
    pub(crate) k_w: f64,
    /// Distance from a skeleton within which a vertex touches.
    pub(crate) reach: f64,
    /// Contact of the droplet with itself, if that is on.
    pub(crate) folds: Option<SelfContact>,
}

/// Energy and derivatives at one shape. Vectors have x and y of each vertex in turn.
#[derive(Clone, Debug, Default)]
pub(crate) struct Evaluation {
    pub(crate) energy: f64,
    pub(crate) gradient: Vec<f64>,
    /// Second derivatives, without those of area and centroid squared; see [`Potential::differentiate_twice`].
    pub(crate) curvature: Curvature,
    pub(crate) area_gradient: Vec<f64>,
    pub(crate) x_gradient: Vec<f64>,
    pub(crate) y_gradient: Vec<f64>,
    pub(crate) area: f64,
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Of the outline, strings included.
    pub(crate) perimeter: f64,
    /// Deepest overlap with a wall.
    pub(crate) overlap: f64,
    pub(crate) edges: Edges,
    pub(crate) strings: Vec<Taut>,
    /// Where the droplet touches itself.
    pub(crate) touches: Vec<Touch>,
    /// Pressure and weight of the liquid.
    pub(crate) load: Load,
    /// Where a film of liquid is closing, if one is.
    pub(crate) closing: Option<[f64; 2]>,
    /// Numbers of the obstacles that push, in rising order.
    pub(crate) touched: Vec<u32>,
    /// Which contacts there are: strings and whether they are straight, vertices, and touching pairs.
    pub(crate) active: Vec<u32>,
}

impl<W: Walls> Potential<W> {
    /// Radius around a corner at which strings touch.
    fn string_radius(&self) -> f64 {
        self.reach - MARGIN * self.gamma / self.k_w
    }

    /// Evaluates the energy and its gradient at `shape`, which `nearby` covers.
    pub(crate) fn evaluate(&self, shape: &Polygon, nearby: &Nearby<W::Obstacle>, out: &mut Evaluation) {
        out.edges.measure(shape);
        for column in [&mut out.gradient, &mut out.area_gradient, &mut out.x_gradient, &mut out.y_gradient] {
            column.clear();
            column.resize(2 * shape.len(), 0.0);
        }
        out.touched.clear();
        out.active.clear();
        out.touches.clear();
        out.closing = None;
        out.overlap = 0.0;
        out.load = self.balance(shape, nearby, out);
        self.add_liquid(shape, out);
        self.add_strings(out);
        self.add_walls(shape, nearby, out);
        self.add_folds(shape, nearby, out);
        out.touched.sort_unstable();
        out.touched.dedup();
    }

    /// Finds the strings, and area, centroid and pressure that are consistent with their indentations.
    fn balance(&self, shape: &Polygon, nearby: &Nearby<W::Obstacle>, out: &mut Evaluation) -> Load {
        out.strings.clear();
        let (radius, n) = (self.string_radius(), shape.len());
        for near in &nearby.obstacles {
            let Some(corner) = near.obstacle.corner() else { continue };
            let id = near.obstacle.id();
            let bent = |&i: &usize| Taut::of(i, id, shape.at(i), shape.at(following(i, n)), corner, radius);
            out.strings.extend(near.edges.iter().filter_map(bent));
        }
        let polygon = shape.content();
        (out.area, out.x, out.y) = (polygon.area, polygon.x, polygon.y);
        let mut load = self.load(out);
        if out.strings.is_empty() {
            return load;
        }
        for _ in 0..ROUNDS {
            let last = (out.area, out.x);
            let (mut area, mut moment) = (0.0, 0.0);
            for string in &mut out.strings {
                string.settle(&load);
                let behind = string.area();
                area += behind;
                moment += behind * (string.middle() - polygon.x);
            }
            out.area = polygon.area + area;
            out.x = polygon.x + moment / out.area;
            load = self.load(out);
            if (out.area - last.0).abs() <= CONSISTENT && (out.x - last.1).abs() <= CONSISTENT {
                break;
            }
        }
        load
    }

    /// Pressure and weight of the liquid of an evaluated shape.
    pub(crate) fn load(&self, out: &Evaluation) -> Load {
        let pressure = -self.k_a * (out.area - self.rest);
        Load { gamma: self.gamma, k_w: self.k_w, pressure, weight: self.weight / out.area, centroid: out.x }
    }

    /// Tension, area and weight of the polygon.
    fn add_liquid(&self, shape: &Polygon, out: &mut Evaluation) {
        let n = shape.len();
        let excess = out.area - self.rest;
        out.perimeter = out.edges.perimeter;
        out.energy = self.gamma * out.perimeter + 0.5 * self.k_a * excess * excess - self.weight * out.x;
        // d(x_c) = sum over edges of d[(x_i + x_j) c]/(6 a), with places relative to the centroid.
        let sixth = 1.0 / (6.0 * out.area);
        for i in 0..n {
            let (j, k) = (following(i, n), preceding(i, n));
            // The edge along its unit vector.
            let (tx, ty) = (-self.gamma * out.edges.ny[i], self.gamma * out.edges.nx[i]);
            for (vertex, sign) in [(i, -1.0), (j, 1.0)] {
                out.gradient[2 * vertex] += sign * tx;
                out.gradient[2 * vertex + 1] += sign * ty;
            }
            out.area_gradient[2 * i] += 0.5 * (shape.y[j] - shape.y[k]);
            out.area_gradient[2 * i + 1] += 0.5 * (shape.x[k] - shape.x[j]);
            let (xi, yi, xj, yj) = (shape.x[i] - out.x, shape.y[i] - out.y, shape.x[j] - out.x, shape.y[j] - out.y);
            let cross = xi * yj - xj * yi;
            out.x_gradient[2 * i] += sixth * (cross + (xi + xj) * yj);
            out.x_gradient[2 * j] += sixth * (cross - (xi + xj) * yi);
            out.x_gradient[2 * i + 1] -= sixth * (xi + xj) * xj;
            out.x_gradient[2 * j + 1] += sixth * (xi + xj) * xi;
            out.y_gradient[2 * i + 1] += sixth * (cross - (yi + yj) * xj);
            out.y_gradient[2 * j + 1] += sixth * (cross + (yi + yj) * xi);
            out.y_gradient[2 * i] += sixth * (yi + yj) * yj;
            out.y_gradient[2 * j] -= sixth * (yi + yj) * yi;
        }
        for k in 0..2 * n {
            out.gradient[k] -= out.load.pressure * out.area_gradient[k] + self.weight * out.x_gradient[k];
        }
    }

    fn add_strings(&self, out: &mut Evaluation) {
        let n = out.edges.length.len();
        for string in &out.strings {
            let (i, term) = (string.edge, string.force(&out.load));
            out.energy += term.energy;
            out.perimeter += term.length;
            out.overlap = out.overlap.max(string.indentation);
            out.touched.push(string.obstacle);
            out.active.push(2 * i as u32 + u32::from(string.is_straight()));
            let j = following(i, n);
            for (k, at) in [2 * i, 2 * i + 1, 2 * j, 2 * j + 1].into_iter().enumerate() {
                out.gradient[at] += term.gradient[k];
                out.area_gradient[at] += term.area_gradient[k];
                out.x_gradient[at] += term.moment_gradient[k] / out.area;
            }
        }
    }

    /// Vertices against walls.
    fn add_walls(&self, shape: &Polygon, nearby: &Nearby<W::Obstacle>, out: &mut Evaluation) {
        for near in &nearby.obstacles {
            for &i in &near.vertices {
                let [x, y] = shape.at(i);
                let Some((depth, [nx, ny])) = near.obstacle.touch_point(x, y, self.reach) else { continue };
                let push = self.k_w * depth;
                out.energy += 0.5 * push * depth;
                out.overlap = out.overlap.max(depth);
                out.touched.push(near.obstacle.id());
                out.active.push(i as u32);
                out.gradient[2 * i] -= push * nx;
                out.gradient[2 * i + 1] -= push * ny;
            }
        }
    }

    fn add_folds(&self, shape: &Polygon, nearby: &Nearby<W::Obstacle>, out: &mut Evaluation) {
        let Some(folds) = &self.folds else { return };
        for &pair in &nearby.pairs {
            match folds.touch(shape, pair) {
                Some(Pair::Gap(touch)) => {
                    out.energy += touch.energy;
                    out.active.push(touch.vertices[0] as u32);
                    for k in 0..6 {
                        out.gradient[2 * touch.vertices[k / 2] + k % 2] += touch.gradient[k];
                    }
                    out.touches.push(touch);
                }
                Some(Pair::Film(place)) => out.closing = out.closing.or(Some(place)),
                None => {}
            }
        }
    }
}

mod settling;
mod stiffness;

pub(crate) use stiffness::Foreseen;

#[cfg(test)]
mod tests;

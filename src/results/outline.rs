//! The outline of a droplet at one instant, and the forces of the obstacles on it.
//!
//! Outlines are kept for pictures, and to tell how a clog holds.
//!
//! ```
//! use meniscus::results::outline::Outline;
//! // A square of side 1.
//! let square = Outline { x: vec![5.0, 6.0, 6.0, 5.0], y: vec![1.0, 1.0, 2.0, 2.0], ..Outline::default() };
//! assert_eq!(square.centroid(), [5.5, 1.5]);
//! assert_eq!(square.bounds(), [5.0, 6.0, 1.0, 2.0]);
//! assert!(square.contains(5.1, 1.9) && !square.contains(4.9, 1.5) && !square.contains(5.5, 2.1));
//! // A soft particle is one point.
//! let point = Outline { x: vec![3.0], y: vec![4.0], ..Outline::default() };
//! assert_eq!(point.centroid(), [3.0, 4.0]);
//! ```

use crate::parameters::MOST_VERTICES;
use serde::{Deserialize, Serialize};

/// A droplet at one instant, in unwrapped world coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outline {
    /// Time, in t0.
    pub t: f64,
    /// x of each vertex, counter-clockwise; a soft particle has one point.
    pub x: Vec<f64>,
    /// y of each vertex.
    pub y: Vec<f64>,
    /// The loads that obstacles carry, by their numbers.
    pub loads: Vec<LoadRecord>,
}

/// The load that one obstacle carries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadRecord {
    /// Number of the obstacle in its scene.
    pub obstacle: u32,
    /// x of the mean point of contact, weighted by the force.
    pub x: f64,
    /// y of that point.
    pub y: f64,
    /// x of the force on the droplet. The weight of a droplet is pi/4.
    pub fx: f64,
    /// y of the force on the droplet.
    pub fy: f64,
    /// Angle by which the normal turns along the contact, in radians.
    pub turn: f64,
}

/// How wide an outline can be, and how far from the origin, in sigma. A droplet that came apart is neither drawn nor
/// kept.
const WIDEST: f64 = 1e3;
const FURTHEST: f64 = 1e9;

impl Outline {
    /// Whether there is a vertex, every x has its y, all numbers are finite, and the droplet is one: no further from
    /// the origin than 1e9 sigma, no wider than 1000, and of no more vertices than any ring.
    pub fn is_sound(&self) -> bool {
        let [x0, x1, y0, y1] = self.bounds();
        let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        self.x.len() == self.y.len()
            && (1..=MOST_VERTICES).contains(&self.x.len())
            && self.t.is_finite()
            && finite(&self.x)
            && finite(&self.y)
            && (x1 - x0).max(y1 - y0) <= WIDEST
            && x0.abs().max(y0.abs()) <= FURTHEST
            && self.loads.iter().all(|load| finite(&[load.x, load.y, load.fx, load.fy, load.turn]))
    }

    /// Centroid of the area; the point itself for SP.
    pub fn centroid(&self) -> [f64; 2] {
        let (Some(&x0), Some(&y0)) = (self.x.first(), self.y.first()) else { return [f64::NAN; 2] };
        // Places relative to vertex 0 keep cancellation small.
        let (mut twice_area, mut moment) = (0.0, [0.0; 2]);
        for [[ax, ay], [bx, by]] in self.edges(x0, y0) {
            let cross = ax * by - bx * ay;
            twice_area += cross;
            moment[0] += (ax + bx) * cross;
            moment[1] += (ay + by) * cross;
        }
        if twice_area == 0.0 {
            return [x0, y0];
        }
        [x0 + moment[0] / (3.0 * twice_area), y0 + moment[1] / (3.0 * twice_area)]
    }

    /// Whether the point lies inside the ring, that is, whether the ring winds round it.
    pub fn contains(&self, px: f64, py: f64) -> bool {
        let winding = self.edges(px, py).map(|[[ax, ay], [bx, by]]| {
            let cross = ax * by - bx * ay;
            i32::from(ay <= 0.0 && by > 0.0 && cross > 0.0) - i32::from(ay > 0.0 && by <= 0.0 && cross < 0.0)
        });
        winding.sum::<i32>() != 0
    }

    /// The smallest box around the vertices: `[x_min, x_max, y_min, y_max]`.
    pub fn bounds(&self) -> [f64; 4] {
        let ends = |v: &[f64]| v.iter().fold([f64::MAX, f64::MIN], |[lo, hi], &c| [lo.min(c), hi.max(c)]);
        let ([x0, x1], [y0, y1]) = (ends(&self.x), ends(&self.y));
        [x0, x1, y0, y1]
    }

    /// The edges of the closed ring, both ends relative to `(x0, y0)`.
    fn edges(&self, x0: f64, y0: f64) -> impl Iterator<Item = [[f64; 2]; 2]> + '_ {
        let vertex = move |i: usize| [self.x[i] - x0, self.y[i] - y0];
        let n = self.x.len();
        (0..n).map(move |i| [vertex(i), vertex((i + 1) % n)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outline_with_a_number_that_is_not_finite_is_not_sound() {
        let load = LoadRecord { obstacle: 0, x: 0.0, y: 0.0, fx: 0.0, fy: 0.0, turn: 0.0 };
        let good = Outline { t: 1.0, x: vec![0.0], y: vec![0.0], loads: vec![load] };
        assert!(good.is_sound());
        assert!(!Outline { t: f64::NAN, ..good.clone() }.is_sound());
        assert!(!Outline { y: vec![f64::INFINITY], ..good.clone() }.is_sound());
        assert!(!Outline { loads: vec![LoadRecord { fy: f64::NAN, ..load }], ..good.clone() }.is_sound());
        assert!(!Outline { y: vec![], ..good.clone() }.is_sound());
        assert!(!Outline { x: vec![1.7e308], ..good.clone() }.is_sound());
        assert!(!Outline { x: vec![0.0, 2e3], y: vec![0.0; 2], ..good }.is_sound());
    }
}

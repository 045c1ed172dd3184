//! A periodic box of discs at random: random sequential addition ([C24] 2.4).
//!
//! Discs of diameter `sigma_ob` are placed one after the other at uniformly random places, each kept if its surface
//! stays further than `w_ob` from all earlier ones, until there are enough or, saturated, until no further one fits.
//! An array depends on the field and the seed alone, so the same arrays serve every droplet.

use super::packing::Packing;
use crate::job::{Density, ObstacleField};
use crate::scene::wall::{Edges, Shape, Touch, Walls};
use crate::trajectory::{Failure, FailureClass};
use fearless_simd::{f64x8, prelude::*};
use std::sync::OnceLock;

/// How far from the box centre a gap is looked for, in sigma.
pub const SEARCH_RADIUS: f64 = 1.0;

/// Discs in a periodic box, sorted by cell. About 21 bytes a disc.
#[derive(Clone, Debug, PartialEq)]
pub struct ObstacleArray {
    /// Side of the box.
    pub box_size: f64,
    /// Radius of a disc.
    pub radius: f64,
    x: Vec<f64>,
    y: Vec<f64>,
    /// Discs of cell k are `cell_start[k]..cell_start[k + 1]`.
    cell_start: Vec<u32>,
    cells: usize,
    /// Found when first asked for.
    widest_gap: OnceLock<([f64; 2], f64)>,
}

/// A disc near a droplet, in local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its index in the array.
    pub id: u32,
    /// x of its centre.
    pub x: f64,
    /// y of its centre.
    pub y: f64,
}

impl Shape for Disc {
    const LEVEL: f64 = 0.0;

    fn id(&self) -> u32 {
        self.id
    }

    #[inline(always)]
    fn distance<S: Simd>(&self, simd: S, edges: Edges<S>) -> f64x8<S> {
        let [_, px, py] = self.nearest(simd, edges);
        (px * px + py * py).sqrt()
    }

    #[inline(always)]
    fn distance_to<S: Simd>(&self, _: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let (rx, ry) = (x - self.x, y - self.y);
        (rx * rx + ry * ry).sqrt()
    }

    #[inline(always)]
    fn touch<S: Simd>(&self, simd: S, edges: Edges<S>, reach: f64) -> Option<Touch<S>> {
        let [q, px, py] = self.nearest(simd, edges);
        let squared = px * px + py * py;
        if !squared.simd_lt(f64x8::splat(simd, reach * reach)).any_true() {
            return None;
        }
        let distance = squared.max(f64x8::splat(simd, 1e-300)).sqrt();
        let overlap = (reach - distance).max(f64x8::splat(simd, 0.0));
        let inverse = 1.0 / distance;
        Some(Touch { q, overlap, nx: px * inverse, ny: py * inverse })
    }

    #[inline(always)]
    fn touch_point(&self, x: f64, y: f64, reach: f64) -> Option<(f64, [f64; 2])> {
        let (dx, dy) = (x - self.x, y - self.y);
        let squared = dx * dx + dy * dy;
        (squared < reach * reach).then(|| {
            let squared = squared.max(1e-300);
            let distance = squared.sqrt();
            (reach - distance, [dx / distance, dy / distance])
        })
    }

    /// `k (R/d - 1) (x, y)`. A soft particle waits for nothing but the inverse distance, so it is made without root or division from the one before:
    /// `y (1 + e/2 + 3e^2/8 + 5e^3/16 + 35e^4/128)`, `e = 1 - d^2 y^2`, whose error `63e^5/256` is below 1e-17 for the e that are let pass.
    #[inline(always)]
    fn push_point(&self, at: [f64; 2], reach: f64, stiffness: f64, memory: &mut f64, force: [f64; 2]) -> [f64; 2] {
        let (dx, dy) = (at[0] - self.x, at[1] - self.y);
        let squared = dx.mul_add(dx, dy * dy);
        if squared >= reach * reach {
            return force;
        }
        let before = *memory;
        let e = (-squared).mul_add(before * before, 1.0);
        let inverse = if e.abs() < 5e-4 {
            let tail = e.mul_add(0.2734375, 0.3125);
            (before * e).mul_add((e * e).mul_add(tail, e.mul_add(0.375, 0.5)), before)
        } else {
            1.0 / squared.max(1e-300).sqrt()
        };
        *memory = inverse;
        let push = (stiffness * reach).mul_add(inverse, -stiffness);
        [push.mul_add(dx, force[0]), push.mul_add(dy, force[1])]
    }

    #[inline(always)]
    fn curvature<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let (rx, ry) = (x - self.x, y - self.y);
        1.0 / (rx * rx + ry * ry).max(f64x8::splat(simd, 1e-300)).sqrt()
    }

    fn heart(&self) -> Option<[f64; 2]> {
        Some([self.x, self.y])
    }
}

impl Disc {
    /// Where on each edge its nearest point lies, and that point relative to the centre.
    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, edges: Edges<S>) -> [f64x8<S>; 3] {
        let Edges { x, y, ex, ey } = edges;
        let (rx, ry) = (x - self.x, y - self.y);
        let length_squared = (ex * ex + ey * ey).max(f64x8::splat(simd, 1e-300));
        let q = -(rx * ex + ry * ey) / length_squared;
        let q = q.max(f64x8::splat(simd, 0.0)).min(f64x8::splat(simd, 1.0));
        [q, rx + q * ex, ry + q * ey]
    }
}

impl Walls for ObstacleArray {
    type Shape = Disc;

    fn surface(&self) -> f64 {
        self.radius
    }

    fn for_each_near(&self, origin: [f64; 2], bounds: [f64; 4], visit: impl FnMut(Disc)) {
        self.for_each_in(origin, bounds, visit);
    }
}

impl ObstacleArray {
    /// Places the discs of `field` for `seed`.
    ///
    /// # Errors
    /// `bad_input` if the box is full before the asked density is reached.
    pub fn generate(field: &ObstacleField, seed: u64) -> Result<Self, Failure> {
        let wanted = match field.density {
            Density::Saturated => usize::MAX,
            Density::Number(n) => (n * field.box_size * field.box_size).round() as usize,
        };
        let mut packing = Packing::new(field, seed);
        packing.fill(wanted);
        if packing.x.len() < wanted && wanted != usize::MAX {
            let per_area = packing.x.len() as f64 / (field.box_size * field.box_size);
            return Err(Failure {
                class: FailureClass::BadInput,
                reason: format!(
                    "density = {} does not fit: with w_ob = {} and sigma_ob = {} the box of seed {seed} is full at {per_area:.3}",
                    wanted as f64 / (field.box_size * field.box_size),
                    field.w_ob,
                    field.sigma_ob
                ),
                step: 0,
                shape: None,
            });
        }
        Ok(Self::from_centres(field.box_size, 0.5 * field.sigma_ob, &packing.x, &packing.y))
    }

    /// An array of discs at given places, `0 <= x, y < box_size`.
    pub fn from_centres(box_size: f64, radius: f64, x: &[f64], y: &[f64]) -> Self {
        let cells = ((x.len() as f64).sqrt() as usize).clamp(1, (box_size / radius.max(0.1)) as usize);
        let cell_of = |c: f64| ((c / box_size * cells as f64) as usize).min(cells - 1);
        let key: Vec<usize> = x.iter().zip(y).map(|(&x, &y)| cell_of(y) * cells + cell_of(x)).collect();
        let mut cell_start = vec![0_u32; cells * cells + 1];
        key.iter().for_each(|&k| cell_start[k + 1] += 1);
        for k in 0..cells * cells {
            cell_start[k + 1] += cell_start[k];
        }
        let mut next = cell_start.clone();
        let (mut sorted_x, mut sorted_y) = (vec![0.0; x.len()], vec![0.0; x.len()]);
        for (i, &k) in key.iter().enumerate() {
            sorted_x[next[k] as usize] = x[i];
            sorted_y[next[k] as usize] = y[i];
            next[k] += 1;
        }
        Self { box_size, radius, x: sorted_x, y: sorted_y, cell_start, cells, widest_gap: OnceLock::new() }
    }

    /// One disc around the origin; its nearest periodic image is 2^14 sigma away.
    pub fn lone(radius: f64) -> Self {
        Self::from_centres(16_384.0, radius, &[0.0], &[0.0])
    }

    /// Number of discs.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Memory it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.x) + size_of_val(&*self.y) + size_of_val(&*self.cell_start)
    }

    /// Whether there is no disc at all.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Calls `visit` with every disc whose centre lies in the box `[x_min, x_max, y_min, y_max]`, all in coordinates
    /// relative to `origin`; periodic images count as discs of the same id.
    pub fn for_each_in(&self, origin: [f64; 2], bounds: [f64; 4], mut visit: impl FnMut(Disc)) {
        let width = self.box_size / self.cells as f64;
        let cell = |c: f64| (c / width).floor() as i64;
        let n = self.cells as i64;
        for row in cell(origin[1] + bounds[2])..=cell(origin[1] + bounds[3]) {
            let shift_y = row.div_euclid(n) as f64 * self.box_size - origin[1];
            for column in cell(origin[0] + bounds[0])..=cell(origin[0] + bounds[1]) {
                let shift_x = column.div_euclid(n) as f64 * self.box_size - origin[0];
                let k = (row.rem_euclid(n) * n + column.rem_euclid(n)) as usize;
                for i in self.cell_start[k]..self.cell_start[k + 1] {
                    let (x, y) = (self.x[i as usize] + shift_x, self.y[i as usize] + shift_y);
                    if x >= bounds[0] && x <= bounds[1] && y >= bounds[2] && y <= bounds[3] {
                        visit(Disc { id: i, x, y });
                    }
                }
            }
        }
    }

    /// Distance from a point to the nearest disc surface, looking no further than `reach`; negative inside a disc.
    pub fn clearance(&self, point: [f64; 2], reach: f64) -> f64 {
        let mut nearest = reach;
        let far = reach + self.radius;
        self.for_each_in(point, [-far, far, -far, far], |disc| {
            nearest = nearest.min((disc.x * disc.x + disc.y * disc.y).sqrt() - self.radius);
        });
        nearest
    }

    /// The point of largest clearance within 1 sigma of the box centre, and that clearance (at most 0.75); on a grid of
    /// 0.02 sigma, ties going to the first.
    pub fn widest_gap_near_centre(&self) -> ([f64; 2], f64) {
        *self.widest_gap.get_or_init(|| self.look_for_widest_gap())
    }

    fn look_for_widest_gap(&self) -> ([f64; 2], f64) {
        let (centre, radius) = (0.5 * self.box_size, SEARCH_RADIUS);
        let steps = (radius / 0.02).round() as i32;
        let mut best = ([centre, centre], f64::NEG_INFINITY);
        for j in -steps..=steps {
            for i in -steps..=steps {
                let (dx, dy) = (0.02 * f64::from(i), 0.02 * f64::from(j));
                if dx * dx + dy * dy > radius * radius {
                    continue;
                }
                let point = [centre + dx, centre + dy];
                let clearance = self.clearance(point, 0.75);
                if clearance > best.1 {
                    best = (point, clearance);
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(density: Density) -> ObstacleField {
        ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density, box_size: 30.0 }
    }

    fn all(array: &ObstacleArray) -> Vec<Disc> {
        let mut discs = Vec::new();
        let end = array.box_size * (1.0 - 1e-15);
        array.for_each_in([0.0, 0.0], [0.0, end, 0.0, end], |disc| discs.push(disc));
        discs
    }

    #[test]
    fn no_two_discs_come_closer_than_the_gap() {
        let array = ObstacleArray::generate(&field(Density::Saturated), 3).unwrap();
        for disc in all(&array) {
            let mut near = 0;
            array.for_each_in([disc.x, disc.y], [-0.5, 0.5, -0.5, 0.5], |other| {
                near += usize::from(other.x * other.x + other.y * other.y <= 0.25);
            });
            assert_eq!(near, 1, "only the disc itself");
        }
    }

    #[test]
    fn a_saturated_array_has_the_known_coverage_and_no_room_left() {
        // Jamming coverage of random sequential addition of discs: 0.5470 (Feder 1980; Zhang and Torquato 2013).
        let array =
            ObstacleArray::generate(&ObstacleField { box_size: 100.0, ..field(Density::Saturated) }, 1).unwrap();
        let coverage = array.len() as f64 * std::f64::consts::PI * 0.25 * 0.25 / 1e4;
        assert!((coverage - 0.547).abs() < 0.004, "{coverage}");
        for k in 0..20_000_u32 {
            let point = [f64::from(k % 151) * 0.66, f64::from(k / 151) * 0.75];
            assert!(array.clearance(point, 1.0) <= 0.35 + 1e-9);
        }
    }

    #[test]
    fn a_given_density_is_met_and_an_impossible_one_refused() {
        let array = ObstacleArray::generate(&field(Density::Number(0.35)), 0).unwrap();
        assert_eq!(array.len(), 315);
        let error = ObstacleArray::generate(&field(Density::Number(2.95)), 0).unwrap_err();
        assert!(error.reason.contains("density = 2.95"), "{error}");
    }

    #[test]
    fn the_same_seed_gives_the_same_array_and_another_seed_another() {
        let make = |seed| ObstacleArray::generate(&field(Density::Number(1.0)), seed).unwrap();
        assert_eq!(make(5), make(5));
        assert_ne!(make(5), make(6));
    }

    #[test]
    fn discs_repeat_with_the_box() {
        let array = ObstacleArray::generate(&field(Density::Number(1.0)), 2).unwrap();
        let look = |origin: [f64; 2]| {
            let mut seen = Vec::new();
            array.for_each_in(origin, [-2.0, 2.0, -2.0, 2.0], |disc| seen.push(disc));
            seen.sort_by_key(|disc| disc.id);
            seen
        };
        assert_eq!(look([29.0, 1.0]), look([29.0 - 30.0, 1.0 + 90.0]));
        assert!(look([29.0, 1.0]).len() > 8);
    }
}

//! Drag that grows towards a wall ([C24] eqs 5, 6): `-(zeta_i/N_v) v_i`,
//! `zeta_i = b_inf (1 + (b0/b_inf)(sigma/d_i)^alpha)`.
//!
//! `d_i` is the distance of vertex i from the nearest wall, but at least `delta/2`. Each block of eight vertices has a
//! list of the walls that may be nearest to one of them. The smallest of the distances from these walls is exact, so no
//! result depends on when the lists were made.
//!
//! At the paper's `alpha = 4/3` the power is the fourth power of an inverse cube root, which Newton's method finds from
//! a guess that is 4% off. Other exponents use `libm::pow`.
//!
//! Example: at `b0/b_inf = 0.4`, one diameter away from the nearest wall, a vertex is damped at 1.4/V_t.

use crate::on_instruction_set;
use crate::parameters::PAPER_ALPHA;
use crate::physics::ring::Ring;
use crate::physics::simd::{InstructionSet, LANES, aligned::Aligned, load, max_lanes, padded, store};
use crate::physics::walls::neighbours::{Neighbours, obstacles_near};
use crate::physics::walls::wall::{ObstacleQueries, Walls};
use fearless_simd::{Fallback, f64x8, prelude::*};
use std::ops::Range;
use std::sync::Arc;

/// Walls further away than this, in sigma, are left out. They would raise the drag by less than 1e-5 b0.
const FARTHEST: f64 = 1e4;

/// How far a vertex may move before the lists of nearest walls are made again, in sigma.
const SKIN: f64 = 0.05;

/// The near-wall drag of a ring, among walls of any scene.
#[derive(Debug)]
pub struct NearWallDrag {
    rates: Aligned,
    distances: Box<dyn Update>,
}

/// [`NearestWalls`] for walls of any scene.
trait Update: Send + Sync + std::fmt::Debug {
    fn update(&mut self, distance: f64, ring: &Ring, rates: &mut [f64]);
}

/// The parameters of the drag, and the walls that may be nearest to each vertex.
#[derive(Debug)]
struct NearestWalls<W: Walls> {
    walls: Arc<W>,
    instruction_set: InstructionSet,
    /// `1/V_t`.
    far_rate: f64,
    b0: f64,
    alpha: f64,
    /// Smaller distances are taken as this one, `delta/2`.
    floor: f64,
    /// Walls that may be nearest to a vertex, block by block.
    nearest: Neighbours<W::Obstacle>,
    of_block: Vec<Range<usize>>,
}

impl NearWallDrag {
    /// Drag of a ring of `n_vertices` and vertex diameter `delta`, of strength `b0` in units of b_inf.
    pub(crate) fn new<W: Walls>(
        walls: Arc<W>,
        n_vertices: usize,
        v_t: f64,
        b0: f64,
        alpha: f64,
        delta: f64,
        instruction_set: InstructionSet,
    ) -> Self {
        let mut rates = Aligned::zeros(padded(n_vertices));
        rates.fill(1.0 / v_t);
        let distances = Box::new(NearestWalls {
            walls,
            instruction_set,
            far_rate: 1.0 / v_t,
            b0,
            alpha,
            floor: 0.5 * delta,
            nearest: Neighbours::new(SKIN),
            of_block: Vec::new(),
        });
        Self { rates, distances }
    }

    pub(crate) fn update(&mut self, distance: f64, ring: &Ring) {
        self.distances.update(distance, ring, &mut self.rates);
    }

    pub(crate) fn rates(&self) -> &[f64] {
        &self.rates
    }
}

impl<W: Walls> NearestWalls<W> {
    /// Lists, for each block, every wall that may be nearest to one of its vertices before the skin is used up.
    #[inline(never)]
    fn list(&mut self, ring: &Ring) {
        self.nearest.renew(ring.origin);
        let bounds = ring.bounds();
        let mut margin = 1.0;
        // If each vertex has a wall nearer than the margin, its nearest wall is certainly among those found.
        while margin < FARTHEST {
            let far = margin + self.walls.surface() + 2.0 * SKIN;
            let near = obstacles_near(&*self.walls, ring.origin, bounds, far);
            if !near.is_empty() && self.choose(ring, &near) <= margin {
                return;
            }
            margin *= 2.0;
        }
    }

    /// Fills the lists from `near`; returns the largest distance of any vertex from its nearest wall.
    fn choose(&mut self, ring: &Ring, near: &[W::Obstacle]) -> f64 {
        self.nearest.renew(ring.origin);
        self.of_block.clear();
        let surface = self.walls.surface();
        let mut farthest: f64 = 0.0;
        let (of_block, chosen) = (&mut self.of_block, &mut self.nearest.items);
        // Called rarely, so the plain instruction set is fast enough.
        let simd = Fallback::new();
        for start in (0..ring.ux.len()).step_by(LANES) {
            let (x, y) = (load(simd, &ring.x, start), load(simd, &ring.y, start));
            let mut nearest = f64x8::splat(simd, f64::INFINITY);
            for obstacle in near {
                nearest = nearest.min(simd.distance_to(obstacle, x, y));
            }
            farthest = farthest.max(max_lanes(nearest) - surface);
            let first = chosen.len();
            // Two distances may each change by a skin before the list is made again.
            let reach = nearest + 2.0 * SKIN;
            chosen.extend(near.iter().filter(|obstacle| simd.distance_to(*obstacle, x, y).simd_le(reach).any_true()));
            of_block.push(first..chosen.len());
        }
        farthest
    }

    #[inline(always)]
    fn update_with<S: ObstacleQueries>(&mut self, simd: S, ring: &Ring, rates: &mut [f64]) {
        let surface = self.walls.surface();
        for (block, list) in self.of_block.iter().enumerate() {
            let at = block * LANES;
            let (x, y) = (load(simd, &ring.x, at), load(simd, &ring.y, at));
            let mut nearest = f64x8::splat(simd, f64::INFINITY);
            for obstacle in &self.nearest.items[list.clone()] {
                nearest = nearest.min(simd.distance_to(obstacle, x, y));
            }
            let distance = (nearest - surface).max(f64x8::splat(simd, self.floor)).min(f64x8::splat(simd, 1e6));
            let rate = (power(simd, distance, self.alpha) * self.b0 + 1.0) * self.far_rate;
            store(rate, rates, at);
        }
    }
}

/// `d^(-alpha)`.
#[inline(always)]
fn power<S: Simd>(simd: S, d: f64x8<S>, alpha: f64) -> f64x8<S> {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(d.as_slice());
    if alpha != PAPER_ALPHA {
        return f64x8::from_slice(simd, &lanes.map(|d| libm::pow(d, -alpha)));
    }
    // Divides the exponent by -3, in the bits of a single-precision number.
    let guess = lanes.map(|d| f64::from(f32::from_bits(0x54a2_4637 - (d as f32).to_bits() / 3)));
    let mut root = f64x8::from_slice(simd, &guess);
    for _ in 0..4 {
        root = root * (4.0 - d * root * root * root) * (1.0 / 3.0);
    }
    (root * root) * (root * root)
}

impl<W: Walls> Update for NearestWalls<W> {
    fn update(&mut self, distance: f64, ring: &Ring, rates: &mut [f64]) {
        if self.nearest.moved(distance, ring.origin) {
            self.list(ring);
            if self.nearest.items.is_empty() {
                rates.fill(self.far_rate);
            }
        }
        if self.nearest.items.is_empty() {
            return;
        }
        on_instruction_set!(self.instruction_set, simd => self.update_with(simd, ring, rates));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::walls::arrays::obstacles::ObstacleArray;

    #[test]
    fn the_power_is_right_to_rounding() {
        let simd = Fallback::new();
        let mut d = 1e-3;
        while d < 1e3 {
            for alpha in [PAPER_ALPHA, 1.0] {
                let got = power(simd, f64x8::splat(simd, d), alpha).as_slice()[0];
                assert!((got * libm::pow(d, alpha) - 1.0).abs() < 3e-15, "{d} {alpha}");
            }
            d *= 1.13;
        }
    }

    #[test]
    fn each_vertex_is_damped_by_its_true_distance_however_the_ring_moves() {
        let x: Vec<f64> = (0..40).map(|k| 20.0 + 8.0 * libm::sin(1.7 * f64::from(k))).collect();
        let y: Vec<f64> = (0..40).map(|k| 20.0 + 8.0 * libm::cos(2.9 * f64::from(k))).collect();
        let discs = Arc::new(ObstacleArray::from_centres(40.0, 0.15, &x, &y));
        let mut ring = Ring::regular(50, [20.0, 20.0], 0.5);
        let mut drag = NearWallDrag::new(discs, 50, 0.03, 0.4, PAPER_ALPHA, 0.0123, InstructionSet::new());
        for step in 0..60 {
            drag.update(0.02, &ring);
            for i in 0..50 {
                let at = [ring.x[i] + ring.origin[0], ring.y[i] + ring.origin[1]];
                let to = |(x, y): (&f64, &f64)| libm::hypot(at[0] - x, at[1] - y) - 0.15;
                let nearest = x.iter().zip(&y).map(to).fold(f64::INFINITY, f64::min).max(0.5 * 0.0123);
                let want = (1.0 + 0.4 * libm::pow(nearest, -PAPER_ALPHA)) / 0.03;
                assert!((drag.rates[i] / want - 1.0).abs() < 1e-12, "step {step} vertex {i}");
            }
            ring.x.iter_mut().for_each(|x| *x += 0.019);
        }
    }
}

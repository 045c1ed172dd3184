//! The ring repels itself where it folds back: `U = sum (k/2)(delta - d)^2` over vertices and edges that lie apart along the
//! ring and closer than `delta` in the plane.
//!
//! `d` is the distance of a vertex from its nearest point on an edge; in the plane two edges that do not cross are
//! nearest at an end of one of them, so vertices against edges miss nothing. What lies apart along the ring is told in one of
//! two ways, [`Apart`]: a fold is the same for both, a pile of vertices is not.
//!
//! Eight vertices are paired with each edge that comes close to one of them; where nothing comes close there is no pair, and
//! the effect costs a look at the boxes of the blocks whenever some vertex has moved by half the skin.

pub mod apart;
mod crossing;

pub use crossing::crosses;

use crate::on_instruction_set;
use crate::physics::ring::Ring;
use crate::physics::ring::forces::RingForce;
use crate::physics::simd::InstructionSet;
use crate::physics::simd::{LANES, load, padded, store, sum_lanes};
use apart::{Apart, WAY, places_within};
use fearless_simd::{Fallback, f64x8, mask64x8, prelude::*};

/// Eight vertices and an edge that may touch.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair {
    vertices: usize,
    edge: usize,
}

/// The self-contact effect and its list of pairs.
#[derive(Clone, Debug)]
pub struct SelfContact {
    instruction_set: InstructionSet,
    stiffness: f64,
    delta: f64,
    apart: Apart,
    pairs: Vec<Pair>,
    /// Number of each vertex; the padding stands nowhere.
    place: Vec<f64>,
    /// Way of each vertex along the ring from vertex 0, when the list was made.
    way: Vec<f64>,
    /// The same once round.
    whole_way: f64,
    /// More places than this between them also keep vertices and edges apart.
    places: Option<f64>,
    /// Where the vertices were when the list was made, relative to their mean.
    listed_x: Vec<f64>,
    listed_y: Vec<f64>,
    slack: f64,
}

impl SelfContact {
    /// Repulsion of total stiffness `N_v k` within `delta`.
    pub fn new(
        n_vertices: usize,
        total_stiffness: f64,
        delta: f64,
        apart: Apart,
        instruction_set: InstructionSet,
    ) -> Self {
        let place = |i: usize| if i < n_vertices { i as f64 } else { f64::NAN };
        let nowhere = vec![f64::INFINITY; n_vertices];
        Self {
            instruction_set,
            stiffness: total_stiffness / n_vertices as f64,
            delta,
            apart,
            pairs: Vec::new(),
            place: (0..padded(n_vertices)).map(place).collect(),
            way: vec![f64::NAN; padded(n_vertices)],
            whole_way: 0.0,
            places: (apart == Apart::Places).then(|| places_within(n_vertices, delta) as f64),
            listed_x: nowhere.clone(),
            listed_y: nowhere,
            slack: f64::NEG_INFINITY,
        }
    }

    #[inline(never)]
    fn list(&mut self, ring: &Ring) {
        let skin = self.apart.skin(self.delta);
        self.slack = skin;
        let [mx, my] = mean(ring);
        for i in 0..ring.n {
            (self.listed_x[i], self.listed_y[i]) = (ring.x[i] - mx, ring.y[i] - my);
        }
        self.measure_ways(ring);
        let boxes: Vec<[f64; 4]> = (0..padded(ring.n)).step_by(LANES).map(|start| block_box(ring, start)).collect();
        let far = self.delta + skin;
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.clear();
        on_instruction_set!(self.instruction_set, simd => {
            for (a, vertices) in boxes.iter().enumerate() {
                for (b, edges) in boxes.iter().enumerate() {
                    let apart =
                        |low: usize, high: usize| vertices[low] > edges[high] + far || edges[low] > vertices[high] + far;
                    if apart(0, 1) || apart(2, 3) {
                        continue;
                    }
                    for edge in b * LANES..((b + 1) * LANES).min(ring.n) {
                        if self.overlap(simd, ring, a * LANES, edge, far).is_some() {
                            pairs.push(Pair { vertices: a * LANES, edge });
                        }
                    }
                }
            }
        });
        self.pairs = pairs;
    }

    fn measure_ways(&mut self, ring: &Ring) {
        let mut way = 0.0;
        for i in 0..ring.n {
            self.way[i] = way;
            let (ex, ey) = (ring.x[i + 1] - ring.x[i], ring.y[i + 1] - ring.y[i]);
            way += (ex * ex + ey * ey).sqrt();
        }
        self.whole_way = way;
    }

    /// Twice the largest movement of a vertex since the list was made, that of the whole ring apart.
    fn deformation(&self, ring: &Ring) -> f64 {
        let [mx, my] = mean(ring);
        let squared = |i: usize| {
            let (dx, dy) = (ring.x[i] - mx - self.listed_x[i], ring.y[i] - my - self.listed_y[i]);
            dx * dx + dy * dy
        };
        2.0 * (0..ring.n).map(squared).fold(0.0, f64::max).sqrt()
    }

    /// Overlap of eight vertices with edge `j` within `reach`: how deep, where on the edge, and the unit normal from edge to vertex.
    #[inline(always)]
    fn overlap<S: Simd>(&self, simd: S, ring: &Ring, vertices: usize, j: usize, reach: f64) -> Option<[f64x8<S>; 4]> {
        let (zero, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
        let (ex, ey) = (ring.x[j + 1] - ring.x[j], ring.y[j + 1] - ring.y[j]);
        let inverse = 1.0 / (ex * ex + ey * ey).max(1e-300);
        let (rx, ry) = (load(simd, &ring.x, vertices) - ring.x[j], load(simd, &ring.y, vertices) - ring.y[j]);
        let q = ((rx * ex + ry * ey) * inverse).max(zero).min(one);
        let (px, py) = (rx - q * ex, ry - q * ey);
        let squared = px * px + py * py;
        let near = squared.simd_lt(f64x8::splat(simd, reach * reach));
        // Most pairs of the list are not so near at the moment.
        if !near.any_true() {
            return None;
        }
        // From both ends of the edge: a vertex next to either is a neighbour, however long the edge.
        let next = if j + 1 == ring.n { 0 } else { j + 1 };
        let way = load(simd, &self.way, vertices);
        let least = WAY * self.delta;
        let mut far = farther(simd, way, self.way[j], self.whole_way, least)
            & farther(simd, way, if next == 0 { 0.0 } else { self.way[next] }, self.whole_way, least);
        if let Some(most) = self.places {
            let (place, round) = (load(simd, &self.place, vertices), ring.n as f64);
            far |= farther(simd, place, j as f64, round, most) & farther(simd, place, next as f64, round, most);
        }
        let touches = near & far;
        if !touches.any_true() {
            return None;
        }
        let distance = squared.max(f64x8::splat(simd, 1e-300)).sqrt();
        let inverse = one / distance;
        Some([touches.select(reach - distance, zero), q, px * inverse, py * inverse])
    }

    #[inline(always)]
    fn add_with<S: Simd>(&self, simd: S, ring: &mut Ring) {
        for &Pair { vertices: a, edge: j } in &self.pairs {
            let Some([overlap, q, nx, ny]) = self.overlap(simd, ring, a, j, self.delta) else { continue };
            let push = overlap * self.stiffness;
            let (fx, fy) = (push * nx, push * ny);
            let x = load(simd, &ring.force_x, a) + fx;
            store(x, &mut ring.force_x, a);
            let y = load(simd, &ring.force_y, a) + fy;
            store(y, &mut ring.force_y, a);
            let (all_x, all_y) = (sum_lanes(fx), sum_lanes(fy));
            let (ahead_x, ahead_y) = (sum_lanes(q * fx), sum_lanes(q * fy));
            ring.force_x[j] -= all_x - ahead_x;
            ring.force_y[j] -= all_y - ahead_y;
            ring.force_x[j + 1] -= ahead_x;
            ring.force_y[j + 1] -= ahead_y;
        }
    }
}

/// Which of eight places along a ring, `round` long, lie farther than `least` from another.
// No closure: code that is not inlined for sure has no vector instructions of its own.
#[inline(always)]
fn farther<S: Simd>(simd: S, places: f64x8<S>, from: f64, round: f64, least: f64) -> mask64x8<S> {
    let between = (places - from).abs();
    between.min(round - between).simd_gt(f64x8::splat(simd, least))
}

/// Mean vertex.
fn mean(ring: &Ring) -> [f64; 2] {
    [&ring.x, &ring.y].map(|v| v[..ring.n].iter().sum::<f64>() / ring.n as f64)
}

/// Box around the eight edges from `start` on: `[x_min, x_max, y_min, y_max]`.
fn block_box(ring: &Ring, start: usize) -> [f64; 4] {
    let ends = |v: &[f64]| v.iter().fold([f64::MAX, f64::MIN], |[lo, hi], &c| [lo.min(c), hi.max(c)]);
    let ([x0, x1], [y0, y1]) = (ends(&ring.x[start..=start + LANES]), ends(&ring.y[start..=start + LANES]));
    [x0, x1, y0, y1]
}

impl RingForce for SelfContact {
    fn moved(&mut self, distance: f64, ring: &Ring) {
        self.slack -= 2.0 * distance;
        if self.slack >= 0.0 {
            return;
        }
        // What counts is the ring's deformation: a droplet that falls as a whole needs no new list.
        let skin = self.apart.skin(self.delta);
        let left = skin - self.deformation(ring);
        if left > 0.1 * skin { self.slack = left } else { self.list(ring) }
    }

    fn acts(&self) -> bool {
        !self.pairs.is_empty()
    }

    /// The whole list: the ways along the ring are those of when it was made.
    fn memory(&self) -> Vec<f64> {
        let n = self.listed_x.len();
        let numbers = [self.slack, self.whole_way].into_iter().chain(self.way[..n].iter().copied());
        let listed = self.listed_x.iter().chain(&self.listed_y).copied();
        let pairs = self.pairs.iter().flat_map(|pair| [pair.vertices as f64, pair.edge as f64]);
        numbers.chain(listed).chain(pairs).collect()
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        let n = self.listed_x.len();
        let Some((numbers, pairs)) = memory.split_at_checked(2 + 3 * n) else { return false };
        let (pairs, rest) = pairs.as_chunks::<2>();
        let is_pair = |&[a, j]: &[f64; 2]| {
            let within = |place: f64, end: usize| place.fract() == 0.0 && place >= 0.0 && place < end as f64;
            within(a, n) && (a as usize).is_multiple_of(LANES) && within(j, n)
        };
        if !rest.is_empty() || !pairs.iter().all(is_pair) {
            return false;
        }
        (self.slack, self.whole_way) = (numbers[0], numbers[1]);
        self.way[..n].copy_from_slice(&numbers[2..2 + n]);
        self.listed_x.copy_from_slice(&numbers[2 + n..2 + 2 * n]);
        self.listed_y.copy_from_slice(&numbers[2 + 2 * n..]);
        self.pairs = pairs.iter().map(|&[a, j]| Pair { vertices: a as usize, edge: j as usize }).collect();
        true
    }

    fn add(&self, ring: &mut Ring) {
        on_instruction_set!(self.instruction_set, simd => self.add_with(simd, ring));
    }

    fn energy(&self, ring: &Ring) -> f64 {
        let simd = Fallback::new();
        let mut energy = 0.0;
        for pair in &self.pairs {
            if let Some([overlap, ..]) = self.overlap(simd, ring, pair.vertices, pair.edge, self.delta) {
                energy += 0.5 * self.stiffness * sum_lanes(overlap * overlap);
            }
        }
        energy
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring pinched to a dumb-bell whose waist has the given half width.
    pub(super) fn dumb_bell(n: usize, waist: f64) -> Ring {
        let mut ring = Ring::regular(n, [0.0, 0.0], 0.5);
        for i in 0..n {
            let x = ring.x[i];
            ring.y[i] *= (waist + 1.5 * x * x) / 0.5;
        }
        ring.close();
        ring
    }

    #[test]
    fn a_round_ring_has_no_pairs_and_a_pinched_one_has() {
        let mut effect = SelfContact::new(100, 4e3, 0.0123, Apart::Way, InstructionSet::new());
        effect.moved(0.0, &Ring::regular(100, [0.0, 0.0], 0.5));
        assert!(!effect.acts());
        effect = SelfContact::new(100, 4e3, 0.0123, Apart::Way, InstructionSet::new());
        effect.moved(0.0, &dumb_bell(100, 0.005));
        assert!(effect.acts());
        assert!(effect.energy(&dumb_bell(100, 0.005)) > 0.0);
        assert!(effect.energy(&dumb_bell(100, 0.01)) == 0.0);
    }

    #[test]
    fn repulsion_is_minus_the_gradient_of_its_energy_and_adds_up_to_nothing() {
        for apart in [Apart::Way, Apart::Places] {
            check_gradient(&dumb_bell(96, 0.0041), apart);
        }
        // A crowd: forty vertices within three diameters.
        let mut crowd = Ring::regular(96, [0.0, 0.0], 0.5);
        for i in 0..40 {
            crowd.y[i] = crowd.y[0] + 0.001 * i as f64;
            crowd.x[i] = 0.5 - 0.002 * (i % 3) as f64;
        }
        crowd.close();
        check_gradient(&crowd, Apart::Places);
        let mut effect = SelfContact::new(96, 4e3, 0.0123, Apart::Way, InstructionSet::new());
        effect.moved(0.0, &crowd);
        assert!(effect.energy(&crowd) == 0.0, "a crowd is no fold");
    }

    fn check_gradient(ring: &Ring, apart: Apart) {
        let mut effect = SelfContact::new(96, 4e3, 0.0123, apart, InstructionSet::new());
        effect.moved(0.0, ring);
        let mut pushed = ring.clone();
        effect.add(&mut pushed);
        pushed.force_x[0] += pushed.force_x[96];
        pushed.force_y[0] += pushed.force_y[96];
        let largest = pushed.force_y[..96].iter().fold(0.0, |a: f64, f| a.max(f.abs()));
        assert!(largest > 1e-3);
        assert!(pushed.force_x[..96].iter().sum::<f64>().abs() < 1e-12 * (1.0 + largest));
        let h = 1e-7;
        for i in 0..96 {
            let energy_at = |dx: f64, dy: f64| {
                let mut moved = ring.clone();
                moved.x[i] += dx;
                moved.y[i] += dy;
                moved.close();
                effect.energy(&moved)
            };
            let slope_x = (energy_at(h, 0.0) - energy_at(-h, 0.0)) / (2.0 * h);
            let slope_y = (energy_at(0.0, h) - energy_at(0.0, -h)) / (2.0 * h);
            assert!((pushed.force_x[i] + slope_x).abs() < 1e-6 * largest, "{apart:?}, vertex {i}");
            assert!((pushed.force_y[i] + slope_y).abs() < 1e-6 * largest, "{apart:?}, vertex {i}");
        }
    }
}

//! The ring repels itself where it folds back: `U = sum (k/2)(delta - d)^2` over vertices and edges that lie apart
//! along the ring and closer than `delta` in the plane.
//!
//! `d` is the distance of a vertex from an edge. This covers edges against edges too: two edges in the plane that do not
//! cross are nearest at an end of one of them. `apart` has two rules for what lies apart along the ring, which differ
//! for piles of vertices.
//!
//! Blocks of eight vertices are paired with each edge that comes close to one of them. The list of pairs is made again
//! whenever the droplet has deformed by the skin. A ring without folds has no pairs, and costs only a comparison of
//! the boxes around its blocks at these times. The ways along the ring are measured when the list is made. So the
//! results depend on when that was, and the list is part of the droplet's saved state.

mod along;
pub(crate) mod apart;
mod boxes;
mod crossing;
mod pairs;

pub(crate) use crossing::crosses;

use crate::on_instruction_set;
use crate::physics::ring::forces::stiffness::Stiffness;
use crate::physics::ring::{Ring, forces::RingForce};
use crate::physics::simd::{InstructionSet, LANES, load, store, sum_lanes};
use crate::physics::walls::neighbours::Neighbours;
use along::Along;
use apart::Apart;
use fearless_simd::{Fallback, f64x8, prelude::*};
use pairs::{Listed, Pair};

#[derive(Clone, Debug)]
pub(crate) struct SelfContact {
    instruction_set: InstructionSet,
    /// k of a vertex against an edge.
    stiffness: f64,
    delta: f64,
    near: Neighbours<Pair>,
    listed: Listed,
    along: Along,
}

impl SelfContact {
    /// Repulsion within `delta`; the total stiffness is `N_v k`.
    pub(crate) fn new(
        n_vertices: usize,
        total_stiffness: f64,
        delta: f64,
        apart: Apart,
        instruction_set: InstructionSet,
    ) -> Self {
        Self {
            instruction_set,
            stiffness: total_stiffness / n_vertices as f64,
            delta,
            near: Neighbours::new(apart.skin(delta)),
            listed: Listed::nowhere(n_vertices),
            along: Along::new(n_vertices, delta, apart),
        }
    }

    /// How eight vertices overlap with edge `j` within `reach`: the overlap, the place q on the edge, and the unit
    /// normal from edge to vertex. `None` if they do not.
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
        if !near.any_true() {
            return None;
        }
        let touches = near & self.along.apart(simd, vertices, j, ring.n);
        if !touches.any_true() {
            return None;
        }
        let distance = squared.max(f64x8::splat(simd, 1e-300)).sqrt();
        let inverse = one / distance;
        Some([touches.select(reach - distance, zero), q, px * inverse, py * inverse])
    }

    #[inline(always)]
    fn add_with<S: Simd>(&self, simd: S, ring: &mut Ring) {
        for &Pair { vertices: a, edge: j } in &self.near.items {
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

    /// Adds `k n n^T` to the blocks of each vertex that touches an edge, and its share by the lever rule to those of the
    /// edge.
    #[inline(always)]
    fn add_own_stiffness_with<S: Simd>(&self, simd: S, ring: &Ring, m: &mut Stiffness) {
        let (zero, one, k) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0), f64x8::splat(simd, self.stiffness));
        for &Pair { vertices: a, edge: j } in &self.near.items {
            let Some([overlap, q, nx, ny]) = self.overlap(simd, ring, a, j, self.delta) else { continue };
            let k = overlap.simd_gt(zero).select(k, zero);
            let (xx, xy, yy) = (k * nx * nx, k * nx * ny, k * ny * ny);
            let (first, both, second) = ((one - q) * (one - q), q * (one - q), q * q);
            for (own, of) in [(&mut m.own_xx, xx), (&mut m.own_xy, xy), (&mut m.own_yy, yy)] {
                store(load(simd, own, a) + of, own, a);
                own[j] += sum_lanes(first * of);
                own[j + 1] += sum_lanes(second * of);
            }
            for (next, of) in [(&mut m.next_xx, xx), (&mut m.next_xy, xy), (&mut m.next_yx, xy), (&mut m.next_yy, yy)] {
                next[j] += sum_lanes(both * of);
            }
        }
    }
}

impl RingForce for SelfContact {
    fn moved(&mut self, distance: f64, ring: &Ring) {
        // Twice, because a vertex and an edge may move towards each other. Pairs hold numbers, so the origin does not
        // matter.
        if !self.near.skin.moved(2.0 * distance) {
            return;
        }
        // Only deformation counts: a droplet that falls without deforming needs no new list.
        let skin = self.near.skin.width;
        let left = skin - self.listed.deformation(ring);
        if left > 0.1 * skin { self.near.skin.left = left } else { self.list(ring) }
    }

    fn acts(&self) -> bool {
        !self.near.items.is_empty()
    }

    /// The list of pairs, the skin that is left, and the ways and places of the vertices when the list was made.
    fn memory(&self) -> Vec<f64> {
        let Self { near, listed, along, .. } = self;
        let n = listed.x.len();
        let numbers = [near.skin.left, along.whole_way].into_iter().chain(along.way[..n].iter().copied());
        let places = listed.x.iter().chain(&listed.y).copied();
        let pairs = near.items.iter().flat_map(|pair| [pair.vertices as f64, pair.edge as f64]);
        numbers.chain(places).chain(pairs).collect()
    }

    fn recall(&mut self, memory: &[f64]) -> bool {
        let n = self.listed.x.len();
        let Some((numbers, pairs)) = memory.split_at_checked(2 + 3 * n) else { return false };
        let (pairs, rest) = pairs.as_chunks::<2>();
        let is_pair = |&[a, j]: &[f64; 2]| {
            let within = |place: f64, end: usize| place.fract() == 0.0 && place >= 0.0 && place < end as f64;
            within(a, n) && (a as usize).is_multiple_of(LANES) && within(j, n)
        };
        if !rest.is_empty() || !pairs.iter().all(is_pair) {
            return false;
        }
        (self.near.skin.left, self.along.whole_way) = (numbers[0], numbers[1]);
        self.along.way[..n].copy_from_slice(&numbers[2..2 + n]);
        self.listed.x.copy_from_slice(&numbers[2 + n..2 + 2 * n]);
        self.listed.y.copy_from_slice(&numbers[2 + 2 * n..]);
        self.near.items = pairs.iter().map(|&[a, j]| Pair { vertices: a as usize, edge: j as usize }).collect();
        true
    }

    fn add(&self, ring: &mut Ring) {
        on_instruction_set!(self.instruction_set, simd => self.add_with(simd, ring));
    }

    fn add_own_stiffness(&self, ring: &Ring, stiffness: &mut Stiffness) {
        on_instruction_set!(self.instruction_set, simd => self.add_own_stiffness_with(simd, ring, stiffness));
    }

    fn has_stiffness(&self) -> bool {
        false
    }

    fn energy(&self, ring: &Ring) -> f64 {
        let simd = Fallback::new();
        let mut energy = 0.0;
        for pair in &self.near.items {
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

    #[test]
    fn own_stiffness_is_how_the_force_on_a_vertex_falls_when_it_alone_gives_way() {
        let ring = dumb_bell(96, 0.0041);
        let mut effect = SelfContact::new(96, 4e3, 0.0123, Apart::Way, InstructionSet::new());
        effect.moved(0.0, &ring);
        let mut own = Stiffness::new(96);
        effect.add_own_stiffness(&ring, &mut own);
        own.fold();
        let force = |i: usize, dy: f64| {
            let mut moved = ring.clone();
            moved.y[i] += dy;
            moved.close();
            effect.add(&mut moved);
            moved.force_y[i]
        };
        // In the middle of the waist the normal points along y, and nothing turns.
        let middle = (0..96).filter(|i| ring.x[*i].abs() < 0.02);
        let checked = middle.inspect(|&i| {
            let falls = (force(i, -1e-7) - force(i, 1e-7)) / 2e-7;
            assert!(falls > 10.0 && (own.own_yy[i] / falls - 1.0).abs() < 0.02, "{i}: {} {falls}", own.own_yy[i]);
        });
        assert!(checked.count() >= 2);
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

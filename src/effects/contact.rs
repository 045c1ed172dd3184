//! Contact of the ring's edges with discs: `U = sum (k_w/2)(delta/2 - d)^2` over edges with `d < delta/2`
//! ([C24] eq. 3, on edges), `k_w = E_w/N_v`.
//!
//! `d` is the distance from the nearest point of the edge to the disc's surface, negative inside it. That point
//! divides the edge at `q` in [0, 1], and the force is shared `1 - q` to `q` between the edge's vertices.
//!
//! Only stretches of the ring with a disc in reach are looked at. A stretch is a run of blocks of eight edges; the
//! list holds until some vertex has moved by the skin. Discs are visited in the order of their ids, and edges out of
//! reach add exact zeros, so no result depends on when the list was made.

use crate::droplet::deformable::Ring;
use crate::scene::obstacles::{Disc, ObstacleArray};
use crate::vector::{LANES, load, padded, store};
use fearless_simd::{f64x8, prelude::*};

/// How far a vertex may move before the list is made again, in sigma.
const SKIN: f64 = 0.02;

/// Edges of the ring that a disc may touch before the next rebuild.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stretch {
    disc: Disc,
    /// First edge, a multiple of eight.
    start: usize,
    /// End, a multiple of eight.
    end: usize,
}

/// The contact effect and its neighbour list.
#[derive(Clone, Debug)]
pub struct Contact {
    /// k_w of each edge, zero in the padding.
    stiffness: Vec<f64>,
    /// Distance of an edge from the centre of a disc below which they touch, `R_ob + delta/2`.
    reach: f64,
    stretches: Vec<Stretch>,
    /// Distance that the fastest vertex may still go.
    slack: f64,
    fresh_origin: [f64; 2],
}

/// What the contacts of a ring amount to at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactState {
    /// Energy.
    pub energy: f64,
    /// Deepest overlap `delta/2 - d`.
    pub overlap: f64,
    /// Number of discs that carry load.
    pub loaded: u32,
}

impl Contact {
    /// Contact of a ring of `n_vertices` and total stiffness `e_w` with discs of radius `disc_radius`.
    pub fn new(n_vertices: usize, e_w: f64, delta: f64, disc_radius: f64) -> Self {
        let mut stiffness = vec![0.0; padded(n_vertices)];
        stiffness[..n_vertices].fill(e_w / n_vertices as f64);
        Self {
            stiffness,
            reach: disc_radius + 0.5 * delta,
            stretches: Vec::new(),
            slack: f64::NEG_INFINITY,
            fresh_origin: [f64::NAN; 2],
        }
    }

    /// Whether any disc is in reach; if not, the contact pass can be skipped.
    #[inline(always)]
    pub fn in_reach(&self) -> bool {
        !self.stretches.is_empty()
    }

    /// Takes note that the fastest vertex moved by at most `distance`; makes the list again when it may be stale.
    #[inline(always)]
    pub fn moved(&mut self, distance: f64, ring: &Ring, discs: &ObstacleArray) {
        self.slack -= distance;
        // Written so that a NaN, too, leads to a rebuild.
        if !(self.slack >= 0.0) {
            self.rebuild(ring, discs);
        }
    }

    /// Makes the list again if the ring's origin has moved since.
    pub fn follow(&mut self, ring: &Ring, discs: &ObstacleArray) {
        if self.fresh_origin != ring.origin {
            self.rebuild(ring, discs);
        }
    }

    /// Makes the list of stretches that any disc could touch while no vertex moves further than the skin.
    #[inline(never)]
    fn rebuild(&mut self, ring: &Ring, discs: &ObstacleArray) {
        self.slack = SKIN;
        self.fresh_origin = ring.origin;
        self.stretches.clear();
        let [x0, x1, y0, y1] = ring.bounds();
        let far = self.reach + SKIN;
        // A ring that has burst would ask for the whole box.
        if !((x1 - x0) + (y1 - y0) < 1e3) {
            return;
        }
        let mut near = Vec::new();
        discs.for_each_in(ring.origin, [x0 - far, x1 + far, y0 - far, y1 + far], |disc| near.push(disc));
        near.sort_by_key(|disc| disc.id);
        for disc in near {
            let mut open = false;
            for start in (0..self.stiffness.len()).step_by(LANES) {
                let close = (start..(start + LANES).min(ring.n)).any(|i| distance_squared(ring, i, disc).1 < far * far);
                match (close, open) {
                    (true, false) => self.stretches.push(Stretch { disc, start, end: start + LANES }),
                    (true, true) => self.stretches.last_mut().into_iter().for_each(|s| s.end = start + LANES),
                    _ => {}
                }
                open = close;
            }
        }
    }

    /// Sets the contact forces of the ring, whose edge vectors must be up to date.
    #[inline(always)]
    pub fn apply<S: Simd>(&self, simd: S, ring: &mut Ring) {
        let zero = f64x8::splat(simd, 0.0);
        let one = f64x8::splat(simd, 1.0);
        ring.contact_x.fill(0.0);
        ring.contact_y.fill(0.0);
        for stretch in &self.stretches {
            let mut i = stretch.start;
            while i < stretch.end {
                let (ex, ey) = (load(simd, &ring.edge_x, LANES + i), load(simd, &ring.edge_y, LANES + i));
                // From the disc's centre to vertex i, then to the nearest point of the edge.
                let rx = load(simd, &ring.x, i) - stretch.disc.x;
                let ry = load(simd, &ring.y, i) - stretch.disc.y;
                let length_squared = (ex * ex + ey * ey).max(f64x8::splat(simd, 1e-300));
                let q = (-(rx * ex + ry * ey) / length_squared).max(zero).min(one);
                let (px, py) = (rx + q * ex, ry + q * ey);
                let d2 = px * px + py * py;
                if d2.simd_lt(f64x8::splat(simd, self.reach * self.reach)).any_true() {
                    let distance = d2.sqrt();
                    let overlap = (self.reach - distance).max(zero);
                    let push = load(simd, &self.stiffness, i) * overlap / distance.max(f64x8::splat(simd, 1e-300));
                    let (fx, fy) = (push * px, push * py);
                    let (qfx, qfy) = (q * fx, q * fy);
                    let x0 = load(simd, &ring.contact_x, i) + (fx - qfx);
                    store(x0, &mut ring.contact_x, i);
                    let y0 = load(simd, &ring.contact_y, i) + (fy - qfy);
                    store(y0, &mut ring.contact_y, i);
                    let x1 = load(simd, &ring.contact_x, i + 1) + qfx;
                    store(x1, &mut ring.contact_x, i + 1);
                    let y1 = load(simd, &ring.contact_y, i + 1) + qfy;
                    store(y1, &mut ring.contact_y, i + 1);
                }
                i += LANES;
            }
        }
        let n = ring.n;
        ring.contact_x[0] += ring.contact_x[n];
        ring.contact_y[0] += ring.contact_y[n];
    }

    /// Energy, overlap and number of loaded discs at the present positions.
    pub fn state(&self, ring: &Ring) -> ContactState {
        let mut state = ContactState::default();
        let mut last_loaded = None;
        for stretch in &self.stretches {
            for i in stretch.start..stretch.end.min(ring.n) {
                let overlap = self.reach - distance_squared(ring, i, stretch.disc).1.sqrt();
                if overlap > 0.0 {
                    state.energy += 0.5 * self.stiffness[i] * overlap * overlap;
                    state.overlap = state.overlap.max(overlap);
                    if last_loaded != Some(stretch.disc.id) {
                        last_loaded = Some(stretch.disc.id);
                        state.loaded += 1;
                    }
                }
            }
        }
        state
    }

    /// A disc whose centre lies inside the ring, if there is one.
    pub fn engulfed(&self, ring: &Ring, discs: &ObstacleArray) -> Option<Disc> {
        let [x0, x1, y0, y1] = ring.bounds();
        let mut found = None;
        discs.for_each_in(ring.origin, [x0, x1, y0, y1], |disc| {
            if found.is_none() && ring.contains(disc.x, disc.y) {
                found = Some(disc);
            }
        });
        found
    }
}

/// Where on edge `i` its nearest point to the disc's centre lies, and the square of their distance.
fn distance_squared(ring: &Ring, i: usize, disc: Disc) -> (f64, f64) {
    let (ex, ey) = (ring.x[i + 1] - ring.x[i], ring.y[i + 1] - ring.y[i]);
    let (rx, ry) = (ring.x[i] - disc.x, ring.y[i] - disc.y);
    let q = (-(rx * ex + ry * ey) / (ex * ex + ey * ey).max(1e-300)).clamp(0.0, 1.0);
    let (px, py) = (rx + q * ex, ry + q * ey);
    (q, px * px + py * py)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_holds_every_edge_that_touches_within_the_skin() {
        let n = 100;
        let discs = ObstacleArray::from_centres(20.0, 0.15, &[10.5, 10.0, 9.0], &[10.3, 9.4, 10.0]);
        let ring = Ring::regular(n, [10.0, 10.0], 0.5);
        let mut contact = Contact::new(n, 1e4, 0.0123, 0.15);
        contact.moved(0.0, &ring, &discs);
        for k in 0..64 {
            let (sin, cos) = libm::sincos(0.1 * f64::from(k));
            let mut moved = ring.clone();
            moved.x.iter_mut().for_each(|x| *x += 0.999 * SKIN * cos);
            moved.y.iter_mut().for_each(|y| *y += 0.999 * SKIN * sin);
            let mut fresh = Contact::new(n, 1e4, 0.0123, 0.15);
            fresh.moved(0.0, &moved, &discs);
            assert_eq!(contact.state(&moved), fresh.state(&moved));
        }
    }

    #[test]
    fn a_disc_inside_the_ring_is_found() {
        let discs = ObstacleArray::from_centres(20.0, 0.15, &[10.1], &[10.05]);
        let contact = Contact::new(64, 1e4, 0.0123, 0.15);
        assert!(contact.engulfed(&Ring::regular(64, [10.0, 10.0], 0.5), &discs).is_some());
        assert!(contact.engulfed(&Ring::regular(64, [10.7, 10.0], 0.5), &discs).is_none());
    }
}

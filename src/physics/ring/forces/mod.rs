//! The forces on a droplet, one file each.
//!
//! An effect is a small type that knows its formula. One that a scene does not call for is not in the loop: the kernels
//! ([`crate::physics::ring::passes`]) are compiled with and without edge lengths, pushes of walls and drag of its own for each vertex, and
//! the one that fits is taken. `kappa = 0` leaves [`tension::Tension`] alone, `kappa = 1/(N_v l0)` becomes [`tension::LinearTension`] without root or division.
//!
//! # Writing your own
//! A force along the edges of the ring implements [`EdgeForce`]: its tension, and its energy.
//! Pairs of edge forces are edge forces: `(a, b)` acts with the sum of both. Any other force on the ring implements
//! [`RingForce`], a drag [`Drag`].

pub mod area;
pub mod contact;
pub mod far_drag;
pub mod gravity;
pub mod hydrostatic;
pub mod near_wall_drag;
pub mod perimeter;
pub mod self_contact;
pub mod stiffness;
pub mod tension;

use crate::physics::ring::Ring;
use crate::physics::simd::{Instructions, fma, load};
use fearless_simd::{f64x8, prelude::*};
use stiffness::{Parts, Stiffness};

/// A tension along each edge, a function of the smoothed edge length `l_eps = sqrt(l^2 + eps^2)`:
/// `T = constant + per_length l_eps`.
pub trait EdgeForce: Copy + Send + Sync + 'static {
    /// The two numbers of the tension.
    fn law(self) -> TensionLaw;

    /// Energy of one edge of smoothed length `l_eps`.
    fn energy(self, length: f64) -> f64;
}

/// `T = constant + per_length l_eps`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TensionLaw {
    /// What does not depend on the length.
    pub constant: f64,
    /// What grows with it.
    pub per_length: f64,
}

impl TensionLaw {
    /// Whether there is a constant part; a spring of zero rest length has none, and needs no edge lengths.
    pub fn needs_length(self) -> bool {
        self.constant != 0.0
    }

    /// `T/l_eps` from `1/l_eps`, eight edges at a time: the edge pulls its first vertex with `T/l_eps` times the edge
    /// vector, and its second with the opposite.
    #[inline(always)]
    pub fn coefficient<S: Instructions>(self, simd: S, inverse_length: f64x8<S>) -> f64x8<S> {
        fma(inverse_length, f64x8::splat(simd, self.constant), f64x8::splat(simd, self.per_length))
    }

    /// `(1/l_eps) d(T/l_eps)/dl_eps` from `1/l_eps`; with the edge vector e, the second derivative of the energy is
    /// `T/l_eps + slope e e^T`. Read by the implicit integrator alone.
    #[inline(always)]
    pub fn slope<S: Simd>(self, inverse_length: f64x8<S>) -> f64x8<S> {
        inverse_length * inverse_length * inverse_length * -self.constant
    }
}

/// No force along the edges.
impl EdgeForce for () {
    fn law(self) -> TensionLaw {
        TensionLaw::default()
    }

    fn energy(self, _: f64) -> f64 {
        0.0
    }
}

impl<A: EdgeForce, B: EdgeForce> EdgeForce for (A, B) {
    fn law(self) -> TensionLaw {
        let (a, b) = (self.0.law(), self.1.law());
        TensionLaw { constant: a.constant + b.constant, per_length: a.per_length + b.per_length }
    }

    fn energy(self, length: f64) -> f64 {
        self.0.energy(length) + self.1.energy(length)
    }
}

/// A force that is not of the ring's own elasticity: of walls, of the ring on itself, of hydrostatic pressure.
///
/// It adds to `ring.force_x`, `ring.force_y`, and is left out of the step while it [acts](Self::acts) on nothing.
pub trait RingForce: Send + Sync + std::fmt::Debug {
    /// Takes note that no vertex moved further than `distance`; makes lists again that may be stale.
    fn moved(&mut self, distance: f64, ring: &Ring);

    /// Whether it can act before the lists are made again.
    fn acts(&self) -> bool;

    /// Adds its forces; the ring's edge vectors are up to date.
    fn add(&self, ring: &mut Ring);

    /// Its energy at the present positions.
    fn energy(&self, ring: &Ring) -> f64;

    /// Takes note of what it pushes where an implicit step has ended.
    fn settled(&mut self, _ring: &Ring) {}

    /// Holds on to what it pushed when the ring last settled, as springs that also pull, until it is to [let go](Self::let_go).
    /// False, and nothing done, if all of that is still pushed: then there is nothing to hold.
    fn hold(&mut self, _ring: &Ring) -> bool {
        false
    }

    /// Pulls on nothing any more.
    fn let_go(&mut self) {}

    /// What it keeps from earlier steps that the positions do not tell and later bits depend on.
    fn memory(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes a [memory](Self::memory) over, once its lists are made; false if it never wrote that.
    fn recall(&mut self, memory: &[f64]) -> bool {
        memory.is_empty()
    }

    /// Adds the second derivatives of its energy. Without them the implicit integrator takes the force as given at each of
    /// its iterations, which converges only while the force is softer than `m/dt^2`.
    fn add_stiffness(&self, _ring: &Ring, _parts: Parts, _stiffness: &mut Stiffness) {}
}

/// A viscous force `-m lambda_i v_i` on each vertex, taken implicitly.
pub trait Drag: Send + Sync + std::fmt::Debug + 'static {
    /// Brings the damping rates up to date with the ring, whose vertices moved by at most `distance`.
    fn update(&mut self, distance: f64, ring: &Ring);

    /// Damping rates `lambda` of the vertices, in 1/t0.
    fn rates(&self) -> Rates<'_>;
}

/// Damping rates of the vertices of a ring.
#[derive(Clone, Copy, Debug)]
pub enum Rates<'a> {
    /// One for all.
    Even(f64),
    /// One for each, padded to whole vectors.
    Each(&'a [f64]),
}

impl Rates<'_> {
    /// Rate of vertex `i`.
    pub fn at(self, i: usize) -> f64 {
        match self {
            Self::Even(rate) => rate,
            Self::Each(rates) => rates[i],
        }
    }

    /// Rates of the eight vertices from `i` on.
    #[inline(always)]
    pub fn load<S: Simd>(self, simd: S, i: usize) -> f64x8<S> {
        match self {
            Self::Even(rate) => f64x8::splat(simd, rate),
            Self::Each(rates) => load(simd, rates, i),
        }
    }
}

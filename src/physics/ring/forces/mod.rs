//! The forces on a droplet, one file each.
//!
//! An effect is a small type that knows its formula. Which effects a droplet has is decided when its job starts.
//! Effects that are not needed cost nothing: the passes over the ring (`ring/passes.rs`) are compiled with and without
//! edge lengths, forces of walls, and separate drag rates of the vertices.
//!
//! # Writing your own
//! A force along the edges is a variant of [`tension::EdgeTension`]: a tension that is linear in the edge length, and
//! its energy. A drag is a variant of [`drag::Drag`]. Any other force on the ring implements [`RingForce`].

pub mod area;
pub mod contact;
pub mod drag;
pub mod gravity;
pub mod hydrostatic;
pub mod near_wall_drag;
pub mod self_contact;
pub mod stiffness;
pub mod tension;

use crate::physics::ring::Ring;
use stiffness::{Parts, Stiffness};

/// A force other than the elasticity and weight of the ring: that of walls, of the ring on itself, of hydrostatic
/// pressure. It adds to `ring.force_x`, `ring.force_y`, and is left out of the step while it does not
/// [act](Self::acts).
pub trait RingForce: Send + Sync + std::fmt::Debug {
    /// Notes that no vertex moved further than `distance`, and makes the lists again that may be stale.
    fn moved(&mut self, distance: f64, ring: &Ring);

    /// Whether the force can be other than zero before the lists are made again.
    fn acts(&self) -> bool;

    /// Adds the forces; the ring's edge vectors are up to date.
    fn add(&self, ring: &mut Ring);

    /// The energy at the present positions.
    fn energy(&self, ring: &Ring) -> f64;

    /// Notes which contacts push at the end of an implicit step.
    fn settled(&mut self, _ring: &Ring) {}

    /// Holds the contacts that pushed at the end of the last implicit step: until [`let_go`](Self::let_go) their
    /// springs also pull. False, and nothing changes, if all of them still push.
    fn hold(&mut self, _ring: &Ring) -> bool {
        false
    }

    /// Ends the holding.
    fn let_go(&mut self) {}

    /// What is kept from earlier steps, decides later bits, and does not follow from the positions.
    fn memory(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes over a [memory](Self::memory), after the lists were made; false if the memory does not fit.
    fn recall(&mut self, memory: &[f64]) -> bool {
        memory.is_empty()
    }

    /// Adds the second derivatives of the energy. If a force leaves them out, the implicit integrator keeps the force
    /// constant within each iteration, which converges only if it is softer than `m/dt^2`.
    fn add_stiffness(&self, _ring: &Ring, _parts: Parts, _stiffness: &mut Stiffness) {}

    /// Adds second derivatives that stand in for those that [`add_stiffness`](Self::add_stiffness) leaves out, because they
    /// couple vertices that are not neighbours: of each vertex and each edge as if the rest stood still. Newton's method
    /// then converges linearly. Only steps that follow their error take them.
    fn add_own_stiffness(&self, _ring: &Ring, _stiffness: &mut Stiffness) {}

    /// Whether [`add_stiffness`](Self::add_stiffness) supplies second derivatives.
    fn has_stiffness(&self) -> bool {
        true
    }
}

//! The forces on a droplet, one file each.
//!
//! An effect is a small type that knows its formula. Which effects a droplet has is settled when its job starts, by
//! plain data that each pass over the ring (`ring/passes.rs`) reads once. An effect that a scene does
//! not call for is not in the loop: the passes are compiled with and without edge lengths, forces of walls, and a drag
//! of its own for each vertex, and the one that fits is taken.
//!
//! # Writing your own
//! A force along the edges is a case of [`tension::EdgeTension`]: a tension that is linear in the edge length, and its
//! energy. A drag is a case of [`drag::Drag`]. Any other force on the ring implements [`RingForce`].

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

    /// Holds on to what it pushed when the ring last settled: those pushes become springs that also pull, until it is
    /// told to [let go](Self::let_go). False, and nothing is done, if it still pushes all of them.
    fn hold(&mut self, _ring: &Ring) -> bool {
        false
    }

    /// Stops pulling on what it held.
    fn let_go(&mut self) {}

    /// What it keeps from earlier steps that later bits depend on and that the positions do not tell.
    fn memory(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes over a [memory](Self::memory) after its lists were made; false if it could not have written it.
    fn recall(&mut self, memory: &[f64]) -> bool {
        memory.is_empty()
    }

    /// Adds the second derivatives of its energy. An effect that leaves them out is taken by the implicit integrator as
    /// a given force at each iteration, which converges only while the force is softer than `m/dt^2`.
    fn add_stiffness(&self, _ring: &Ring, _parts: Parts, _stiffness: &mut Stiffness) {}
}

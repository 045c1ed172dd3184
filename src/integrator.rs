//! How time advances, and how a droplet is put in place.

pub mod cyclic;
pub mod guard;
pub mod implicit;
pub mod memory;
pub mod relax;
mod ring_passes;
pub mod step_control;
pub mod verlet;

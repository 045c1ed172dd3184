//! How time advances, and how a droplet is put in place.

pub mod cyclic;
pub mod implicit;
pub mod relax;
pub mod verlet;

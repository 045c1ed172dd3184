//! How time advances, and how a droplet is put in place.

pub mod relax;
pub mod verlet;

//! What droplets lean on, and where it stands.

pub mod arrays;
pub mod disc;
pub mod plate;
pub mod wall;
pub mod wedge;

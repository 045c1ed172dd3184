//! Where droplets move.

pub mod channel;
pub mod library;
pub mod obstacles;
mod packing;
pub mod plate;
pub mod wall;

//! Where droplets move.

pub mod channel;
mod darts;
pub mod disc;
mod growth;
pub mod library;
pub mod obstacles;
mod packing;
pub mod plate;
mod saturated;
mod tile;
pub mod wall;

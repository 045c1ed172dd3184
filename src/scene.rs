//! Where droplets move.

pub mod library;
pub mod obstacles;

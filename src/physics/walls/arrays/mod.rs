//! How the obstacles of an array get their places.

mod darts;
mod growth;
pub mod library;
pub mod obstacles;
mod packing;
mod saturated;
mod tile;

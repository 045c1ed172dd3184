//! The obstacles of a scene, and where they stand.
//!
//! This folder knows parameters, results and [`simd`](crate::physics::simd), but nothing of droplets. Read [`wall`]
//! first: it says what an obstacle must provide, and how to write your own. [`disc`], [`wedge`] and [`plate`] are the
//! obstacles with their formulas, and [`arrays`] places discs at random.

pub mod arrays;
pub mod disc;
pub(crate) mod neighbours;
pub mod plate;
pub mod wall;
pub mod wedge;

//! What droplets lean on, and where it stands.
//!
//! This folder knows parameters, results and [`simd`](crate::physics::simd), but nothing of droplets. Read [`wall`]
//! first: it says what an obstacle must be able to tell, and how to write your own.
//!
//! | module | idea |
//! |---|---|
//! | [`wall`] | the traits: an obstacle, and the walls of a scene |
//! | [`disc`], [`wedge`], [`plate`] | the obstacles, with their formulas |
//! | `neighbours` | lists of what is near, and how long they hold |
//! | [`arrays`] | how the discs of an array get their places |

pub mod arrays;
pub mod disc;
pub(crate) mod neighbours;
pub mod plate;
pub mod wall;
pub mod wedge;

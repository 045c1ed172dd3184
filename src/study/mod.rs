//! From results to answers: rows in, tables out. There is no SQL here, no file is opened, and no clock is asked.
//!
//! This layer knows parameters, results, physics and campaigns. It stands below the store, so that a campaign that runs
//! can ask whether a grid point needs another round of seeds.
//!
//! | module | question |
//! |---|---|
//! | [`survival`] | how far does a droplet get before it clogs? |
//! | [`speed`] | how fast does it flow? |
//! | [`fits`] | both, of every grid point at once |
//! | [`accuracy`] | how wrong are the numbers, and what does a better one cost? |
//! | [`calibrate`] | which line tension and near-wall drag has a droplet that was filmed? |
//!
//! Read [`survival`] first. Every answer depends on its runs alone, not on their order nor on the number of threads:
//! runs are sorted first, and the bootstrap draws from ChaCha8 with a fixed seed.

pub mod accuracy;
mod bisection;
pub mod calibrate;
pub mod fits;
mod random;
pub mod speed;
pub mod survival;

//! From results to answers: rows in, tables out. Nothing here touches SQL, files or the clock.
//!
//! This layer knows parameters, results, physics and campaigns.
//!
//! | module | question |
//! |---|---|
//! | [`survival`] | how far does a droplet get before it clogs? |
//! | [`speed`] | how fast does it flow? |
//! | [`fits`] | both, for every grid point |
//! | [`series`] | which points differ in one parameter alone? |
//! | [`compare`] | by how much do two points differ, seed by seed? |
//! | [`accuracy`] | how wrong are the numbers, and what does a better one cost? |
//! | [`calibrate`] | what are the line tension and the near-wall drag of a droplet that was filmed? |
//! | [`threshold`] | up to which line tension does it pass a narrow place, by statics alone? |
//!
//! Read [`survival`] first. No answer depends on the order of the runs or on the number of threads: runs are sorted
//! first, and the bootstrap draws from ChaCha8 with a fixed seed.

pub mod accuracy;
mod bisection;
pub mod calibrate;
pub mod compare;
pub mod fits;
mod random;
pub mod series;
pub mod speed;
mod studentised;
pub mod survival;
pub mod threshold;

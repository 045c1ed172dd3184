//! From results to answers: rows in, tables out; no SQL, no files, no clock.
//!
//! This layer knows parameters, results, physics and campaigns. Read [`survival`] first.
//!
//! | folder | question |
//! |---|---|
//! | [`survival`] | how far does a droplet get before it clogs? |
//! | [`speed`] | how fast does it flow? |
//! | [`accuracy`] | how wrong are the numbers, and what does a better one cost? |
//! | [`calibrate`] | which line tension and near-wall drag has a droplet that was filmed? |

pub mod accuracy;
pub mod calibrate;
mod random;
pub mod speed;
pub mod survival;

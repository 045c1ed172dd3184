//! From a campaign file to a plan: which jobs there are, with which integrator and step, and what they cost. Pure: no store,
//! no clock.
//!
//! This layer knows parameters, results and physics. Read [`file`] first, then [`plan`].
//!
//! | folder | idea |
//! |---|---|
//! | [`file`] | TOML to a valid campaign, all mistakes at once |
//! | [`choose`] | which integrator, step and number of vertices a point takes where the file leaves them open |
//! | [`plan`] | campaign and what a store holds -> jobs, effects, cost |
//! | `durations` | times as people write and read them, in plans and on the command line |

pub mod choose;
pub(crate) mod durations;
pub mod file;
pub mod plan;

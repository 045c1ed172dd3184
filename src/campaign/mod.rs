//! From a campaign file to a plan: which jobs there are, with which integrator and step, and what they cost. All of it
//! is pure: it knows no store and no clock, and only [`file::Campaign::load`] touches a file.
//!
//! This layer knows parameters, results and physics. Read [`file`] first, then [`plan`].
//!
//! | module | idea |
//! |---|---|
//! | [`file`] | TOML to a valid campaign, all mistakes at once |
//! | [`choose`] | which integrator, step and number of vertices a point takes where the file leaves them open |
//! | `checks` | what a grid point must satisfy, wherever it comes from |
//! | `memory` | what a run takes of it at most |
//! | [`plan`] | campaign and what a store holds -> jobs, effects, cost |
//! | `parallel` | work divided among the cores, also where the system gives no threads |
//! | `durations` | times as people write and read them, in plans and on the command line |

pub(crate) mod checks;
pub mod choose;
pub(crate) mod durations;
pub mod file;
mod memory;
pub(crate) mod parallel;
pub mod plan;

//! The whole of a run: what is planned against a store is computed on all cores, round after round, and kept.
//!
//! This layer knows everything but reports and the command line. Deciding is pure ([`schedule`], [`rounds`]); acting is
//! thin. Read [`executor`] first.

pub mod executor;
mod keeping;
pub mod machine_speed;
pub mod replay;
pub mod rounds;
mod saved;
pub mod schedule;

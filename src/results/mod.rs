//! What a run produced, and what is fitted to many runs: plain data, no behaviour.
//!
//! This layer knows the parameters and nothing else. Physics fills it, the store keeps it, studies read it.
//! Read [`trajectory`] first.

pub mod fits;
pub mod outline;
pub mod trajectory;

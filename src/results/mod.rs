//! What a run produced, and what is fitted to many runs.
//!
//! This layer is plain data. It knows the parameters and nothing else; physics fills it, the store keeps it, studies
//! and reports read it. The only functions here are laws of the data themselves: the name of an outcome in tables and
//! files, the geometry of an outline, whether its numbers are finite.
//!
//! Read [`trajectory`] first: the result of one run, or its failure. An [`outline`] is the droplet at one instant, and
//! [`fits`] are the rows that a study makes of all the runs of a grid point.

pub mod fits;
pub mod outline;
pub mod trajectory;

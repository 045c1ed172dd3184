//! What a run produced, and what is fitted to many runs. A *run* in this layer is the computation of one trajectory.
//!
//! This layer is plain data and imports only the parameters. Physics fills it, the store keeps it, studies and reports
//! read it. Its few functions concern the data themselves: names in tables and files, the geometry of an outline.
//!
//! Read [`trajectory`] first: the result of one run, or its failure. An [`outline`] is the droplet at one instant, and
//! [`fits`] holds the rows that studies make of all runs of a grid point.

pub mod fits;
pub mod outline;
pub mod trajectory;

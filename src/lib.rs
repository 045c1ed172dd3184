//! `meniscus`: campaigns of droplet simulations, and the store that keeps their results.
//!
//! The modules are layers. Each imports only from those above it in this list:
//!
//! | layer | what it is |
//! |---|---|
//! | [`parameters`] | what a job is: a grid point, a seed, and the identity that both give it |
//! | [`results`] | what a run produced: a trajectory or a failure, and the rows that are fitted to many runs |
//! | [`physics`] | from a job to its trajectory: walls, droplets, forces, integrators |
//! | [`campaign`] | from a campaign file to a plan: which jobs there are, and what they cost |
//! | [`study`] | from results to answers: decay lengths, mean speeds, accuracy, calibration |
//! | [`store`] | where results are kept: SQLite and Parquet, with SQL for readers |
//! | [`execute`] | the whole of a run: rounds, workers, checkpoints, signals, deadline |
//! | [`report`] | answers for people: text tables, pictures, plots |
//! | [`cli`] | the command line: arguments and printing, nothing else |
//!
//! A campaign flows through them like this:
//!
//! ```text
//! campaign file -> plan -> jobs -> execution -> physics -> results -> store -> study -> report
//! ```
//!
//! `study` stands above `store` because it knows no store: it turns rows into tables, and a run asks it whether another
//! round of seeds is needed.
//!
//! Units everywhere: droplet diameter `sigma = 1`, gravity `g = 1`, areal density `rho = 1`; time is in
//! `t0 = sqrt(sigma/g)`. Gravity drives along `+x`. Equation numbers cite Cheng et al., "Flow and clogging of
//! capillary droplets", Soft Matter 20, 8036 (2024), as `[C24]`.

pub mod parameters;

pub mod results;

pub mod physics;

pub mod campaign;

pub mod study;

pub mod store;

pub mod execute;

pub mod report;

pub mod cli;

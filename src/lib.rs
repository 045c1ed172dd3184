//! `meniscus`: campaigns of droplet simulations, and the store that keeps their results.
//!
//! Data flows one way, and the modules read in that order:
//!
//! ```text
//! campaign file -> plan -> jobs -> executor -> simulate (scene, droplet, effects, integrator)
//!               -> observations -> store -> analysis -> report
//! ```
//!
//! Units everywhere: droplet diameter `sigma = 1`, gravity `g = 1`, areal density `rho = 1`; time is in
//! `t0 = sqrt(sigma/g)`. Gravity drives along `+x`. Equation numbers cite Cheng et al., "Flow and clogging of
//! capillary droplets", Soft Matter 20, 8036 (2024), as `[C24]`.

pub mod accuracy;
pub mod analysis;
pub mod calibrate;
pub mod campaign;
pub mod droplet;
pub mod effects;
pub mod executor;
pub mod fits;
pub mod integrator;
pub mod job;
pub mod mechanism;
pub mod observe;
pub mod plan;
pub mod report;
pub mod rounds;
pub mod scene;
pub mod shape;
pub mod simulate;
pub mod speed;
pub mod stability;
pub mod stepping;
pub mod store;
pub mod tolerance;
pub mod trajectory;
pub mod vector;

//! What a job is: a fully resolved grid point, a seed, and the identity that both give it.
//!
//! This layer is data alone. It computes no physics, reads no files, and imports no other layer. Read [`Point`] first,
//! then the list of all parameters, [`PARAMETERS`].

mod choices;
mod droplet;
mod identity;
mod interval;
mod job;
pub(crate) mod list;
mod parameter;
mod plain;
mod point;
mod scene;
mod units;
mod written;

pub(crate) use choices::names;
pub use choices::{
    ContactKind, Dynamics, Engulfed, GravityForm, Integrator, IntegratorChoice, SelfContact, WallStiffness,
};
pub use droplet::{Deformable, Model, Soft};
pub(crate) use droplet::{MOST_VERTICES, PAPER_KAPPA, STEP_ERROR};
pub use identity::{BadId, JobId, PHYSICS_VERSION, PointId};
pub use interval::Interval;
pub(crate) use interval::{above, between};
pub use job::{Job, JobState};
pub use list::PARAMETERS;
pub use parameter::{Applies, Domain, Parameter, Value};
pub use plain::plain;
pub(crate) use plain::{harmless, shown};
pub(crate) use point::PAPER_ALPHA;
pub use point::{Limits, Point, Stepping};
pub use scene::{Channel, Density, LoneDisc, ObstacleField, Scene};
pub use units::{MASS, regular_edge};
pub use written::Short;
pub(crate) use written::cut_to_three_digits;

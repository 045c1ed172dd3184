//! What a job is: a fully resolved grid point, a seed, and the identity that both give it.
//!
//! This layer is data alone. It computes no physics, reads no files, and imports no other layer. Read [`Point`] first,
//! then the list of all parameters, [`PARAMETERS`].
//!
//! | file | idea |
//! |---|---|
//! | `point` | everything that decides a trajectory except the seed; its canonical form |
//! | `droplet`, `scene`, `stepping`, `limits` | the parts of a point |
//! | `choices` | the ways that the physics leaves open, by their names |
//! | `list` | every parameter once: name, unit, range, default, where it means something |
//! | `parameter`, `interval`, `written` | what a row of that list says, and how its numbers are written |
//! | `identity`, `job` | ids, seeds, states |
//! | `units` | the mass of a droplet and the edges of a regular ring |

mod choices;
mod droplet;
mod identity;
mod interval;
mod job;
mod limits;
pub(crate) mod list;
mod parameter;
mod point;
mod scene;
mod stepping;
mod units;
mod written;

pub use choices::{ContactKind, Engulfed, GravityForm, IntegratorChoice, SelfContact, WallStiffness};
pub(crate) use droplet::PAPER_KAPPA;
pub use droplet::{Deformable, Model, Soft};
pub use identity::{BadId, JobId, PHYSICS_VERSION, PointId};
pub use interval::Interval;
pub(crate) use interval::{above, between};
pub use job::{Job, JobState};
pub use limits::Limits;
pub use list::PARAMETERS;
pub use parameter::{Applies, Domain, Parameter, Value};
pub(crate) use point::PAPER_ALPHA;
pub use point::Point;
pub use scene::{Channel, Density, LoneDisc, ObstacleField, Scene};
pub use stepping::{Integrator, Stepping};
pub use units::{MASS, regular_edge};
pub use written::Short;
pub(crate) use written::cut_to_three_digits;

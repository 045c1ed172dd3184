//! From a job to its trajectory. Nothing here touches files, SQL or the clock.
//!
//! This layer knows parameters and results. A job gives the same trajectory bit for bit on any number of threads and
//! any instruction set, as long as the physics version is the same. Read [`simulate`] first: it starts a droplet and
//! drives it to its end. Each part of the layer imports only from those above it in this list:
//!
//! | folder | idea |
//! |---|---|
//! | [`simd`] | eight numbers at a time on any instruction set |
//! | [`walls`] | obstacles: discs, wedges, a plate; `walls/arrays` places the discs of an array |
//! | [`observation`] | what is measured on a droplet at one instant |
//! | [`ring`] | the deformable droplet, and the forces on it, one file each |
//! | `liquid` | the droplet as a liquid: energy and dissipation of its outline |
//! | [`point`] | the soft particle |
//! | [`motion`] | how time advances, and how a droplet is put at its start |
//! | [`simulate`] | a trajectory from start to end; stability limits |

pub(crate) mod liquid;
pub mod motion;
pub mod observation;
pub mod point;
pub mod ring;
pub mod simd;
pub mod simulate;
pub mod walls;

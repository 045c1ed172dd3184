//! The droplet as a liquid: constant tension, hydrostatic pressure, and Darcy's law inside.
//!
//! The outline is a polygon with even edges. This folder knows its energy and its dissipation at one shape, but not how
//! time advances ([`crate::physics::motion::darcy`]).
//!
//! | file | idea |
//! |---|---|
//! | `polygon` | lengths, area, centroid |
//! | `even` | motion along the normals that keeps the edges even |
//! | `potential` | the energy and its gradient; in its folder the second derivatives, and how vertices settle on walls |
//! | `taut` | edges that bend round walls |
//! | `self_contact` | the droplet against itself |
//! | `nearby` | what can touch |
//! | `curvature`, `jet` | second derivatives |
//! | `interior` | Darcy's law inside, by boundary elements |
//! | `dissipation`, `near_wall` | the drag on the outline |
//! | `dense` | dense matrices |

pub(crate) mod curvature;
pub(crate) mod dense;
pub(crate) mod dissipation;
pub(crate) mod even;
pub(crate) mod interior;
pub(crate) mod jet;
pub(crate) mod near_wall;
pub(crate) mod nearby;
pub(crate) mod polygon;
pub(crate) mod potential;
pub(crate) mod self_contact;
pub(crate) mod taut;

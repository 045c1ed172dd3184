//! What a campaign file leaves open: the integrator and its step, and the cheapest setting that meets a tolerance.

pub(crate) mod discretisation;
pub(crate) mod stepping;
pub mod tolerance;

//! How time advances: the integrator of a job and its step.

use crate::parameters::choices::choice;
use serde::{Deserialize, Serialize};

/// How time advances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stepping {
    /// The integrator.
    pub integrator: Integrator,
    /// Time step, in t0.
    pub dt: f64,
}

choice!(
    /// The integrators.
    Integrator {
        /// Modified velocity-Verlet with implicit drag.
        Verlet = "verlet",
        /// Implicit backward differences of second order; of the deformable particle alone.
        Implicit = "implicit",
    }
);

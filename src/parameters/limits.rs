//! When a run ends.

use serde::{Deserialize, Serialize};

/// When a run ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Longest simulated time, in t0.
    pub t_max: f64,
    /// Displacement along +x after which the run ends, in sigma.
    pub distance: Option<f64>,
    /// A droplet that has once moved is clogged when E_k/E_t falls below this ([C24] App. C).
    pub ek_threshold: f64,
}

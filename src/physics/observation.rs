//! What is measured on a droplet at one instant.

/// What is measured on a droplet at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Unwrapped centroid, x.
    pub x: f64,
    /// Unwrapped centroid, y.
    pub y: f64,
    /// Velocity of the centroid along +x.
    pub velocity: f64,
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy of all effects, gravity included.
    pub potential: f64,
    /// Shape parameter `perimeter^2/(4 pi a)`; `None` for SP.
    pub shape: Option<f64>,
    /// `a/a0 - 1`; `None` for SP.
    pub area_error: Option<f64>,
    /// Deepest overlap with an obstacle, in sigma.
    pub overlap: f64,
    /// Number of obstacles that carry load.
    pub contacts: u32,
}

impl Observation {
    /// Total energy.
    pub fn energy(&self) -> f64 {
        self.kinetic + self.potential
    }
}

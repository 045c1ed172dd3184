//! Vectors of all vertices of a ring.

use crate::vector::{LANES, padded};
use serde::{Deserialize, Serialize};

/// Vectors of x and y for each vertex, zero in the padding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// x components, `padded(n)` long.
    pub x: Vec<f64>,
    /// y components, likewise.
    pub y: Vec<f64>,
}

impl Field {
    /// Zeros for `n` vertices.
    pub fn zero(n: usize) -> Self {
        Self { x: vec![0.0; padded(n)], y: vec![0.0; padded(n)] }
    }

    /// Largest length of a vector; not finite if one of them is not.
    pub fn largest(&self) -> f64 {
        let (mut lanes, mut odd) = ([0.0_f64; LANES], [0.0; LANES]);
        for (x, y) in self.x.chunks_exact(LANES).zip(self.y.chunks_exact(LANES)) {
            for k in 0..LANES {
                let squared = x[k] * x[k] + y[k] * y[k];
                lanes[k] = if squared > lanes[k] { squared } else { lanes[k] };
                // Zero for a number, and for nothing else: a NaN must not pass for small.
                odd[k] += squared * 0.0;
            }
        }
        lanes.iter().fold(0.0_f64, |a, &b| if b > a { b } else { a }).sqrt() + odd.iter().sum::<f64>()
    }

    /// Sets the padding of `n` vertices to zero.
    pub fn still_padding(&mut self, n: usize) {
        self.x[n..].fill(0.0);
        self.y[n..].fill(0.0);
    }
}

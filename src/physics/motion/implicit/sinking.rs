//! Steps of a ring without inertia, for the [descent](crate::physics::motion::descent) to its equilibrium.
//!
//! A step of length h minimises `sum (m lambda_i/2h)|d_i|^2 + U(x + d)` over the displacements d: it is one of backward
//! Euler of `m lambda_i dx_i/dt = F_i`. Three things are left out of the second derivatives of U. Self-contact has
//! none, so a ring that presses on itself has no equilibrium here. Of hydrostatic gravity the products of the gradients
//! of centroid and area are missing, which K_a makes a ten-thousandth of the rest. And the drag keeps its rates in a
//! step.

use crate::physics::motion::descent::{Equilibrium, Sinking};
use crate::physics::motion::implicit::{LARGEST_MOVE, field::Field, newton::Newton};
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::InstructionSet;

/// Newton's method ends a step with a correction below this, in sigma.
const PRECISION: f64 = 1e-7;

/// A ring that moves without inertia.
#[derive(Debug)]
pub(in crate::physics::motion) struct SinkingRing<'a> {
    ring: &'a mut Ring,
    effects: &'a mut RingEffects,
    newton: Newton,
    instruction_set: InstructionSet,
}

impl<'a> SinkingRing<'a> {
    pub(in crate::physics::motion) fn new(
        ring: &'a mut Ring,
        effects: &'a mut RingEffects,
        instruction_set: InstructionSet,
    ) -> Self {
        let newton = Newton::new(ring.n, instruction_set);
        Self { ring, effects, newton, instruction_set }
    }

    /// Sets the weights of a step, and the free displacements, which are zero.
    fn aim(&mut self, h: f64) {
        let Self { ring, effects, newton, .. } = self;
        effects.drag.update(newton.travelled, ring);
        newton.travelled = 0.0;
        let (rates, mass) = (effects.drag.rates(), ring.vertex_mass());
        for i in 0..ring.n {
            newton.potential.weight[i] = mass * rates.at(i) / h;
        }
        let long = ring.ux.len();
        newton.start.x.copy_from_slice(&ring.x[..long]);
        newton.start.y.copy_from_slice(&ring.y[..long]);
        newton.displacement = Field::zero(ring.n);
    }
}

impl Sinking for SinkingRing<'_> {
    fn sink(&mut self, h: f64) -> Option<f64> {
        self.aim(h);
        let solved = self.newton.minimise_convex(self.ring, self.effects, PRECISION);
        let far = self.newton.displacement.largest(self.instruction_set);
        if solved.is_ok() && far <= LARGEST_MOVE && !self.effects.lack_stiffness(self.ring) {
            return Some(far);
        }
        self.newton.displacement = Field::zero(self.ring.n);
        self.newton.put(self.ring, self.effects, if far.is_finite() { far } else { f64::INFINITY });
        None
    }

    fn here(&self) -> Equilibrium {
        let still = &self.ring.ux;
        let ([x, y], _) = self.ring.centroid(still, still);
        let [x0, y0] = self.ring.origin;
        Equilibrium { x: x + x0, y: y + y0, energy: self.effects.potential_energy(self.ring) }
    }
}

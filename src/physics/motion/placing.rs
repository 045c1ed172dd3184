//! How a droplet is put among obstacles: it is inflated in the widest gap near the box centre ([C24] 2.4).
//!
//! A ring placed at full size could enclose whole discs, which exert no force from inside. So a small ring that touches
//! nothing is inflated to its full area, without gravity and under strong drag, and then relaxes. This is done with the
//! integrator, step and wall stiffness of the job.

use crate::parameters::{Deformable, Integrator, MASS, Stepping};
use crate::physics::motion::{Interruption, Motion, implicit::ImplicitMotion, verlet::VerletMotion};
use crate::physics::observation::Observation;
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::forces::drag::Drag;
use crate::physics::ring::{Ring, effects::RingEffects};
use crate::physics::simd::InstructionSet;
use crate::physics::walls::arrays::obstacles::SEARCH_RADIUS;
use crate::physics::walls::wall::Walls;
use crate::results::trajectory::{Failure, FailureClass};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Damping rate while relaxing, in 1/t0: about critical for the shape modes.
const RELAX_RATE: f64 = 20.0;

/// Longest time to relax, in t0.
const RELAX_TIME: u32 = 50;

/// Time to inflate, in t0.
const INFLATE_TIME: f64 = 20.0;

/// Number of stages in which the rest area grows.
const STAGES: u32 = 400;

/// Smallest radius that a ring is inflated from, in sigma.
const SMALLEST: f64 = 0.01;

/// Distance from the plate at which a droplet relaxes before it is set on the plate, in sigma.
const FAR_FROM_PLATE: f64 = 5.0;

/// Kinetic energy at which a droplet counts as relaxed.
const AT_REST: f64 = 1e-14;

/// Where a droplet starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Site {
    /// It is inflated in a gap.
    Gap {
        at: [f64; 2],
        /// Distance from the centre to the nearest wall.
        clearance: f64,
    },
    /// Where no wall is near.
    Free { at: [f64; 2] },
    /// It is relaxed, and its rim just touches the plate at x = 0.
    OnPlate,
}

#[derive(Clone, Copy)]
pub(crate) struct Placing<'a> {
    pub(crate) site: Site,
    pub(crate) stepping: &'a Stepping,
    pub(crate) instruction_set: InstructionSet,
    pub(crate) stop: &'a AtomicBool,
}

impl Placing<'_> {
    /// Puts a ring: relaxed, of full area, and at rest. `effects` are its elasticity and the walls.
    ///
    /// # Errors
    /// [`Interruption::Stopped`] once `stop` is set; a failure of class `bad_input` if there is no room to start from,
    /// `unstable` if the inflation blows up.
    pub(crate) fn ring(self, droplet: &Deformable, effects: RingEffects) -> Result<Ring, Interruption> {
        let n = droplet.n_vertices;
        let full = Ring::regular_radius(n);
        match self.site {
            Site::Free { at } => Ok(Ring::regular(n, at, full)),
            Site::Gap { at, clearance } => {
                let room = (clearance - 0.5 * droplet.delta - 1e-3).min(full);
                if room == full {
                    return Ok(Ring::regular(n, at, full));
                }
                if room < SMALLEST {
                    return Err(no_room(clearance).into());
                }
                self.inflated(Ring::regular(n, at, room), room / full, effects)
            }
            Site::OnPlate => {
                let far = Ring::regular(n, [-FAR_FROM_PLATE, 0.0], full);
                let mut ring = self.inflated(far, 1.0, effects)?;
                let to_plate = ring.bounds()[1] + ring.origin[0] + 0.5 * droplet.delta;
                ring.x.iter_mut().for_each(|x| *x -= to_plate);
                Ok(ring)
            }
        }
    }

    /// Inflates a regular ring from `share` of the full radius to its full area, and lets it relax.
    fn inflated(self, ring: Ring, share: f64, mut effects: RingEffects) -> Result<Ring, Interruption> {
        let (dt, begin) = (self.stepping.dt, MASS * share * share);
        let rest = |share: f64| begin + share * (MASS - begin);
        effects.area.rest = begin;
        effects.drag = Drag::Far { rate: RELAX_RATE };
        let mut motion = match self.stepping.integrator {
            Integrator::Verlet => {
                Inflating::Verlet(Box::new(VerletMotion::start(ring, effects, dt, self.instruction_set)))
            }
            Integrator::Implicit | Integrator::Adaptive => {
                Inflating::Implicit(Box::new(ImplicitMotion::start(ring, effects, dt, self.instruction_set)))
            }
        };
        let steps_a_stage = (INFLATE_TIME / f64::from(STAGES) / dt).ceil() as u64;
        for stage in 1..=STAGES {
            motion.advance(rest(f64::from(stage) / f64::from(STAGES)), steps_a_stage, self.stop)?;
        }
        let seen = relax(dt, |steps| {
            motion.advance(rest(1.0), steps, self.stop)?;
            Ok(motion.observe())
        })?;
        if !seen.kinetic.is_finite() || seen.area_error.is_none_or(|error| !(error.abs() < 0.1)) {
            let reason = format!("area error {:?}", seen.area_error);
            return Err(not_inflated(Failure { class: FailureClass::Unstable, reason, step: 0, outline: None }.into()));
        }
        let mut ring = motion.into_ring();
        ring.ux.fill(0.0);
        ring.uy.fill(0.0);
        Ok(ring)
    }

    /// Puts a soft particle: relaxed and at rest.
    ///
    /// # Errors
    /// [`Interruption::Stopped`] once `stop` is set; a failure of class `bad_input` if every place near the centre lies
    /// inside a wall.
    pub(crate) fn point<W: Walls>(self, e_w: f64, walls: &Arc<W>) -> Result<[f64; 2], Interruption> {
        let (at, clearance) = match self.site {
            Site::Free { at } => return Ok(at),
            Site::OnPlate => return Ok([-0.5, 0.0]),
            Site::Gap { at, clearance } => (at, clearance),
        };
        if clearance >= 0.5 {
            return Ok(at);
        }
        if clearance < 0.0 {
            return Err(no_room(clearance).into());
        }
        let dt = self.stepping.dt;
        let effects = SoftEffects { stiffness: e_w, weight: 0.0, far_rate: RELAX_RATE, b0: 0.0, alpha: 1.0 };
        let mut motion = SoftMotion::start(at, effects, dt, walls.clone(), self.instruction_set);
        let seen = relax(dt, |steps| {
            Motion::advance(&mut motion, steps, self.stop)?;
            Ok(motion.observe())
        })?;
        Ok([seen.x, seen.y])
    }
}

/// A ring while it is inflated, by either integrator.
enum Inflating {
    Verlet(Box<VerletMotion>),
    Implicit(Box<ImplicitMotion>),
}

impl Inflating {
    /// Sets the rest area and takes `steps` time steps.
    fn advance(&mut self, rest: f64, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        let arrived = match self {
            Self::Verlet(motion) => {
                motion.effects.area.rest = rest;
                motion.advance(steps, stop)
            }
            Self::Implicit(motion) => {
                motion.effects.area.rest = rest;
                motion.advance(steps, stop)
            }
        };
        arrived.map_err(not_inflated)
    }

    fn observe(&mut self) -> Observation {
        match self {
            Self::Verlet(motion) => motion.observe(),
            Self::Implicit(motion) => motion.observe(),
        }
    }

    fn into_ring(self) -> Ring {
        match self {
            Self::Verlet(motion) => motion.ring,
            Self::Implicit(motion) => motion.ring,
        }
    }
}

/// Advances by one t0 at a time until the droplet is at rest, for [`RELAX_TIME`] at most; returns the last observation.
fn relax(
    dt: f64,
    mut advance: impl FnMut(u64) -> Result<Observation, Interruption>,
) -> Result<Observation, Interruption> {
    let mut time = 0;
    loop {
        let seen = advance((1.0 / dt).ceil() as u64)?;
        time += 1;
        if seen.kinetic < AT_REST || time == RELAX_TIME {
            return Ok(seen);
        }
    }
}

/// Makes the failure of a step one of inflating.
fn not_inflated(interruption: Interruption) -> Interruption {
    match interruption {
        Interruption::Stopped => Interruption::Stopped,
        Interruption::Failed(failure) => {
            let reason = format!("the droplet could not be blown up to full size: {}", failure.reason);
            Interruption::Failed(Failure { reason, step: 0, ..failure })
        }
    }
}

fn no_room(clearance: f64) -> Failure {
    Failure {
        class: FailureClass::BadInput,
        reason: format!(
            "no room for a droplet within {SEARCH_RADIUS} sigma of the box centre: the widest gap has radius {clearance:.3}; \
             lower density or raise w_ob"
        ),
        step: 0,
        outline: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, ObstacleField};
    use crate::physics::ring::forces::contact::{Contact, WallContact};
    use crate::physics::walls::arrays::obstacles::ObstacleArray;

    const STEPPINGS: [Stepping; 2] = [
        Stepping { integrator: Integrator::Verlet, dt: 1e-3 },
        Stepping { integrator: Integrator::Implicit, dt: 0.02 },
    ];

    #[test]
    fn a_droplet_blown_up_in_a_crowded_array_has_its_area_and_holds_no_disc() {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(1.5), box_size: 30.0 };
        let droplet = Deformable { n_vertices: 128, kappa: 0.0, ..Deformable::of_tension(1.0) };
        let (instruction_set, never) = (InstructionSet::new(), AtomicBool::new(false));
        for seed in 0..4 {
            let discs = Arc::new(ObstacleArray::generate(&field, seed).unwrap());
            let walls = || {
                let (n, k_w) = (droplet.n_vertices, droplet.k_w());
                Box::new(Contact::new(discs.clone(), droplet.contact, n, k_w, droplet.delta, instruction_set))
            };
            let (at, clearance) = discs.widest_gap_near_centre();
            for stepping in &STEPPINGS {
                let site = Site::Gap { at, clearance };
                let placing = Placing { site, stepping, instruction_set, stop: &never };
                let placed = placing.ring(&droplet, RingEffects::elastic(&droplet, walls())).unwrap();
                let (area, _) = placed.area_and_perimeter();
                assert!((area / MASS - 1.0).abs() < 2e-3, "seed {seed}: {area}");
                assert!(walls().engulfed(&placed).is_none());
            }
        }
    }
}

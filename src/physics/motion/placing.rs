//! How a droplet is put among obstacles: blown up from the widest gap near the box centre ([C24] 2.4).
//!
//! A ring placed at full size could hold whole discs, which exert no force from inside. So a small ring that touches
//! nothing is inflated, without gravity and under strong drag, until it has its full area, and then left to relax. The job's
//! own integrator does it, among walls as stiff as they will be.

use crate::parameters::{Deformable, Integrator, MASS, Stepping, regular_edge};
use crate::physics::motion::implicit::ImplicitMotion;
use crate::physics::motion::verlet::{RingEffects, RingMotion};
use crate::physics::observation::Observation;
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::Ring;
use crate::physics::ring::forces::area::Area;
use crate::physics::ring::forces::contact::WallContact;
use crate::physics::ring::forces::far_drag::FarDrag;
use crate::physics::ring::forces::gravity::Gravity;
use crate::physics::ring::forces::{EdgeForce, RingForce};
use crate::physics::simd::InstructionSet;
use crate::physics::walls::arrays::obstacles::SEARCH_RADIUS;
use crate::physics::walls::wall::Walls;
use crate::results::trajectory::{Failure, FailureClass};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Damping rate while relaxing, in 1/t0: about critical for the shape modes.
const RELAX_RATE: f64 = 20.0;

/// Time to inflate, and longest time to relax afterwards, in t0.
const INFLATE_TIME: f64 = 20.0;
const RELAX_TIME: f64 = 50.0;

/// Where a droplet relaxes before it is set on the plate.
const FAR_FROM_PLATE: f64 = 5.0;

/// Kinetic energy at which a droplet counts as relaxed.
const AT_REST: f64 = 1e-14;

/// Where a droplet starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// In a gap of that clearance: it is blown up there.
    Gap {
        /// Centre of the gap.
        at: [f64; 2],
        /// Distance from there to the nearest wall.
        clearance: f64,
    },
    /// Where nothing is near.
    Free {
        /// Its centre.
        at: [f64; 2],
    },
    /// Relaxed, its rim just touching the plate at x = 0.
    OnPlate,
}

/// What pushes a ring while it is put in place.
#[derive(Debug)]
pub struct Pushes {
    /// The walls.
    pub walls: Box<dyn WallContact>,
    /// The ring itself, and the like.
    pub others: Vec<Box<dyn RingForce>>,
}

/// A relaxed ring of full area in its place, at rest; `None` once `stop` is set. Only its own elasticity and `pushes` act on it.
///
/// # Errors
/// `bad_input` if there is no room to start from, `unstable` if the inflation blows up.
pub fn place_ring<E: EdgeForce>(
    parameters: &Deformable,
    edge: E,
    place: Place,
    pushes: Pushes,
    stepping: &Stepping,
    instruction_set: InstructionSet,
    stop: &AtomicBool,
) -> Result<Option<Ring>, Failure> {
    let n = parameters.n_vertices;
    let full = Ring::regular_radius(n);
    let (at, clearance) = match place {
        Place::Free { at } => return Ok(Some(Ring::regular(n, at, full))),
        Place::OnPlate => ([-FAR_FROM_PLATE, 0.0], f64::INFINITY),
        Place::Gap { at, clearance } => (at, clearance),
    };
    let room = (clearance - 0.5 * parameters.delta - 1e-3).min(full);
    if room == full && !matches!(place, Place::OnPlate) {
        return Ok(Some(Ring::regular(n, at, full)));
    }
    if room < 0.01 {
        return Err(no_room(clearance));
    }
    let area_at = |radius: f64| MASS * (radius / full) * (radius / full);
    let smoothing = parameters.eps * regular_edge(n);
    let effects = RingEffects {
        edge,
        area: Area { stiffness: parameters.k_a, rest: area_at(room) },
        gravity: Gravity::off(),
        drag: FarDrag { rate: RELAX_RATE },
        eps_squared: smoothing * smoothing,
        walls: pushes.walls,
        others: pushes.others,
    };
    let ring = Ring::regular(n, at, room);
    let dt = stepping.dt;
    let placed = match stepping.integrator {
        Integrator::Verlet => inflate(RingMotion::start(ring, effects, dt, instruction_set), dt, stop),
        Integrator::Implicit => inflate(ImplicitMotion::start(ring, effects, dt, instruction_set), dt, stop),
    };
    let Some(mut ring) = placed? else { return Ok(None) };
    ring.ux.fill(0.0);
    ring.uy.fill(0.0);
    if let Place::OnPlate = place {
        let to_plate = ring.bounds()[1] + ring.origin[0] + 0.5 * parameters.delta;
        ring.x.iter_mut().for_each(|x| *x -= to_plate);
    }
    Ok(Some(ring))
}

/// A ring under the drag of relaxation, whatever its integrator.
trait Inflatable {
    /// Its rest area.
    fn rest_area(&mut self) -> &mut f64;
    /// Takes time steps; false once `stop` is set.
    fn advance(&mut self, stop: &AtomicBool, steps: u64) -> Result<bool, Failure>;
    /// Reads off kinetic energy and area.
    fn observe(&mut self) -> Observation;
    /// The ring, done.
    fn into_ring(self) -> Ring;
}

impl<E: EdgeForce> Inflatable for RingMotion<E, FarDrag> {
    fn rest_area(&mut self) -> &mut f64 {
        &mut self.effects.area.rest
    }
    fn advance(&mut self, stop: &AtomicBool, steps: u64) -> Result<bool, Failure> {
        Ok(self.advance_unless(stop, steps))
    }
    fn observe(&mut self) -> Observation {
        RingMotion::observe(self)
    }
    fn into_ring(self) -> Ring {
        self.ring
    }
}

impl<E: EdgeForce> Inflatable for ImplicitMotion<E, FarDrag> {
    fn rest_area(&mut self) -> &mut f64 {
        &mut self.effects.area.rest
    }
    fn advance(&mut self, stop: &AtomicBool, steps: u64) -> Result<bool, Failure> {
        self.advance_unless(stop, steps)
    }
    fn observe(&mut self) -> Observation {
        ImplicitMotion::observe(self)
    }
    fn into_ring(self) -> Ring {
        self.ring
    }
}

/// Blows a ring up from its rest area to the full one, and lets it relax; `None` once `stop` is set.
fn inflate<M: Inflatable>(mut motion: M, dt: f64, stop: &AtomicBool) -> Result<Option<Ring>, Failure> {
    let begin = *motion.rest_area();
    let stages = 400_u32;
    let steps_per_stage = (INFLATE_TIME / f64::from(stages) / dt).ceil() as u64;
    for stage in 1..=stages {
        let share = f64::from(stage) / f64::from(stages);
        *motion.rest_area() = begin + share * (MASS - begin);
        if !motion.advance(stop, steps_per_stage).map_err(not_blown_up)? {
            return Ok(None);
        }
    }
    for _ in 0..RELAX_TIME as u32 {
        if !motion.advance(stop, (1.0 / dt).ceil() as u64).map_err(not_blown_up)? {
            return Ok(None);
        }
        if motion.observe().kinetic < AT_REST {
            break;
        }
    }
    let seen = motion.observe();
    if !seen.kinetic.is_finite() || seen.area_error.is_none_or(|e| !(e.abs() < 0.1)) {
        let reason = format!("the droplet could not be blown up to full size: area error {:?}", seen.area_error);
        return Err(Failure { class: FailureClass::Unstable, reason, step: 0, outline: None });
    }
    Ok(Some(motion.into_ring()))
}

/// The failure of a step while the droplet is put in place.
fn not_blown_up(failure: Failure) -> Failure {
    let reason = format!("the droplet could not be blown up to full size: {}", failure.reason);
    Failure { reason, step: 0, ..failure }
}

/// A relaxed place for a soft particle.
///
/// # Errors
/// `bad_input` if every place near the centre lies inside a wall.
pub fn place_point<W: Walls>(
    e_w: f64,
    walls: &Arc<W>,
    place: Place,
    dt: f64,
    instruction_set: InstructionSet,
) -> Result<[f64; 2], Failure> {
    let (at, clearance) = match place {
        Place::Free { at } => return Ok(at),
        Place::OnPlate => return Ok([-0.5, 0.0]),
        Place::Gap { at, clearance } => (at, clearance),
    };
    if clearance >= 0.5 {
        return Ok(at);
    }
    if clearance < 0.0 {
        return Err(no_room(clearance));
    }
    let effects = SoftEffects { stiffness: e_w, weight: 0.0, far_rate: RELAX_RATE, b0: 0.0, alpha: 1.0 };
    let mut motion = SoftMotion::start(at, effects, dt, walls.clone(), instruction_set);
    for _ in 0..RELAX_TIME as u32 {
        motion.advance((1.0 / dt).ceil() as u64);
        if motion.observe().kinetic < AT_REST {
            break;
        }
    }
    let seen = motion.observe();
    Ok([seen.x, seen.y])
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
    use crate::physics::ring::forces::contact::Contact;
    use crate::physics::ring::forces::tension::Tension;
    use crate::physics::walls::arrays::obstacles::ObstacleArray;

    #[test]
    fn a_droplet_blown_up_in_a_crowded_array_has_its_area_and_holds_no_disc() {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(1.5), box_size: 30.0 };
        let ring = Deformable { n_vertices: 128, ..Deformable::of_tension(1.0) };
        for seed in 0..4 {
            let discs = Arc::new(ObstacleArray::generate(&field, seed).unwrap());
            let contact = || {
                Box::new(Contact::new(
                    discs.clone(),
                    ring.contact,
                    ring.n_vertices,
                    ring.k_w(),
                    ring.delta,
                    InstructionSet::new(),
                ))
            };
            let (at, clearance) = discs.widest_gap_near_centre();
            let place = Place::Gap { at, clearance };
            let tension = Tension { gamma: 1.0 };
            for stepping in [
                Stepping { integrator: Integrator::Verlet, dt: 1e-3 },
                Stepping { integrator: Integrator::Implicit, dt: 0.02 },
            ] {
                let never = AtomicBool::new(false);
                let (pushes, instruction_set) =
                    (Pushes { walls: contact(), others: Vec::new() }, InstructionSet::new());
                let placed = place_ring(&ring, tension, place, pushes, &stepping, instruction_set, &never);
                let placed = placed.unwrap().unwrap();
                let (area, _) = placed.area_and_perimeter();
                assert!((area / MASS - 1.0).abs() < 2e-3, "seed {seed}: {area}");
                assert!(contact().engulfed(&placed).is_none());
            }
        }
    }
}

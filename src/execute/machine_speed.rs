//! How fast this machine steps droplets, measured in a few milliseconds: what cost estimates are made from.

use crate::campaign::choose::stepping::{IMPLICIT_DT, NEWTON_STEP_NS};
use crate::campaign::plan::Speed;
use crate::parameters::{Deformable, MASS};
use crate::physics::motion::Motion;
use crate::physics::motion::implicit::ImplicitMotion;
use crate::physics::motion::verlet::VerletMotion;
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::Ring;
use crate::physics::ring::effects::RingEffects;
use crate::physics::ring::forces::contact::Contact;
use crate::physics::ring::forces::drag::Drag;
use crate::physics::ring::forces::gravity::Gravity;
use crate::physics::simd::InstructionSet;
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Time of a step of a 256-vertex ring, explicit and implicit, and of a point, all leaning on two discs.
pub fn measure(instruction_set: InstructionSet) -> Speed {
    let droplet = Deformable::of_tension(1.0);
    let (n, never) = (droplet.n_vertices, AtomicBool::new(false));
    let discs = Arc::new(ObstacleArray::from_centres(20.0, 0.15, &[10.5, 10.5], &[9.6, 10.4]));
    let effects = || {
        let (k_w, delta) = (droplet.k_w(), droplet.delta);
        let walls = Contact::new(discs.clone(), droplet.contact, n, k_w, delta, instruction_set);
        RingEffects {
            gravity: Gravity::new(n),
            drag: Drag::Far { rate: 33.0 },
            ..RingEffects::elastic(&droplet, Box::new(walls))
        }
    };
    let ring = Ring::regular(n, [9.8, 10.0], Ring::regular_radius(n));
    let mut deformable = VerletMotion::start(ring.clone(), effects(), 1e-3, instruction_set);
    let mut implicit = ImplicitMotion::start(ring, effects(), IMPLICIT_DT, instruction_set);
    // The discs throw the droplet back at first, so the first steps are not typical.
    let still = implicit.advance(20, &never).is_ok();
    let before = implicit.counts.iterations;
    let step_ns = fastest_ns(20, |steps| implicit.advance(steps, &never).unwrap_or_default());
    let newton_steps_a_step = (implicit.counts.iterations - before) as f64 / 60.0;
    let point = SoftEffects { stiffness: 10.0, weight: MASS, far_rate: 33.0, b0: 0.0, alpha: 4.0 / 3.0 };
    let mut soft = SoftMotion::start([9.8, 10.0], point, 1e-3, discs, instruction_set);
    Speed {
        deformable_ns_per_vertex_step: fastest_ns(2000, |steps| deformable.advance(steps, &never).unwrap_or_default())
            / n as f64,
        implicit_ns_per_vertex_newton: if still {
            step_ns / newton_steps_a_step.max(1.0) / n as f64
        } else {
            NEWTON_STEP_NS
        },
        soft_ns_per_step: fastest_ns(50_000, |steps| soft.advance(steps)),
    }
}

/// Nanoseconds of a step, the best of three runs.
fn fastest_ns(steps: u64, mut advance: impl FnMut(u64)) -> f64 {
    let mut once = || {
        let begin = Instant::now();
        advance(steps);
        begin.elapsed().as_secs_f64() * 1e9 / steps as f64
    };
    [once(), once(), once()].into_iter().fold(f64::INFINITY, f64::min)
}

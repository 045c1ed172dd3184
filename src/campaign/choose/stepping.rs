//! Which integrator a job takes, and with what time step: settled before it starts, from what either costs.
//!
//! A unit of time costs, per vertex, `cost of a step/dt`. Verlet's steps are cheap, but its `dt` is bound by the
//! stiffest force ([`crate::physics::simulate::stability`]). An implicit step costs a few Newton steps, each like a
//! dozen of Verlet's, and its `dt` is a matter of accuracy alone. At 1/16 t0 its error is a tenth of what 256 vertices
//! leave, or less. Up to V_t = 0.033 it costs less than half wherever Verlet's step is below 1.2e-3: with a ring of 256
//! vertices, always. The costs are constants, not measured anew, because the choice is part of a job's identity.
//!
//! Droplets that fold back on themselves stay with Verlet: self-contact gives Newton's method no second derivatives,
//! and is its worst case.
//!
//! Example: at the reference point Verlet takes 0.57 ms of CPU per t0 and the implicit integrator 0.2 ms, to the same
//! places within 1e-3 sigma. With the literal wall stiffness at N_v = 256 Verlet needs `dt < 4.8e-6`, and costs several
//! hundred times as much.

use crate::parameters::{Deformable, Integrator, IntegratorChoice, Model, Point, SelfContact, Stepping, WallStiffness};
use crate::physics::motion::implicit::LARGEST_MOVE;
use crate::physics::simulate::stability::{StabilityLimit, vertices_pile_up};

/// Cost of a Verlet step, in ns per vertex.
pub(crate) const VERLET_STEP_NS: f64 = 2.3;

/// Cost of a Newton step, in ns per vertex.
pub(crate) const NEWTON_STEP_NS: f64 = 20.0;

/// Newton steps that an implicit step takes on average: 2.6 measured at soft walls, 3 to 4 at hard ones.
pub(crate) const NEWTON_STEPS: f64 = 3.0;

/// Time step of the implicit integrator under `dt = "auto"`, 16 in a t0. Measured (docs/accuracy.md): passages through
/// w = 0.7 take 0.2% less time than with the finest steps, A_max - 1 is off by 5e-4, <v_g> by 2e-6, the time to an
/// arrest by 6e-4; N_v = 256 leaves 6%, 2%, 3e-4 and 17%.
pub(crate) const IMPLICIT_DT: f64 = 0.0625;

/// Largest way of a free droplet in one implicit step under `dt = "auto"`, in sigma: a third of what a step may move a
/// vertex.
const IMPLICIT_WAY: f64 = LARGEST_MOVE / 3.0;

/// How many times as much Verlet must cost for `auto` to take the implicit integrator. In doubt it takes Verlet, as the
/// paper does.
pub(crate) const WORTH_IT: f64 = 2.0;

/// The largest implicit step in which a free droplet goes no further than it may.
pub(crate) fn implicit_dt_bound(v_t: f64) -> f64 {
    IMPLICIT_WAY / v_t
}

/// Tension below which droplets among obstacles fold back on themselves, so that self-contact acts most of the time: at
/// Gamma = 0.15 the implicit integrator takes half of Verlet's time, at 0.1 four times as much.
const FOLDS_BELOW: f64 = 0.15;

/// The implicit step that `dt = "auto"` stands for: 1/16, halved until a free droplet goes no further than it may (at
/// V_t above 0.033), and until the step fits between two samples.
pub(crate) fn implicit_dt(point: &Point) -> f64 {
    let mut dt = IMPLICIT_DT;
    while dt * point.v_t > IMPLICIT_WAY || dt > point.sample_every {
        dt *= 0.5;
    }
    dt
}

/// Estimated cost of a unit of time, in ns per vertex.
pub(crate) fn cost_per_t0(stepping: &Stepping) -> f64 {
    let step = match stepping.integrator {
        Integrator::Verlet => VERLET_STEP_NS,
        Integrator::Implicit => NEWTON_STEPS * NEWTON_STEP_NS,
    };
    step / stepping.dt
}

/// Both integrators with the steps that `dt = "auto"` gives them: Verlet, implicit.
pub(crate) fn candidates(point: &Point, limit: &StabilityLimit) -> [Stepping; 2] {
    [
        Stepping { integrator: Integrator::Verlet, dt: limit.auto_dt() },
        Stepping { integrator: Integrator::Implicit, dt: implicit_dt(point) },
    ]
}

/// The stepping of a point; its own is not read. `auto` takes Verlet, or the implicit integrator where that is worth
/// it. A step that is given is Verlet's, unless the implicit integrator is asked for by name. Whether Verlet is stable
/// at that step is checked elsewhere ([`crate::campaign::checks`]).
pub(crate) fn choose(asked: IntegratorChoice, dt: Option<f64>, point: &Point, limit: &StabilityLimit) -> Stepping {
    let [verlet, implicit] = candidates(point, limit);
    let worth_it = match (&point.model, dt) {
        (Model::Deformable(ring), None) if folds(ring) => false,
        (Model::Deformable(_), None) => WORTH_IT * cost_per_t0(&implicit) < cost_per_t0(&verlet),
        (Model::Soft(_), _) | (_, Some(_)) => false,
    };
    let chosen = match asked {
        IntegratorChoice::Implicit => implicit,
        IntegratorChoice::Auto if worth_it => implicit,
        IntegratorChoice::Verlet | IntegratorChoice::Auto => verlet,
    };
    Stepping { dt: dt.unwrap_or(chosen.dt), ..chosen }
}

/// Whether self-contact is expected to act most of the time, where Verlet is stable at the wall.
pub(crate) fn folds(ring: &Deformable) -> bool {
    let acts = ring.self_contact == SelfContact::Auto && ring.wall == WallStiffness::Total;
    acts && (vertices_pile_up(ring) || ring.gamma < FOLDS_BELOW)
}

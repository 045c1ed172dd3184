//! Which integrator a job takes, and with what time step: settled before it starts, from what either costs.
//!
//! The cost of a unit of time, per vertex, is `cost of a step/dt`. Verlet's steps are cheap, but `dt` is bound by the stiffest force
//! ([`crate::stability`]); an implicit step costs a few Newton steps, each like a dozen of Verlet's, and its `dt` is a
//! matter of accuracy alone. So Verlet is the cheaper one down to a step of about 4e-4, and
//! `auto` leaves it at 2e-4. The costs are constants, not measured anew, because the choice is part of a job's identity.
//!
//! Example: with the literal wall stiffness at N_v = 256 Verlet needs `dt < 4.8e-6`, which costs over a hundred times as much as
//! implicit steps of 0.02.

use crate::integrator::implicit::LARGEST_MOVE;
use crate::job::{Integrator, IntegratorChoice, Model, Point, Stepping, WallStiffness};
use crate::stability::{StabilityLimit, vertices_pile_up};

/// Cost of a Verlet step, in ns per vertex.
pub const VERLET_STEP_NS: f64 = 3.0;

/// Cost of a Newton step, in ns per vertex.
pub const NEWTON_STEP_NS: f64 = 35.0;

/// Newton steps that an implicit step takes on average: 2.3 measured at soft walls, 3 to 4 at hard ones.
pub const NEWTON_STEPS: f64 = 4.0;

/// Time step of the implicit integrator under `dt = "auto"`. Measured through w = 0.7 (Gamma = 1.08 and 0.8), against Verlet at
/// 2.5e-4: the passage takes 0.05% less time and A_max is off by 3e-5, where N_v = 512 instead of 256 changes them by 2 to 8% and 1e-3.
pub const IMPLICIT_DT: f64 = 0.02;

/// Largest way of a free droplet in one implicit step under `dt = "auto"`, in sigma: a third of what a step may move a vertex.
const IMPLICIT_WAY: f64 = LARGEST_MOVE / 3.0;

/// How many times as much Verlet must cost for `auto` to take the implicit integrator: in doubt it is Verlet, the paper's.
pub const WORTH_IT: f64 = 2.0;

/// The largest implicit step in which a free droplet goes no further than it may.
pub fn implicit_dt_bound(v_t: f64) -> f64 {
    IMPLICIT_WAY / v_t
}

/// The implicit step that `dt = "auto"` stands for: 0.02, halved until a free droplet (V_t above 0.1) goes no further than it may.
pub fn implicit_dt(v_t: f64) -> f64 {
    let mut dt = IMPLICIT_DT;
    while dt * v_t > IMPLICIT_WAY {
        dt *= 0.5;
    }
    dt
}

/// Estimated cost of a unit of time, in ns per vertex.
pub fn cost_per_t0(stepping: &Stepping) -> f64 {
    let step = match stepping.integrator {
        Integrator::Verlet => VERLET_STEP_NS,
        Integrator::Implicit => NEWTON_STEPS * NEWTON_STEP_NS,
    };
    step / stepping.dt
}

/// Both integrators with the steps that `dt = "auto"` gives them: Verlet, implicit.
pub fn candidates(point: &Point, limit: &StabilityLimit) -> [Stepping; 2] {
    [
        Stepping { integrator: Integrator::Verlet, dt: limit.auto_dt() },
        Stepping { integrator: Integrator::Implicit, dt: implicit_dt(point.v_t) },
    ]
}

/// The stepping of a point (its own is not read): `auto` takes Verlet, or the implicit one where that is worth it. A step that is given is Verlet's, unless
/// the implicit integrator is asked for by name; whether Verlet can bear it is for others to check.
pub fn choose(asked: IntegratorChoice, dt: Option<f64>, point: &Point, limit: &StabilityLimit) -> Stepping {
    let [verlet, implicit] = candidates(point, limit);
    let worth_it = match (&point.model, dt) {
        // Self-contact gives no second derivatives, so Newton's method is at its worst where it acts all the time.
        (Model::Deformable(ring), None) if vertices_pile_up(ring) && ring.wall == WallStiffness::Total => false,
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

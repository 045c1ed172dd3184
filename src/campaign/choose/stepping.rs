//! Which integrator a job takes, and with what time step. Both are settled before the job starts, by comparing costs.
//!
//! A unit of time costs `cost of a step/dt` per vertex. Verlet's steps are cheap, but the stiffest force limits its
//! `dt` ([`crate::physics::simulate::stability`]). An implicit step takes a few Newton steps, each as expensive as a
//! dozen Verlet steps, but only accuracy limits its `dt`. At `dt = 1/16` its error is at most a tenth of that of a ring
//! of 256 vertices. Up to V_t = 0.033 the implicit integrator then costs less than half of Verlet if Verlet's step is
//! below 1.2e-3, as it always is under `dt = "auto"`. The costs are constants and not measured on each machine, because
//! the choice is part of a job's identity.
//!
//! Droplets that fold back on themselves stay with Verlet, because Newton's method converges slowly where self-contact
//! acts: self-contact gives it no second derivatives.
//!
//! Example: at the reference point Verlet takes 0.57 ms of CPU per t0 and the implicit integrator 0.2 ms; their
//! positions agree within 1e-3 sigma. With the literal wall stiffness at N_v = 256 Verlet needs `dt < 4.8e-6`, and
//! costs several hundred times as much as the implicit integrator.

use crate::parameters::{
    Deformable, Dynamics, Integrator, IntegratorChoice, Model, Point, SelfContact, Stepping, WallStiffness,
};
use crate::physics::motion::implicit::LARGEST_MOVE;
use crate::physics::simulate::stability::{StabilityLimit, vertices_pile_up};

/// Cost of a Verlet step, in ns per vertex.
pub(crate) const VERLET_STEP_NS: f64 = 2.3;

/// Cost of a Newton step, in ns per vertex.
pub(crate) const NEWTON_STEP_NS: f64 = 20.0;

/// Newton steps that an implicit step takes on average. Measured: 2.6 at soft walls, 3 to 4 at hard ones.
pub(crate) const NEWTON_STEPS: f64 = 3.0;

/// Time step of the implicit integrator under `dt = "auto"`, in t0. Relative errors measured against the finest steps
/// (docs/accuracy.md), and those of N_v = 256 for comparison: transit time through w = 0.7, 0.2% and 6%; A_max - 1,
/// 5e-4 and 2%; <v_g>, 2e-6 and 3e-4; time to an arrest, 6e-4 and 17%.
pub(crate) const IMPLICIT_DT: f64 = 0.0625;

/// How far a free droplet may move in one implicit step under `dt = "auto"`, in sigma: a third of what the integrator
/// allows a vertex.
const IMPLICIT_WAY: f64 = LARGEST_MOVE / 3.0;

/// Under `auto` the implicit integrator is taken where Verlet would cost more than this factor times as much. In doubt
/// Verlet is taken, as in the paper.
pub(crate) const WORTH_IT: f64 = 2.0;

/// Tension below which droplets among obstacles fold back on themselves, so that self-contact acts most of the time. At
/// Gamma = 0.15 the implicit integrator takes half of Verlet's time, at 0.1 four times as much.
const FOLDS_BELOW: f64 = 0.15;

/// The largest implicit step in which a free droplet moves no further than allowed.
pub(crate) fn implicit_dt_bound(v_t: f64) -> f64 {
    IMPLICIT_WAY / v_t
}

/// The implicit step under `dt = "auto"`: 1/16, halved until a free droplet moves no further than allowed (at V_t above
/// 0.033) and the step is not longer than the time between two samples.
pub(crate) fn implicit_dt(point: &Point) -> f64 {
    let mut dt = IMPLICIT_DT;
    while dt * point.v_t > IMPLICIT_WAY || dt > point.sample_every {
        dt *= 0.5;
    }
    dt
}

/// Time between two looks at a droplet under `dynamics = "darcy"`, in t0. Its steps are as long as their error allows.
pub(crate) const ADAPTIVE_DT: f64 = 0.125;

/// The nominal step under `dynamics = "darcy"`: 1/8, halved until it is not longer than the time between two samples.
pub(crate) fn adaptive_dt(point: &Point) -> f64 {
    let mut dt = ADAPTIVE_DT;
    while dt > point.sample_every {
        dt *= 0.5;
    }
    dt
}

/// Whether the point has `dynamics = "darcy"`.
pub(crate) fn is_darcy(point: &Point) -> bool {
    matches!(&point.model, Model::Deformable(ring) if ring.dynamics == Dynamics::Darcy)
}

/// Estimated CPU time of a unit of time under `dynamics = "darcy"`, in seconds: measured in arrays of density 0.39 and 0.7
/// with 32 to 256 vertices, and growing with N_v^2.4, because matrices are dense.
pub(crate) fn adaptive_s_per_t0(n_vertices: usize) -> f64 {
    3.5e-4 * libm::pow(n_vertices as f64 / 64.0, 2.4)
}

/// Estimated cost of a unit of time, in ns per vertex.
pub(crate) fn cost_per_t0(stepping: &Stepping) -> f64 {
    let step = match stepping.integrator {
        Integrator::Verlet => VERLET_STEP_NS,
        Integrator::Implicit => NEWTON_STEPS * NEWTON_STEP_NS,
        Integrator::Adaptive => return 1e9 * adaptive_s_per_t0(64) / 64.0,
    };
    step / stepping.dt
}

/// Verlet and the implicit integrator, with the steps that they take under `dt = "auto"`.
pub(crate) fn candidates(point: &Point, limit: &StabilityLimit) -> [Stepping; 2] {
    [
        Stepping { integrator: Integrator::Verlet, dt: limit.auto_dt() },
        Stepping { integrator: Integrator::Implicit, dt: implicit_dt(point) },
    ]
}

/// Chooses the stepping of a point; `point.stepping` is not read. `auto` takes the implicit integrator where that is
/// worth it and no `dt` is given, and Verlet otherwise. Whether Verlet is stable at a given `dt` is checked elsewhere
/// ([`crate::campaign::checks`]).
pub(crate) fn choose(asked: IntegratorChoice, dt: Option<f64>, point: &Point, limit: &StabilityLimit) -> Stepping {
    let [verlet, implicit] = candidates(point, limit);
    if is_darcy(point) || asked == IntegratorChoice::Adaptive {
        return Stepping { integrator: Integrator::Adaptive, dt: dt.unwrap_or_else(|| adaptive_dt(point)) };
    }
    let worth_it = match (&point.model, dt) {
        (Model::Deformable(ring), None) if folds(ring) => false,
        (Model::Deformable(_), None) => WORTH_IT * cost_per_t0(&implicit) < cost_per_t0(&verlet),
        (Model::Soft(_), _) | (_, Some(_)) => false,
    };
    let chosen = match asked {
        IntegratorChoice::Implicit => implicit,
        IntegratorChoice::Auto if worth_it => implicit,
        IntegratorChoice::Verlet | IntegratorChoice::Auto | IntegratorChoice::Adaptive => verlet,
    };
    Stepping { dt: dt.unwrap_or(chosen.dt), ..chosen }
}

/// Whether self-contact is expected to act most of the time. Not asked of the literal wall stiffness, at which Verlet's
/// step would be far too small.
pub(crate) fn folds(ring: &Deformable) -> bool {
    let acts = ring.self_contact == SelfContact::Auto && ring.wall == WallStiffness::Total;
    acts && (vertices_pile_up(ring) || ring.gamma < FOLDS_BELOW)
}

//! Which integrator a job takes, and with what time step. Both are settled before the job starts, by comparing costs.
//!
//! A unit of time costs `cost of a step/dt` per vertex. Verlet's steps are cheap, but the stiffest force limits its
//! `dt` ([`crate::physics::simulate::stability`]). An implicit step takes a few Newton steps, each as expensive as a
//! dozen Verlet steps, but only accuracy limits its `dt`. At `dt = 1/16` its error is at most a tenth of that of a ring
//! of 256 vertices. The costs are constants and not measured on each machine, because the choice is part of a job's
//! identity.
//!
//! One implicit step that follows its error takes the place of 12 fixed ones of 1/16 t0 in contact, of 20 in free flight,
//! and of 180 in the decay after an arrest. `auto` takes these steps and no fixed ones; a given `dt` means fixed steps of
//! that length.
//!
//! Where droplets fold back on themselves Newton's method converges slowly, because the matrix cannot hold how the parts
//! of a fold couple. Steps that follow their error become shorter there until they converge. They cost as much as Verlet's at
//! Gamma = 0.01 and 0.03, and half of it at 0.1. With near-wall drag folds may cross in such steps, and Verlet is taken.
//!
//! Example: from the start to the clog at the reference point, Verlet takes 0.5 ms of CPU per t0, fixed implicit steps 0.14
//! ms, and those that follow their error 0.016 ms; their positions agree within 1e-3 sigma. With the literal wall stiffness
//! at N_v = 256 Verlet needs `dt < 4.8e-6`, and costs several hundred times as much as fixed implicit steps.

use crate::parameters::{
    Deformable, Dynamics, Integrator, IntegratorChoice, Model, Point, Scene, SelfContact, Stepping,
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

/// Tension below which droplets among obstacles fold back on themselves, so that self-contact acts most of the time.
const FOLDS_BELOW: f64 = 0.15;

/// Tension below which they lie in films, in which Newton's method converges slowly.
const FILMS_BELOW: f64 = 0.06;

/// How many times as many Newton steps a droplet takes, in steps that follow their error, where it folds, and where it
/// lies in films.
const FOLDED: [f64; 2] = [7.0, 58.0];

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

/// Time between two looks at a droplet whose steps follow their error, in t0.
pub(crate) const ADAPTIVE_DT: f64 = 0.125;

/// Newton steps that a droplet among obstacles takes in implicit steps that follow their error, in each time in which it
/// would fall by one sigma. Measured from start to clog at V_t = 0.03 to 1: 100 to 140.
const NEWTON_STEPS_A_SIGMA: f64 = 125.0;

/// The time between two looks at a droplet whose steps follow their error: 1/8, halved until it is not longer than the
/// time between two samples.
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

/// Estimated cost of a unit of time with a ring of springs in each of the [`candidates`], in ns per vertex.
pub(crate) fn costs_per_t0(point: &Point, limit: &StabilityLimit) -> [f64; 3] {
    let [verlet, implicit, _] = candidates(point, limit);
    let folded = match &point.model {
        Model::Deformable(ring) => folded_steps(ring),
        Model::Soft(_) => 1.0,
    };
    let adaptive = NEWTON_STEPS_A_SIGMA * folded * point.v_t * NEWTON_STEP_NS;
    [VERLET_STEP_NS / verlet.dt, NEWTON_STEPS * NEWTON_STEP_NS / implicit.dt, adaptive]
}

/// Verlet, fixed implicit steps, and those that follow their error, as they are under `dt = "auto"`.
pub(crate) fn candidates(point: &Point, limit: &StabilityLimit) -> [Stepping; 3] {
    [
        Stepping { integrator: Integrator::Verlet, dt: limit.auto_dt() },
        Stepping { integrator: Integrator::Implicit, dt: implicit_dt(point) },
        Stepping { integrator: Integrator::Adaptive, dt: adaptive_dt(point) },
    ]
}

/// Chooses the stepping of a point; `point.stepping` is not read. `auto` takes implicit steps that follow their error
/// where they are expected to be cheaper and no `dt` is given, and Verlet otherwise. Whether Verlet is stable at a given
/// `dt` is checked elsewhere ([`crate::campaign::checks`]).
pub(crate) fn choose(asked: IntegratorChoice, dt: Option<f64>, point: &Point, limit: &StabilityLimit) -> Stepping {
    let [verlet, implicit, adaptive] = candidates(point, limit);
    let is_cheaper = match (&point.model, dt) {
        (Model::Deformable(_), None) if presses_folds(point) => false,
        (Model::Deformable(_), None) => {
            let [verlet, _, adaptive] = costs_per_t0(point, limit);
            adaptive < verlet
        }
        (Model::Soft(_), _) | (_, Some(_)) => false,
    };
    let chosen = match asked {
        _ if is_darcy(point) => adaptive,
        IntegratorChoice::Adaptive => adaptive,
        IntegratorChoice::Implicit => implicit,
        IntegratorChoice::Auto if is_cheaper => adaptive,
        IntegratorChoice::Verlet | IntegratorChoice::Auto => verlet,
    };
    Stepping { dt: dt.unwrap_or(chosen.dt), ..chosen }
}

/// Whether self-contact is expected to act most of the time.
pub(crate) fn folds(ring: &Deformable) -> bool {
    ring.self_contact == SelfContact::Auto && (vertices_pile_up(ring) || ring.gamma < FOLDS_BELOW)
}

/// Whether a droplet that hangs on obstacles has the sides of its folds pressed together by near-wall drag. Steps that
/// follow their error are long there: at Gamma = 0.1 the outline crosses itself in two thirds of all runs, and by Verlet
/// in a fifth.
pub(crate) fn presses_folds(point: &Point) -> bool {
    let hangs = matches!(point.scene, Scene::Obstacles(_) | Scene::Disc(_));
    hangs && point.b0 > 0.0 && matches!(&point.model, Model::Deformable(ring) if folds(ring))
}

/// The first of two factors for a droplet that folds, the second for one that lies in films, and 1 for any other.
pub(crate) fn folded(ring: &Deformable, [folds_by, films_by]: [f64; 2]) -> f64 {
    match folds(ring) {
        true if ring.gamma < FILMS_BELOW => films_by,
        true => folds_by,
        false => 1.0,
    }
}

/// How many times as many Newton steps a droplet takes because it folds, in steps that follow their error.
pub(crate) fn folded_steps(ring: &Deformable) -> f64 {
    folded(ring, FOLDED)
}

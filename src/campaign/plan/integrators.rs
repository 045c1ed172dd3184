//! Which integrator takes which points of a block, and why.

use crate::campaign::choose::stepping::{choose, costs_per_t0, is_darcy, presses_folds};
use crate::campaign::file::Block;
use crate::campaign::plan::{Chosen, text::Ends};
use crate::parameters::{Integrator, IntegratorChoice, Model, Point};
use crate::physics::simulate::stability::StabilityLimit;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    Asked,
    /// A soft particle takes this one unless another is asked for.
    OfModel,
    /// `dynamics = "darcy"` has only this one.
    OfDynamics,
    StepGiven,
    /// Near-wall drag presses folds together.
    PressesFolds,
    /// It was chosen by cost; Verlet's step is bound by this term.
    Cheaper(&'static str),
}

/// Groups the points of a block by integrator and reason, in the order of their first points.
pub(super) fn of(block: &Block, limits: &[StabilityLimit]) -> Vec<Chosen> {
    let mut groups: Vec<(Integrator, Reason, Vec<f64>)> = Vec::new();
    for (point, limit) in block.points.iter().zip(limits) {
        let integrator = point.stepping.integrator;
        let (reason, saving) = reason(block.integrator, point, limit);
        match groups.iter_mut().find(|group| (group.0, group.1) == (integrator, reason)) {
            Some(group) => group.2.push(saving),
            None => groups.push((integrator, reason, vec![saving])),
        }
    }
    let chosen = |(integrator, reason, savings): (Integrator, Reason, Vec<f64>)| Chosen {
        integrator: integrator.name(),
        points: savings.len(),
        why: why(integrator, reason, Ends::of(savings.iter().copied())),
    };
    groups.into_iter().map(chosen).collect()
}

/// The reason in words; `times` is how many times as much the other integrator would cost.
fn why(integrator: Integrator, reason: Reason, times: Ends) -> String {
    let cut = times.cut();
    match (reason, integrator) {
        (Reason::OfDynamics, _) => "that of dynamics = \"darcy\": steps follow step_error".to_owned(),
        (Reason::Asked, Integrator::Adaptive) => "asked for; steps follow their error".to_owned(),
        (Reason::Asked, _) => "asked for".to_owned(),
        (Reason::OfModel, _) => "that of SP where none is asked for".to_owned(),
        (Reason::StepGiven, _) => "dt is given, and no other integrator asked for".to_owned(),
        (Reason::PressesFolds, _) => "near-wall drag presses folds together, which may cross in long steps".to_owned(),
        (Reason::Cheaper(_), Integrator::Verlet) => {
            format!("the cheaper one: adaptive would cost {cut} times as much")
        }
        (Reason::Cheaper(term), Integrator::Implicit | Integrator::Adaptive) => {
            format!("the cheaper one: verlet, its step bound by {term}, would cost {cut} times as much")
        }
    }
}

/// The reason of a point, and how many times as much the other integrator would cost.
fn reason(asked: IntegratorChoice, point: &Point, limit: &StabilityLimit) -> (Reason, f64) {
    let [verlet, implicit, adaptive] = costs_per_t0(point, limit);
    let saving = match point.stepping.integrator {
        Integrator::Verlet => adaptive / verlet,
        Integrator::Implicit => verlet / implicit,
        Integrator::Adaptive => verlet / adaptive,
    };
    let reason = match (&point.model, asked) {
        (Model::Soft(_), IntegratorChoice::Auto) => Reason::OfModel,
        _ if is_darcy(point) => Reason::OfDynamics,
        (_, IntegratorChoice::Verlet | IntegratorChoice::Implicit | IntegratorChoice::Adaptive) => Reason::Asked,
        // A step that happens to be the automatic one is as good as automatic.
        _ if point.stepping != choose(asked, None, point, limit) => Reason::StepGiven,
        _ if point.stepping.integrator == Integrator::Verlet && presses_folds(point) => Reason::PressesFolds,
        // Where Verlet is chosen, the term that bounds its step is not told.
        _ if point.stepping.integrator == Integrator::Verlet => Reason::Cheaper(""),
        _ => Reason::Cheaper(limit.terms.first().map_or("", |term| term.term)),
    };
    (reason, saving)
}

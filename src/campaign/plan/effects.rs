//! Which effects act in a block, which do not, and why, as `plan` shows them before anything runs.

use crate::campaign::choose::stepping::is_darcy;
use crate::campaign::plan::text::Ends;
use crate::parameters::{Deformable, Dynamics, GravityForm, Model, Point, SelfContact, list};
use crate::physics::ring::forces::tension::is_linear;
use crate::physics::simulate::stability::vertices_pile_up;
use std::sync::Arc;

/// One effect on the droplets of a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Effect {
    /// Its name.
    pub name: &'static str,
    /// Whether it acts at any point of the block.
    pub on: bool,
    /// Why, in a few words.
    pub why: String,
}

fn effect(name: &'static str, on: bool, why: impl Into<String>) -> Effect {
    Effect { name, on, why: why.into() }
}

/// The effects of points of one model.
pub(super) fn of(points: &[Arc<Point>]) -> Vec<Effect> {
    let ring = |point: &Arc<Point>| matches!(point.model, Model::Deformable(_));
    let near_wall = match points.iter().any(|point| point.b0 > 0.0) {
        true => effect("near_wall_drag", true, span(points, "b0")),
        false => effect("near_wall_drag", false, "b0 = 0: no distance is computed"),
    };
    let [tension, perimeter, area, gravity, self_contact] = match points.iter().all(ring) {
        true => of_rings(points),
        false => of_no_ring(),
    };
    let contact = effect("contact", true, span(points, "e_w"));
    let liquid = |point: &Arc<Point>| is_darcy(point);
    let far_drag = match points.iter().all(liquid) {
        true => effect("far_drag", true, format!("{}: Darcy's law inside, no inertia", span(points, "v_t"))),
        false => effect("far_drag", true, span(points, "v_t")),
    };
    vec![tension, perimeter, area, gravity, contact, far_drag, near_wall, self_contact]
}

/// The same five effects for a soft particle, which has only gravity.
fn of_no_ring() -> [Effect; 5] {
    let [tension, perimeter, area, self_contact] =
        ["tension", "perimeter", "area", "self_contact"].map(|name| effect(name, false, "SP has no ring"));
    [tension, perimeter, area, effect("gravity", true, "drives along +x"), self_contact]
}

fn of_rings(points: &[Arc<Point>]) -> [Effect; 5] {
    let count = |counts: fn(&Deformable) -> bool| {
        let rings = points.iter().filter(|point| matches!(&point.model, Model::Deformable(ring) if counts(ring)));
        rings.count()
    };
    let all = points.len();
    let stiff = count(|ring| ring.kappa > 0.0);
    let liquid = count(|ring| ring.dynamics == Dynamics::Darcy) == all;
    let mut perimeter = match stiff {
        0 if liquid => "constant tension: vertices are kept even by motion along the outline".to_owned(),
        0 => "kappa = 0".to_owned(),
        some if some == all => span(points, "kappa"),
        some => format!("{} in {some} of {all} points, else 0", span(points, "kappa")),
    };
    let linear = count(is_linear);
    if linear > 0 {
        perimeter += &format!("; with the tension it makes one linear spring at {linear} of {all} points");
    }
    let hydrostatic = count(|ring| ring.gravity == GravityForm::Centroid) > 0;
    let gravity = if hydrostatic { "as hydrostatic pressure, along +x" } else { "drives along +x" };
    let repelled = count(|ring| ring.self_contact == SelfContact::Auto) > 0;
    let self_contact = match (repelled, count(vertices_pile_up)) {
        (false, _) => "switched off".to_owned(),
        (true, 0) => "only where the ring folds back".to_owned(),
        (true, piled) => format!(
            "where the ring folds back, and where vertices pile up, the tension being too weak to hold them, at {piled} \
             of {all} points: kappa = 0.318 would keep edges even",
        ),
    };
    [
        effect("tension", true, span(points, "gamma")),
        effect("perimeter", stiff > 0, perimeter),
        effect("area", true, span(points, "k_a")),
        effect("gravity", true, gravity),
        effect("self_contact", repelled, self_contact),
    ]
}

fn span(points: &[Arc<Point>], name: &str) -> String {
    format!("{name} = {}", Ends::of(points.iter().filter_map(|point| list::value(point, name)?.number())))
}

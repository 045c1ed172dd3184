//! Which effects act in a block, which do not, and why: what `plan` tells before anything runs.

use crate::campaign::file::interval::Short;
use crate::campaign::plan::ends;
use crate::parameters::{Deformable, GravityForm, Model, Point, SelfContact};
use crate::physics::ring::forces::tension::is_linear;
use crate::physics::simulate::stability::vertices_pile_up;
use std::sync::Arc;

/// One effect, on or off.
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
    let rings: Vec<&Deformable> = points
        .iter()
        .filter_map(|point| match &point.model {
            Model::Deformable(ring) => Some(ring),
            Model::Soft(_) => None,
        })
        .collect();
    let span = |name: &str, value: fn(&Deformable) -> f64| {
        format!("{name} = {}", Ends(ends(rings.iter().map(|ring| value(ring)))))
    };
    let mut effects = if rings.is_empty() {
        ["tension", "perimeter", "area"].map(|name| effect(name, false, "SP has no ring")).to_vec()
    } else {
        let stiff = rings.iter().filter(|ring| ring.kappa > 0.0).count();
        let perimeter = match stiff {
            0 => "kappa = 0".to_owned(),
            all if all == rings.len() => span("kappa", |ring| ring.kappa),
            some => format!("{} in {some} of {} points, else 0", span("kappa", |ring| ring.kappa), rings.len()),
        };
        let linear_spring = match rings.iter().filter(|ring| is_linear(ring)).count() {
            0 => String::new(),
            some => format!("; with the tension it makes one linear spring at {some} of {} points", rings.len()),
        };
        vec![
            effect("tension", true, span("gamma", |ring| ring.gamma)),
            effect("perimeter", stiff > 0, perimeter + &linear_spring),
            effect("area", true, span("k_a", |ring| ring.k_a)),
        ]
    };
    let stiffness = points.iter().map(|point| match &point.model {
        Model::Deformable(ring) => ring.e_w,
        Model::Soft(soft) => soft.e_w,
    });
    let (with_drag, with_repulsion, hydrostatic) = (
        points.iter().filter(|point| point.b0 > 0.0).count(),
        rings.iter().filter(|ring| ring.self_contact == SelfContact::Auto).count(),
        rings.iter().filter(|ring| ring.gravity == GravityForm::Centroid).count(),
    );
    let near_wall = match with_drag {
        0 => "b0 = 0: no distance is computed".to_owned(),
        _ => format!("b0 = {}", Ends(ends(points.iter().map(|point| point.b0)))),
    };
    let gravity = if hydrostatic > 0 { "as hydrostatic pressure, along +x" } else { "drives along +x" };
    let piled = rings.iter().filter(|ring| vertices_pile_up(ring)).count();
    let self_contact = match (rings.is_empty(), with_repulsion) {
        (true, _) => "SP has no ring".to_owned(),
        (_, 0) => "switched off".to_owned(),
        _ if piled == 0 => "only where the ring folds back".to_owned(),
        _ => format!(
            "where the ring folds back, and where vertices pile up, the tension being too weak to hold them, at {piled} of {} \
             points: kappa = 0.318 would keep edges even",
            rings.len()
        ),
    };
    effects.extend([
        effect("gravity", true, gravity),
        effect("contact", true, format!("e_w = {}", Ends(ends(stiffness)))),
        effect("far_drag", true, format!("v_t = {}", Ends(ends(points.iter().map(|point| point.v_t))))),
        effect("near_wall_drag", with_drag > 0, near_wall),
        effect("self_contact", with_repulsion > 0, self_contact),
    ]);
    effects
}

/// Smallest and largest of some numbers, as `0.01 .. 10` or as one number.
pub(super) struct Ends(pub(super) (f64, f64));

impl std::fmt::Display for Ends {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (low, high) = self.0;
        if low == high { write!(f, "{}", Short(low)) } else { write!(f, "{} .. {}", Short(low), Short(high)) }
    }
}

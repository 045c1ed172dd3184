//! Which effects act in a block, which do not, and why: what `plan` tells before anything runs.

use super::ends;
use crate::campaign::interval::Short;
use crate::job::{Deformable, Model, Point};
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
        vec![
            effect("tension", true, span("gamma", |ring| ring.gamma)),
            effect("perimeter", stiff > 0, perimeter),
            effect("area", true, span("k_a", |ring| ring.k_a)),
        ]
    };
    let stiffness = points.iter().map(|point| match &point.model {
        Model::Deformable(ring) => ring.e_w,
        Model::Soft(soft) => soft.e_w,
    });
    let self_contact = if rings.is_empty() { "SP has no ring" } else { "not asked for" };
    effects.extend([
        effect("gravity", true, "drives along +x"),
        effect("contact", true, format!("e_w = {}", Ends(ends(stiffness)))),
        effect("far_drag", true, format!("v_t = {}", Ends(ends(points.iter().map(|point| point.v_t))))),
        effect("near_wall_drag", false, "b0 = 0"),
        effect("self_contact", false, self_contact),
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

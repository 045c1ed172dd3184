//! Which setting a tolerance chose, and what it costs compared with the default.

use crate::campaign::choose::tolerance::{Choice, table};
use crate::campaign::plan::{Chosen, text::Ends};
use crate::parameters::{Point, Short};
use std::sync::Arc;

/// The step of a point, and its cost over that of the default setting.
type Seen = (f64, Option<f64>);

/// Groups the points that take the same setting, in the order of their first points.
pub(super) fn of(points: &[Arc<Point>], tolerance: f64) -> Vec<Chosen> {
    let mut groups: Vec<(Choice<'static>, Vec<Seen>)> = Vec::new();
    for choice in points.iter().filter_map(|point| table().choose(tolerance, point).ok()) {
        let seen = (choice.stepping.dt, choice.over_default);
        match groups.iter_mut().find(|group| (group.0.setting, group.0.default) == (choice.setting, choice.default)) {
            Some(group) => group.1.push(seen),
            None => groups.push((choice, vec![seen])),
        }
    }
    let chosen = |(choice, seen): (Choice<'_>, Vec<Seen>)| Chosen {
        integrator: choice.setting.integrator.name(),
        points: seen.len(),
        why: why(&choice, &seen, tolerance),
    };
    groups.into_iter().map(chosen).collect()
}

fn why(choice: &Choice<'_>, seen: &[Seen], tolerance: f64) -> String {
    let setting = choice.setting;
    let dt = Ends::of(seen.iter().map(|seen| seen.0)).cut();
    let against = match choice.default {
        Some(default) if default == setting => "; it is the default".to_owned(),
        Some(default) => {
            let (times, integrator) =
                (Ends::of(seen.iter().filter_map(|seen| seen.1)).cut(), default.integrator.name());
            format!(
                "; it takes {times} of the time of the default ({integrator}, n_vertices = 256), which is off by at most {} \
                 ({})",
                Short(default.error),
                default.of
            )
        }
        None => String::new(),
    };
    format!(
        "n_vertices = {}, dt = {dt}: for tolerance {} the cheapest measured {} ({}), off by at most {} ({}){against}",
        setting.n_vertices,
        Short(tolerance),
        choice.kind.place(),
        choice.scenes,
        Short(setting.error),
        setting.of
    )
}

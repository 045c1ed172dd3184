//! Thresholds as rows for programs: one for each throat and each tension of the campaign there.

use crate::parameters::Scene;
use crate::report::threshold::way;
use crate::store::ColumnKind::{self, Number, Text, Whole};
use crate::store::Value;
use crate::study::threshold::ThroatScene;

/// Names and kinds of the columns. `gamma_c` is empty where every droplet passes.
pub(crate) const COLUMNS: [(&str, ColumnKind); 13] = [
    ("scene", Text),
    ("w", Number),
    ("angle", Number),
    ("tip_radius", Number),
    ("w_ob", Number),
    ("sigma_ob", Number),
    ("delta", Number),
    ("slope_max", Number),
    ("h", Number),
    ("gamma_c", Number),
    ("way", Text),
    ("gamma", Number),
    ("passes", Whole),
];

/// The rows of all throats.
pub(crate) fn rows(scenes: &[ThroatScene]) -> impl Iterator<Item = Vec<Value>> + '_ {
    scenes.iter().flat_map(|scene| scene.gammas.iter().map(|gamma| row(scene, *gamma)))
}

fn row(scene: &ThroatScene, gamma: f64) -> Vec<Value> {
    let passage = &scene.passage;
    let geometry = match &scene.scene {
        Scene::Channel(channel) => [Some(channel.w), Some(channel.angle), Some(channel.tip_radius), None, None],
        Scene::Obstacles(field) => [None, None, None, Some(field.w_ob), Some(field.sigma_ob)],
        Scene::Plate | Scene::Disc(_) => [None; 5],
    };
    let gamma_c = Some(passage.gamma_c()).filter(|gamma_c| gamma_c.is_finite());
    let found = [passage.steepest.map(|held| held.slope), passage.steepest.map(|held| held.h), gamma_c];
    let mut row = vec![Value::from(scene.scene.name().to_owned())];
    row.extend(geometry.map(Value::from));
    row.push(scene.delta.into());
    row.extend(found.map(Value::from));
    row.push(way(passage.end).to_owned().into());
    row.extend([gamma.into(), i64::from(scene.lets_pass(gamma)).into()]);
    row
}

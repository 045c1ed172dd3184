//! Thresholds of passage: a table for people, rows for programs, and a plot.

mod plot;
mod rows;

pub(crate) use plot::svg;
pub(crate) use rows::{COLUMNS, rows};

use crate::parameters::Scene;
use crate::report::rounding::significant;
use crate::report::text_table::{NOTHING, TextTable, owned};
use crate::study::threshold::{End, ThroatScene};

/// The most tensions that a cell lists; of more it has the ends.
const MOST_LISTED: usize = 6;

const NOTE: &str = "\
P(h) is the least perimeter of a droplet whose centroid is held at h. A droplet passes if gamma < Gamma_c = M/max dP/dh.
Walls are hard, smooth and wetted; drag and inertia play no part, and neither do the springs of dynamics = \"vertex\".
";

const ARRAYS: &str = "\
Of an array this is one pair of discs, at the smallest gap and side by side across gravity; it has other places, too.
";

const AROUND: &str = "\
round: there the droplet folds round both discs from outside; below Gamma_c it does not stay, but does not go through,
and above it stays on the axis alone, as it may slide off sideways.
";

/// The table of all throats, channels first.
pub(crate) fn text(scenes: &[ThroatScene]) -> String {
    let (arrays, channels): (Vec<_>, Vec<_>) =
        scenes.iter().partition(|scene| matches!(scene.scene, Scene::Obstacles(_)));
    let mut out = String::new();
    if !channels.is_empty() {
        out += &table("Orifices of channels", &["w", "angle", "tip_radius", "delta"], &channels);
    }
    if !arrays.is_empty() {
        out += &table("Narrowest gaps of obstacle arrays", &["w_ob", "sigma_ob", "delta"], &arrays);
    }
    out += NOTE;
    out += if arrays.is_empty() { "" } else { ARRAYS };
    out + if scenes.iter().any(|scene| scene.passage.end == End::Around) { AROUND } else { "" }
}

fn table(title: &str, keys: &[&str], scenes: &[&ThroatScene]) -> String {
    let measured = owned(["max dP/dh", "at h", "Gamma_c", "way", "gammas that pass", "that stay"]);
    let headers = keys.iter().map(|key| (*key).to_owned()).chain(measured).collect();
    let rows = scenes.iter().map(|scene| cells(scene)).collect();
    TextTable { title: title.to_owned(), headers, rows, names: 0, keys: keys.len() }.text()
}

fn cells(scene: &ThroatScene) -> Vec<String> {
    let passage = &scene.passage;
    let keys = match &scene.scene {
        Scene::Channel(channel) => vec![channel.w, channel.angle, channel.tip_radius, scene.delta],
        Scene::Obstacles(field) => vec![field.w_ob, field.sigma_ob, scene.delta],
        Scene::Plate | Scene::Disc(_) => vec![],
    };
    let mut cells: Vec<String> = keys.into_iter().map(|key| significant(key, 4)).collect();
    match passage.steepest {
        Some(held) => {
            cells.extend([significant(held.slope, 5), format!("{:.4}", held.h), significant(passage.gamma_c(), 5)]);
        }
        None => cells.extend(owned([NOTHING, NOTHING, if passage.end == End::Closed { "0" } else { "any" }])),
    }
    cells.push(way(passage.end).to_owned());
    let (pass, stay): (Vec<f64>, Vec<f64>) = scene.gammas.iter().partition(|gamma| scene.lets_pass(**gamma));
    cells.extend([pass, stay].map(|gammas| listed(&gammas)));
    cells
}

/// How a path ends, in a word.
fn way(end: End) -> &'static str {
    match end {
        End::Free => "free",
        End::Closed => "closed",
        End::Through => "through",
        End::Around => "round",
    }
}

fn listed(gammas: &[f64]) -> String {
    let text = |gamma: &f64| significant(*gamma, 4);
    match gammas {
        [] => NOTHING.to_owned(),
        [first, .., last] if gammas.len() > MOST_LISTED => {
            format!("{} .. {} ({})", text(first), text(last), gammas.len())
        }
        few => few.iter().map(text).collect::<Vec<_>>().join(" "),
    }
}

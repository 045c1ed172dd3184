//! Combines the sections of a file: inheritance, defaults, and the product of the axes of every block.

use crate::campaign::file::Block;
use crate::campaign::file::checks::{Breach, CHECKS, measured};
use crate::campaign::file::draft::Draft;
use crate::campaign::file::grid::place_on_axes;
use crate::campaign::file::interval::Short;
use crate::campaign::file::keys::{Fallback, Id, KEYS, Key, Meaning, Place, Value, rows};
use crate::campaign::file::problem::Problems;
use crate::campaign::file::scalar::{allowed, within};
use crate::campaign::file::section::{Entry, Given, Inherited, Item, Section};
use crate::parameters::{Point, PointId};
use rayon::prelude::*;
use std::collections::HashSet;
use std::sync::Arc;

/// Most jobs of one campaign.
pub const MOST_JOBS: u64 = 10_000_000;

/// The blocks of a file; a block that has a mistake is left out, and the mistake noted.
pub(super) fn blocks(top: &Section, own: Option<&[Section]>, problems: &mut Problems<'_>) -> Vec<Block> {
    let views: Vec<Inherited<'_>> = match own {
        None => vec![Inherited { top, own: None }],
        Some(sections) => sections.iter().map(|own| Inherited { top, own: Some(own) }).collect(),
    };
    names(top, own.unwrap_or_default(), problems);
    idle_keys(top, &views, problems);
    let mut jobs_left = MOST_JOBS;
    views.iter().filter_map(|view| block(*view, &mut jobs_left, problems)).collect()
}

/// Every section has a name, and no two blocks the same.
fn names(top: &Section, own: &[Section], problems: &mut Problems<'_>) {
    let mut seen = HashSet::new();
    for (section, path) in std::iter::once((top, "name")).chain(own.iter().map(|block| (block, "block.name"))) {
        let Some(entry) = section.get(Id::Name) else {
            let help = allowed(rows("name"));
            problems.add(section.span.clone(), Some(path.to_owned()), "the name is missing".to_owned(), Some(help));
            continue;
        };
        let repeated = section.text(Id::Name).is_some_and(|name| path == "block.name" && !seen.insert(name));
        if repeated {
            let help = "give each block a name of its own".to_owned();
            let message = "another block has this name".to_owned();
            problems.add(entry.span.clone(), Some(entry.path.clone()), message, Some(help));
        }
    }
}

/// A key must mean something where it stands; a fixed value at the top, for one block at least.
fn idle_keys(top: &Section, views: &[Inherited<'_>], problems: &mut Problems<'_>) {
    for view in views {
        let (Some(model), Some(scene)) = (view.word(Id::Model), view.word(Id::Scene)) else { continue };
        let inherited_axes = top.entries.iter().filter(|entry| entry.on_grid && !view.section().has_grid);
        let own = view.own.map_or(&[] as &[Entry], |own| &own.entries);
        for entry in own.iter().chain(inherited_axes).filter(|entry| !means_something(entry, model, scene)) {
            idle(entry, view, problems);
        }
    }
    for entry in top.entries.iter().filter(|entry| !entry.on_grid) {
        let useful = |view: &Inherited<'_>| match (view.word(Id::Model), view.word(Id::Scene)) {
            (Some(model), Some(scene)) => means_something(entry, model, scene),
            _ => true,
        };
        if let (Some(view), false) = (views.first(), views.iter().any(useful)) {
            idle(entry, view, problems);
        }
    }
}

fn means_something(entry: &Entry, model: &str, scene: &str) -> bool {
    KEYS.iter().any(|key| key.id == entry.id && key.means_something(model, scene))
}

fn idle(entry: &Entry, view: &Inherited<'_>, problems: &mut Problems<'_>) {
    let Some(key) = KEYS.iter().find(|key| key.id == entry.id) else { return };
    let (what, name, needed) = match key.meaning {
        Meaning::Model(needed) => ("model", view.word(Id::Model), needed),
        Meaning::Scene(needed) => ("scene", view.word(Id::Scene), needed),
        Meaning::Always => return,
    };
    let message = format!("it means nothing for {what} {}", name.unwrap_or_default());
    let help = if entry.on_grid && !view.section().has_grid {
        format!("{} ({}) is of {what} {needed}: give this block a grid of its own", key.name, key.doc)
    } else {
        format!("{} ({}) is of {what} {needed}: leave it out", key.name, key.doc)
    };
    problems.add(entry.span.clone(), Some(entry.path.clone()), message, Some(help));
}

/// One axis of a block: its key and values.
struct Axis<'s> {
    key: &'static Key,
    entry: &'s Entry,
    items: &'s [Item],
}

fn block(view: Inherited<'_>, jobs_left: &mut u64, problems: &mut Problems<'_>) -> Option<Block> {
    let mut draft = Draft::new();
    let mut axes = Vec::new();
    // Model and scene decide which keys count; when one is missing or faulty, only the others of the table are looked at.
    let (model, scene) = (view.word(Id::Model), view.word(Id::Scene));
    let mut sound = model.is_some() && scene.is_some();
    let counts = |key: &&Key| match (key.place, key.id) {
        (Place::File, _) | (_, Id::Name) => false,
        _ => key.means_something(model.unwrap_or_default(), scene.unwrap_or_default()),
    };
    for key in KEYS.iter().filter(counts) {
        match (view.get(key.id).map(|entry| (entry, &entry.given)), key.default) {
            (None, Fallback::Is(value)) => draft.set(key.id, value),
            (None, Fallback::Required) => {
                missing(key, view, problems);
                sound = false;
            }
            (Some((_, Given::Broken | Given::Text(_))), _) => sound = false,
            (Some((entry, Given::Fixed(item))), _) => {
                sound &= in_range_of_model(key, entry, item, problems);
                draft.set(key.id, item.value);
            }
            (Some((entry, Given::Axis(items))), _) => {
                for item in items {
                    sound &= in_range_of_model(key, entry, item, problems);
                }
                axes.push(Axis { key, entry, items });
            }
        }
    }
    sound &= chosen_once(&draft, view, problems) & until_is_whole(view, problems);
    if !sound {
        return None;
    }
    // File order of the axes; the tree keeps its keys sorted by name.
    axes.sort_by_key(|axis| axis.entry.span.start);
    let first_seed = draft.number(Id::FirstSeed) as u64;
    let runs = draft.number(Id::RunsPerPoint) as u64;
    let size = axes.iter().fold(runs, |size, axis| size.saturating_mul(axis.items.len() as u64));
    let Some(left) = jobs_left.checked_sub(size) else {
        let entry = view.get(Id::RunsPerPoint)?;
        let message = format!("with this block the campaign has more than {} jobs", Short(MOST_JOBS as f64));
        let help = format!("the block alone has {size}: lower runs_per_point or the number of values on an axis");
        problems.add(entry.span.clone(), Some(entry.path.clone()), message, Some(help));
        return None;
    };
    *jobs_left = left;
    let (points, point_ids) = product(&draft, &axes, view, (size / runs) as usize, problems);
    let name = view.section().text(Id::Name)?.to_owned();
    let integrator = draft.integrator();
    let (tolerance, until) = (draft.tolerance(), draft.until());
    Some(Block { name, points, point_ids, seeds: first_seed..first_seed + runs, integrator, until, tolerance })
}

/// What stands under `until` needs the error that it is about.
fn until_is_whole(view: Inherited<'_>, problems: &mut Problems<'_>) -> bool {
    let idle = [Id::MaxRuns, Id::Estimate].into_iter().filter_map(|id| view.get(id)).next();
    let (None, Some(entry)) = (view.get(Id::RelativeError), idle) else { return true };
    let help = "write how narrow the interval has to be, like until = { relative_error = 0.1 }".to_owned();
    problems.add(entry.span.clone(), Some(entry.path.clone()), "`until` has no relative_error".to_owned(), Some(help));
    false
}

/// What a tolerance chooses must not be given as well.
fn chosen_once(draft: &Draft, view: Inherited<'_>, problems: &mut Problems<'_>) -> bool {
    let chosen = [Id::NVertices, Id::Dt, Id::Integrator].map(|id| view.get(id));
    let twice: Vec<&Entry> = chosen.into_iter().flatten().filter(|_| draft.tolerance().is_some()).collect();
    for entry in &twice {
        let name = KEYS.iter().find(|key| key.id == entry.id).map_or("", |key| key.name);
        let message = format!("`tolerance` is given as well, and chooses `{name}`");
        let help = format!("keep `tolerance` or `{name}`; a block takes back the file's with tolerance = \"none\"");
        problems.add(entry.span.clone(), Some(entry.path.clone()), message, Some(help));
    }
    twice.is_empty()
}

fn missing(key: &Key, view: Inherited<'_>, problems: &mut Problems<'_>) {
    let (span, reason) = match key.meaning {
        Meaning::Always => (view.header(), "it is missing".to_owned()),
        Meaning::Model(name) => (
            view.get(Id::Model).map_or_else(|| view.header(), |entry| entry.span.clone()),
            format!("model {name} needs it"),
        ),
        Meaning::Scene(name) => (
            view.get(Id::Scene).map_or_else(|| view.header(), |entry| entry.span.clone()),
            format!("scene {name} needs it"),
        ),
    };
    let grid = if key.is_axis() { ", or an axis of the grid" } else { "" };
    let help = format!("{} ({}) must be {}{grid}", key.name, key.doc, key.kind.allowed());
    problems.add(span, Some(key.name.to_owned()), reason, Some(help));
}

/// The range that holds for the model of this block; only `e_w` has one for each.
fn in_range_of_model(key: &'static Key, entry: &Entry, item: &Item, problems: &mut Problems<'_>) -> bool {
    let Value::Number(number) = item.value else { return true };
    let verdict = within(std::iter::once(key), number);
    if let Err((message, help)) = &verdict {
        let Meaning::Model(model) = key.meaning else { return true };
        let message = format!("{message} for model {model}");
        problems.add(item.span.clone(), Some(entry.path.clone()), message, Some(help.clone()));
    }
    verdict.is_ok()
}

/// All grid points of a block, the last axis running fastest; the worst breach of each check is noted.
fn product(
    draft: &Draft,
    axes: &[Axis<'_>],
    view: Inherited<'_>,
    size: usize,
    problems: &mut Problems<'_>,
) -> (Vec<Arc<Point>>, Vec<PointId>) {
    let lengths: Vec<usize> = axes.iter().map(|axis| axis.items.len()).collect();
    let made = |index: usize| {
        let mut draft = draft.clone();
        for (axis, place) in axes.iter().zip(place_on_axes(&lengths, index)) {
            draft.set(axis.key.id, axis.items[place].value);
        }
        let (point, limit) = draft.point();
        let id = point.id();
        let refused = draft.tolerance().and_then(|tolerance| measured(&point, tolerance));
        let checks = CHECKS.iter().filter_map(|check| check(&point, &limit));
        let breaches: Vec<Breach> = checks.chain(refused).collect();
        ((Arc::new(point), id), breaches)
    };
    let ((points, point_ids), breaches): ((Vec<_>, Vec<_>), Vec<_>) = (0..size).into_par_iter().map(made).unzip();
    // Each check blames a key of its own.
    for blamed in [Id::Tolerance, Id::Dt, Id::Integrator, Id::Density, Id::SigmaOb, Id::HStart] {
        let of_all =
            breaches.iter().enumerate().flat_map(|(index, list)| list.iter().map(move |breach| (index, breach)));
        let breaches: Vec<(usize, &Breach)> = of_all.filter(|(_, breach)| breach.id == blamed).collect();
        // The first of the worst, whatever the number of threads.
        let worst = breaches.iter().rev().max_by(|a, b| a.1.excess.total_cmp(&b.1.excess));
        let Some((index, worst)) = worst else { continue };
        // A key that was left out has its default from the scene.
        let Some(entry) = view.get(worst.id).or_else(|| view.get(Id::Scene)) else { continue };
        let place =
            axes.iter().zip(place_on_axes(&lengths, *index)).map(|(axis, place)| match axis.items[place].value {
                Value::Number(number) => format!("{} = {}", axis.key.name, Short(number)),
                Value::Word(word) => format!("{} = \"{word}\"", axis.key.name),
            });
        let place = place.collect::<Vec<_>>().join(", ");
        let message = match place.is_empty() {
            true => worst.message.clone(),
            false => format!("{}, at {place} ({} of {size} grid points)", worst.message, breaches.len()),
        };
        problems.add(entry.span.clone(), Some(entry.path.clone()), message, Some(worst.help.clone()));
    }
    (points, point_ids)
}

//! Combines the sections of a file into blocks: inheritance, defaults, and what the keys of a block need of each other.

use crate::campaign::file::Block;
use crate::campaign::file::draft::Draft;
use crate::campaign::file::keys::{KEYS, Key, rows};
use crate::campaign::file::problem::{Mistake, Problems};
use crate::campaign::file::product::{Axis, Product};
use crate::campaign::file::scalar::{allowed, within};
use crate::campaign::file::section::{Assignment, Given, Inherited, Item, Section};
use crate::parameters::{Applies, Domain, Short, Value};
use std::collections::HashSet;

/// Most jobs of one campaign.
const MOST_JOBS: u64 = 10_000_000;

/// The blocks of a file; a block that has a mistake is left out, and the mistake noted.
pub(super) fn blocks(top: &Section, own: Option<&[Section]>, problems: &mut Problems<'_>) -> Vec<Block> {
    let views = views(top, own);
    names(top, own.unwrap_or_default(), problems);
    idle_keys(top, &views, problems);
    let mut jobs_left = MOST_JOBS;
    views.iter().filter_map(|view| block(*view, &mut jobs_left, problems)).collect()
}

/// What counts for each block.
fn views<'s>(top: &'s Section, own: Option<&'s [Section]>) -> Vec<Inherited<'s>> {
    match own {
        None => vec![Inherited { top, own: None }],
        Some(sections) => sections.iter().map(|own| Inherited { top, own: Some(own) }).collect(),
    }
}

/// Notes what older programs ran and no physics allows.
pub(super) fn refuse_outdated(top: &Section, own: Option<&[Section]>, problems: &mut Problems<'_>) {
    views(top, own).into_iter().for_each(|view| falls(view, problems));
}

/// Every section has a name, and no two blocks the same.
fn names(top: &Section, own: &[Section], problems: &mut Problems<'_>) {
    let mut seen = HashSet::new();
    for (section, path) in std::iter::once((top, "name")).chain(own.iter().map(|block| (block, "block.name"))) {
        let Some(name) = section.get("name") else {
            problems.note(&section.span, "the name is missing").key(path).help(allowed(rows("name")));
            continue;
        };
        if path == "block.name" && section.text("name").is_some_and(|text| !seen.insert(text)) {
            let mistake = Mistake::new("another block has this name").help("give each block a name of its own");
            problems.note(&name.span, mistake).key(&name.path);
        }
    }
}

/// A key must mean something where it stands; a fixed value at the top, for one block at least.
fn idle_keys(top: &Section, views: &[Inherited<'_>], problems: &mut Problems<'_>) {
    for view in views {
        let (Some(model), Some(scene)) = (view.word("model"), view.word("scene")) else { continue };
        let inherited_axes = top.assignments.iter().filter(|given| given.on_grid && !view.section().has_grid);
        let own = view.own.map_or(&[] as &[Assignment], |own| &own.assignments);
        for given in own.iter().chain(inherited_axes).filter(|given| !means_something(given, model, scene)) {
            idle(given, view, problems);
        }
    }
    for given in top.assignments.iter().filter(|given| !given.on_grid) {
        let useful = |view: &Inherited<'_>| match (view.word("model"), view.word("scene")) {
            (Some(model), Some(scene)) => means_something(given, model, scene),
            _ => true,
        };
        if let (Some(view), false) = (views.first(), views.iter().any(useful)) {
            idle(given, view, problems);
        }
    }
}

fn means_something(given: &Assignment, model: &str, scene: &str) -> bool {
    rows(given.name).any(|key| key.applies.to(model, scene))
}

/// Notes that a key means nothing for the model or in the scene of a block.
fn idle(given: &Assignment, view: &Inherited<'_>, problems: &mut Problems<'_>) {
    let Some(key) = rows(given.name).next() else { return };
    let (what, name, needed) = match key.applies {
        Applies::Model(needed) => ("model", view.word("model"), needed),
        Applies::Scene(needed) => ("scene", view.word("scene"), needed),
        Applies::Always => return,
    };
    let inherited = given.on_grid && !view.section().has_grid;
    let way_out = if inherited { "give this block a grid of its own" } else { "leave it out" };
    problems
        .note(&given.span, format!("it means nothing for {what} {}", name.unwrap_or_default()))
        .key(&given.path)
        .help(format!("{} belongs to {what} {needed}: {way_out}", key.described()));
}

fn block(view: Inherited<'_>, jobs_left: &mut u64, problems: &mut Problems<'_>) -> Option<Block> {
    let (draft, axes) = values(view, problems)?;
    let first_seed = draft.number("first_seed") as u64;
    let runs = draft.number("runs_per_point") as u64;
    let size = axes.iter().fold(runs, |size, axis| size.saturating_mul(axis.items.len() as u64));
    let Some(left) = jobs_left.checked_sub(size) else {
        let given = view.get("runs_per_point")?;
        problems
            .note(&given.span, format!("with this block the campaign has more than {} jobs", Short(MOST_JOBS as f64)))
            .key(&given.path)
            .help(format!("the block alone has {size}: lower runs_per_point or the number of values on an axis"));
        return None;
    };
    *jobs_left = left;
    let (points, point_ids) = Product { draft: &draft, axes: &axes, view }.points(problems);
    Some(Block {
        name: view.section().text("name")?.to_owned(),
        points,
        point_ids,
        seeds: first_seed..first_seed + runs,
        integrator: draft.integrator(),
        open: draft.open(),
        until: draft.until(),
        tolerance: draft.tolerance(),
    })
}

/// A value for every key that means something in a block, and the axes of its grid in the order of the file; `None`
/// after a mistake.
///
/// Model and scene decide which keys count. When one of them is missing or faulty, only keys that always count are
/// looked at.
fn values<'s>(view: Inherited<'s>, problems: &mut Problems<'_>) -> Option<(Draft, Vec<Axis<'s>>)> {
    let (model, scene) = (view.word("model"), view.word("scene"));
    let mut sound = model.is_some() && scene.is_some();
    let counts = |key: &&Key| {
        !matches!(key.domain, Domain::Text) && key.applies.to(model.unwrap_or_default(), scene.unwrap_or_default())
    };
    let (mut draft, mut axes) = (Draft::default(), Vec::new());
    for key in KEYS.iter().filter(counts) {
        if key.instead_of().is_some_and(|_| view.get(key.name).is_none()) || given_otherwise(key, view).is_some() {
            continue;
        }
        let Some(assignment) = view.get(key.name) else {
            match key.default {
                Some(value) => drop(draft.push(key, value)),
                None => {
                    missing(key, view, problems);
                    sound = false;
                }
            }
            continue;
        };
        let items = match &assignment.given {
            Given::Broken | Given::Text(_) => &[],
            Given::Fixed(item) => std::slice::from_ref(item),
            Given::Axis(items) => items.as_slice(),
        };
        for item in items {
            sound &= in_range_of_model(key, assignment, item, problems);
        }
        let Some(first) = items.first() else {
            sound = false;
            continue;
        };
        let place = draft.push(key, first.value);
        if assignment.on_grid {
            axes.push(Axis { key, place, items, start: assignment.span.start });
        }
    }
    sound &= chosen_once(&draft, view, problems) & one_form(view, problems) & until_is_whole(view, problems);
    sound &= fits_dynamics(view, problems);
    // The tree of the file keeps its keys sorted by name.
    axes.sort_by_key(|axis| axis.start);
    sound.then_some((draft, axes))
}

/// The key that gives `key` in another form in this block.
fn given_otherwise<'s>(key: &Key, view: Inherited<'s>) -> Option<&'s Assignment> {
    KEYS.iter().filter(|other| other.instead_of() == Some(key.name)).find_map(|other| view.get(other.name))
}

/// No parameter may be given in two forms.
fn one_form(view: Inherited<'_>, problems: &mut Problems<'_>) -> bool {
    let twice = |key: &'static Key| Some((key.name, given_otherwise(key, view)?, view.get(key.name)?));
    let twice: Vec<_> = KEYS.iter().filter_map(twice).collect();
    for &(name, other, _) in &twice {
        problems
            .note(&other.span, format!("`{name}` is given as well, and means the same"))
            .key(&other.path)
            .help(format!("keep `{}` or `{name}`", other.name));
    }
    twice.is_empty()
}

/// What stands under `until` needs the error that it is about.
fn until_is_whole(view: Inherited<'_>, problems: &mut Problems<'_>) -> bool {
    if let (Some(error), Some(scene), true) = (view.get("relative_error"), view.word("scene"), wants_lambda(view))
        && scene != "obstacles"
    {
        problems
            .note(
                &error.span,
                format!("there is no decay length in scene {scene}, and the interval is to be of lambda"),
            )
            .key(&error.path)
            .help("write estimate = \"v_g\" beside it, or leave it out");
        return false;
    }
    let idle = ["max_runs", "estimate"].into_iter().find_map(|name| view.get(name));
    let (None, Some(idle)) = (view.get("relative_error"), idle) else { return true };
    problems
        .note(&idle.span, "`until` has no relative_error")
        .key(&idle.path)
        .help("write how narrow the interval has to be, like until = { relative_error = 0.1 }");
    false
}

/// Whether `until` is about the decay length.
fn wants_lambda(view: Inherited<'_>) -> bool {
    let is_none = view.word("relative_error") == Some("none");
    !is_none && view.word("estimate").is_none_or(|estimate| estimate == "lambda")
}

/// What a tolerance chooses must not be given as well.
fn chosen_once(draft: &Draft, view: Inherited<'_>, problems: &mut Problems<'_>) -> bool {
    if draft.tolerance().is_none() {
        return true;
    }
    let chosen = ["n_vertices", "dt", "integrator"].map(|name| view.get(name));
    for given in chosen.iter().flatten() {
        let name = given.name;
        problems
            .note(&given.span, format!("`tolerance` is given as well, and chooses `{name}`"))
            .key(&given.path)
            .help(format!("keep `tolerance` or `{name}`; a block takes back the file's with tolerance = \"none\""));
    }
    chosen.iter().all(Option::is_none)
}

/// Keys of the ring of springs mean nothing for a liquid, and its own key nothing for the ring.
fn fits_dynamics(view: Inherited<'_>, problems: &mut Problems<'_>) -> bool {
    if view.word("model") != Some("DP") {
        return true;
    }
    // What is given and is no word is reported elsewhere.
    let darcy = view.get("dynamics").is_none_or(|_| view.word("dynamics") == Some("darcy"));
    let idle: &[(&'static str, &[&str])] = match darcy {
        true => &[
            ("kappa", &["auto"]),
            ("eps", &[]),
            ("wall", &["total"]),
            ("contact", &["edge"]),
            ("gravity", &["centroid"]),
            ("integrator", &["auto", "adaptive"]),
            ("tolerance", &["none"]),
        ],
        false if has_fixed_steps(view) => &[("step_error", &[])],
        false => &[],
    };
    let means_nothing = |&(name, fitting): &(&'static str, &[&str])| {
        let given = view.get(name)?;
        (!view.word(name).is_some_and(|word| fitting.contains(&word))).then_some(given)
    };
    let found: Vec<_> = idle.iter().filter_map(means_nothing).collect();
    for given in &found {
        let (message, help) = match darcy {
            true => (
                "it means nothing for dynamics = \"darcy\", a liquid of constant tension without springs or inertia",
                "leave it out, or write dynamics = \"vertex\", the ring of springs",
            ),
            false => (
                "it means nothing for steps of fixed length",
                "leave it out, or leave out dt and write integrator = \"adaptive\"",
            ),
        };
        problems.note(&given.span, message).key(&given.path).help(help);
    }
    found.is_empty()
}

/// Whether a ring of springs is asked to take steps of fixed length.
fn has_fixed_steps(view: Inherited<'_>) -> bool {
    match view.word("integrator") {
        Some("verlet" | "implicit") => true,
        Some("adaptive") => false,
        _ => view.get("dt").is_some() && view.word("dt").is_none(),
    }
}

fn missing(key: &Key, view: Inherited<'_>, problems: &mut Problems<'_>) {
    let place = |name| view.get(name).map_or_else(|| view.header(), |given| given.span.clone());
    let (span, reason) = match key.applies {
        Applies::Always => (view.header(), "it is missing".to_owned()),
        Applies::Model(name) => (place("model"), format!("model {name} needs it")),
        Applies::Scene(name) => (place("scene"), format!("scene {name} needs it")),
    };
    let grid = if key.is_axis() { ", or an axis of the grid" } else { "" };
    let help = format!("{} must be {}{grid}", key.described(), key.domain.allowed());
    problems.note(&span, reason).key(key.name).help(help);
}

/// A ring of springs under hydrostatic pressure does not fall as it should: pressure has no part along the outline, so
/// nothing holds its vertices against the drag, which sweeps them upstream. On a plate nothing moves in the end.
fn falls(view: Inherited<'_>, problems: &mut Problems<'_>) {
    let given = view.get("gravity").filter(|_| view.word("gravity") == Some("centroid"));
    let is_ring = view.word("model") == Some("DP") && view.word("dynamics") == Some("vertex");
    if let (Some(given), true, true) = (given, is_ring, view.word("scene") != Some("plate")) {
        problems
            .note(&given.span, "the drag on a ring of springs that falls under it sweeps the vertices upstream")
            .key(&given.path)
            .help("write dynamics = \"darcy\", which is hydrostatic by itself, or gravity = \"vertex\"");
    }
}

/// Whether a number lies in the range that holds for the model of this block; only `e_w` has one for each model.
fn in_range_of_model(key: &'static Key, given: &Assignment, item: &Item, problems: &mut Problems<'_>) -> bool {
    let (Value::Number(number), Applies::Model(model)) = (item.value, key.applies) else { return true };
    let Err(mistake) = within(std::iter::once(key), number) else { return true };
    let message = format!("{} for model {model}", mistake.message);
    problems.note(&item.span, Mistake { message, ..mistake }).key(&given.path);
    false
}

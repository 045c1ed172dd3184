//! The reference of the keys of campaign files: as lines, in full, and as the page docs/keys.md.

use crate::campaign::file::axis::RANGE;
use crate::campaign::file::keys::{Home, KEYS, Key, TABLES, Table, names as key_names};
use crate::parameters::{Applies, list};
use std::fmt::Write;

/// Width of the names in a list, and of the labels in a full answer.
pub(crate) const NAMES: usize = 15;

/// A line for each key, one kind of key after the other.
pub(crate) fn all() -> String {
    let mut text = String::new();
    for (kind, rows) in kinds() {
        let _ = writeln!(text, "{kind}");
        for key in rows {
            let only = match key.applies {
                Applies::Scene(name) => format!(" (scene {name})"),
                Applies::Model(_) | Applies::Always => String::new(),
            };
            let unit = if key.unit.is_empty() { String::new() } else { format!(", in {}", key.unit) };
            let _ = writeln!(text, "  {:<NAMES$}{}{unit}{only}", key.name, key.about);
        }
        text.push('\n');
    }
    text += "tables\n";
    for table in TABLES {
        let _ = writeln!(text, "  {:<NAMES$}{}", table.name, table.about);
    }
    text + "\nAll about one: meniscus keys NAME\n"
}

/// All that there is to say of a key or of a table; `None` if no key has that name.
pub(crate) fn one(name: &str) -> Option<String> {
    let rows: Vec<&Key> = KEYS.iter().filter(|key| key.name == name).collect();
    if rows.is_empty() {
        return TABLES.iter().find(|table| table.name == name).map(of_table);
    }
    Some(rows.into_iter().map(in_full).collect::<Vec<_>>().join("\n"))
}

/// The names of all keys and tables.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    KEYS.iter().map(|key| key.name).chain(TABLES.iter().map(|table| table.name))
}

fn in_full(key: &Key) -> String {
    let mut text = format!("{:<NAMES$}{}\n", key.name, key.about);
    let mut line = |label: &str, what: &str| {
        if !what.is_empty() {
            let _ = writeln!(text, "  {label:<width$}{what}", width = NAMES - 2);
        }
    };
    line("unit", key.unit);
    line("allowed", &key.domain.allowed());
    line("default", &key.default_in_words());
    line("only", &applies(key));
    line("stands", &key.place());
    let is_column = list::columns().any(|column| column.name == key.name);
    line("column", if is_column { "of runs, by the same name" } else { "" });
    text
}

fn of_table(table: &Table) -> String {
    let mut text = format!("{:<NAMES$}{}\n", table.name, table.about);
    let keys = key_names(|key| key.homes.contains(&table.home));
    let _ = writeln!(text, "  {:<width$}{}", "keys", keys.join(", "), width = NAMES - 2);
    if table.home == Home::Grid {
        text +=
            "  a list holds values and ranges, [0.1, { from = 1.0, to = 10.0, points = 3 }]; a range has the keys\n";
        for (name, about) in RANGE {
            let _ = writeln!(text, "    {name:<width$}{about}", width = NAMES - 4);
        }
    }
    text
}

/// Where a key means something, in words; empty where it always does.
fn applies(key: &Key) -> String {
    match key.applies {
        Applies::Always => String::new(),
        Applies::Model(name) => format!("for model {name}"),
        Applies::Scene(name) => format!("in scene {name}"),
    }
}

/// The kinds of keys, in the order of the table.
fn kinds() -> impl Iterator<Item = (&'static str, Vec<&'static Key>)> {
    type Is = fn(&Key) -> bool;
    const KINDS: [(&str, Is); 5] = [
        ("of a campaign", |key| key.parameter.is_none()),
        ("of every droplet", |key| key.parameter.is_some() && key.applies == Applies::Always),
        ("of the deformable particle", |key| key.parameter.is_some() && key.applies == Applies::Model("DP")),
        ("of the soft particle", |key| key.parameter.is_some() && key.applies == Applies::Model("SP")),
        ("of scenes", |key| matches!(key.applies, Applies::Scene(_))),
    ];
    KINDS.into_iter().map(|(kind, is)| (kind, KEYS.iter().filter(|key| is(key)).collect()))
}

/// The page docs/keys.md.
pub(crate) fn markdown() -> String {
    let mut page = "# The keys of campaign files\n\n\
        `meniscus keys --markdown` writes this page from the list of parameters; `meniscus keys NAME` says the same of \
        one key. A key that is a\nparameter is a column of `runs` by the same name. Units: droplet diameter, gravity and \
        areal density are 1.\n"
        .to_owned();
    for (kind, rows) in kinds() {
        let _ = write!(page, "\n## Keys {kind}\n\n| key | meaning | unit | allowed | default | stands |\n");
        page += "|---|---|---|---|---|---|\n";
        for key in rows {
            let meaning = match applies(key) {
                always if always.is_empty() => key.about.to_owned(),
                applies => format!("{} ({applies})", key.about),
            };
            let (name, unit) = (format!("`{}`", key.name), key.unit.to_owned());
            let cells = [name, meaning, unit, key.domain.allowed(), key.default_in_words(), key.place()];
            let _ =
                writeln!(page, "| {} |", cells.map(|cell| cell.replace('|', "\\|").replace('<', "&lt;")).join(" | "));
        }
    }
    page += "\n## Tables\n\n| table | meaning |\n|---|---|\n";
    for table in TABLES {
        let _ = writeln!(page, "| `{}` | {} |", table.name, table.about);
    }
    page += "\n## Ranges\n\nAn axis of a grid is a range, or a list of values and ranges: `gamma = [0.1, { from = 1.0, \
        to = 10.0, points = 3, scale = \"log\" }]`.\n\n| key | meaning |\n|---|---|\n";
    for (name, about) in RANGE {
        let _ = writeln!(page, "| `{name}` | {about} |");
    }
    page
}

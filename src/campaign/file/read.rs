//! Walks the TOML tree once and notes everything that is wrong with single keys: unknown, misplaced, of a wrong type,
//! out of every range.

use crate::campaign::file::axis::axis;
use crate::campaign::file::keys::{Home, Key, TABLES, names, rows};
use crate::campaign::file::problem::{Mistake, Problems};
use crate::campaign::file::scalar::{allowed, does_not_fit, read, with_article};
use crate::campaign::file::section::{Assignment, Given, Item, Section, Span};
use crate::campaign::file::spelling::nearest;
use crate::parameters::Domain;
use std::borrow::Cow;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

impl Home {
    fn holds(self, key: &Key) -> bool {
        key.homes.contains(&self)
    }

    /// The tables that may stand here.
    fn tables(self) -> impl Iterator<Item = &'static str> + Clone {
        TABLES.iter().filter(move |table| table.homes.contains(&self)).map(|table| table.name)
    }

    /// All names that may stand here, each once.
    fn names(self) -> Vec<&'static str> {
        let mut names = names(|key| self.holds(key));
        names.extend(self.tables());
        names
    }
}

/// The top level of a file and, if it has any, its blocks.
pub(super) fn file(root: &DeTable<'_>, problems: &mut Problems<'_>) -> (Section, Option<Vec<Section>>) {
    let top = section(root, Home::File, 0..0, problems);
    let blocks = root.get("block").map(|value| match value.get_ref() {
        DeValue::Array(list) if !list.is_empty() => {
            list.iter().filter_map(|element| block(element, problems)).collect()
        }
        other => {
            let message = format!("{} is not a list of blocks", with_article(other));
            problems.note(&value.span(), message).key("block").help("start each block with [[block]]");
            Vec::new()
        }
    });
    (top, blocks)
}

fn block(element: &Spanned<DeValue<'_>>, problems: &mut Problems<'_>) -> Option<Section> {
    let Some(table) = element.get_ref().as_table() else {
        let message = format!("{} is not a block", with_article(element.get_ref()));
        problems.note(&element.span(), message).key("block").help("start each block with [[block]]");
        return None;
    };
    Some(section(table, Home::Block, element.span(), problems))
}

fn section(table: &DeTable<'_>, home: Home, span: Span, problems: &mut Problems<'_>) -> Section {
    let mut section = Section { span, ..Section::default() };
    let prefix = if home == Home::Block { "block." } else { "" };
    for (key, value) in table {
        let path = format!("{prefix}{}", key.get_ref());
        match table_meant(key, value, home, &path, problems) {
            Some("limits") => inner(value, Home::Limits, &path, &mut section, problems),
            Some("until") => inner(value, Home::Until, &path, &mut section, problems),
            Some("grid") => {
                section.has_grid = true;
                inner(value, Home::Grid, &path, &mut section, problems);
            }
            Some(_) => {}
            None => section.assignments.extend(assignment(key, value, home, path, problems)),
        }
    }
    let sound = || section.assignments.iter().filter(|assignment| assignment.is_sound());
    for axis in sound().filter(|assignment| assignment.on_grid) {
        if let Some(twin) = sound().find(|other| !other.on_grid && other.name == axis.name) {
            let message = format!("it has a fixed value too, `{}`", twin.path);
            problems.note(&axis.span, message).key(&axis.path).help("keep the fixed value or the axis");
        }
    }
    section
}

/// Reads `limits`, `until` or `grid` into its section.
fn inner(value: &Spanned<DeValue<'_>>, home: Home, path: &str, section: &mut Section, problems: &mut Problems<'_>) {
    let Some(table) = value.get_ref().as_table() else {
        let message = format!("{} is not a table", with_article(value.get_ref()));
        problems.note(&value.span(), message).key(path).help(format!("write [{path}] and its keys below"));
        return;
    };
    for (key, value) in table {
        let path = format!("{path}.{}", key.get_ref());
        section.assignments.extend(assignment(key, value, home, path, problems));
    }
}

/// The table a key names; one with a misspelt name is reported, and then read as the one that was meant.
fn table_meant(
    key: &Spanned<Cow<'_, str>>,
    value: &Spanned<DeValue<'_>>,
    home: Home,
    path: &str,
    problems: &mut Problems<'_>,
) -> Option<&'static str> {
    let name = key.get_ref().as_ref();
    let tables = home.tables();
    if let Some(table) = tables.clone().find(|table| *table == name) {
        return Some(table);
    }
    let is_table = value.get_ref().is_table() || value.get_ref().is_array();
    let meant = nearest(name, tables).filter(|_| is_table && rows(name).next().is_none())?;
    problems.note(&key.span(), "unknown key").key(path).help(format!("did you mean `{meant}`?"));
    Some(meant)
}

/// Reads one key. An unknown one counts as the key that was probably meant, so that this is not reported as missing.
fn assignment(
    key: &Spanned<Cow<'_, str>>,
    value: &Spanned<DeValue<'_>>,
    home: Home,
    path: String,
    problems: &mut Problems<'_>,
) -> Option<Assignment> {
    let name = key.get_ref().as_ref();
    let (name, given) = match rows(name).next() {
        Some(known) if home.holds(known) => (known.name, given(known, value, home, &path, problems)),
        Some(known) => {
            let help = format!("{} stands {}", known.described(), known.place());
            problems.note(&key.span(), "this key does not belong here").key(&path).help(help);
            (known.name, Given::Broken)
        }
        None if problems.are_many() => {
            problems.note(&key.span(), "unknown key").key(&path);
            return None;
        }
        None => {
            let here = home.names();
            let meant = nearest(name, here.iter().copied()).or_else(|| nearest(name, names(|_| true)));
            let help = match meant {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("the keys here are {}", here.join(", ")),
            };
            problems.note(&key.span(), "unknown key").key(&path).help(help);
            (rows(meant?).next()?.name, Given::Broken)
        }
    };
    Some(Assignment { name, path, span: value.span(), on_grid: home == Home::Grid, given })
}

fn given(
    key: &'static Key,
    value: &Spanned<DeValue<'_>>,
    home: Home,
    path: &str,
    problems: &mut Problems<'_>,
) -> Given {
    let rows = rows(key.name);
    if home == Home::Grid {
        return axis(rows, value, path, problems).map_or(Given::Broken, Given::Axis);
    }
    let mistake = match (value.get_ref(), key.domain) {
        (DeValue::String(text), Domain::Text) if key.name != "name" || is_name(text) => {
            return Given::Text(text.clone().into_owned());
        }
        (DeValue::String(_), Domain::Text) => Mistake::new("this name cannot name a folder")
            .help("a name has 1 to 64 letters, digits, `_`, `-` and `.`, and starts with a letter or digit"),
        (other, Domain::Text) => does_not_fit(other).help(allowed(rows)),
        (DeValue::Array(_) | DeValue::Table(_), _) if key.is_axis() => {
            Mistake::new("only one value may stand here").help(format!("to sweep {}, write it under [grid]", key.name))
        }
        (other, _) => match read(rows, other) {
            Ok(read) => return Given::Fixed(Item { value: read, span: value.span() }),
            Err(mistake) => mistake,
        },
    };
    problems.note(&value.span(), mistake).key(path);
    Given::Broken
}

/// Names become folder names and SQL values.
fn is_name(text: &str) -> bool {
    let plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte));
    plain && text.len() <= 64 && text.bytes().next().is_some_and(|byte| byte.is_ascii_alphanumeric())
}

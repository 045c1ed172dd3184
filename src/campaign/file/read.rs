//! Walks the TOML tree once and notes everything that is wrong with single keys: unknown, misplaced, of a wrong type, out
//! of every range.

use crate::campaign::file::axis::axis;
use crate::campaign::file::keys::{Id, KEYS, Key, Kind, Place, rows};
use crate::campaign::file::problem::Problems;
use crate::campaign::file::scalar::{allowed, read, with_article};
use crate::campaign::file::section::{Entry, Given, Item, Section, Span};
use crate::campaign::file::spelling::nearest;
use std::borrow::Cow;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A table of the file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Home {
    File,
    Block,
    Limits,
    Until,
    Grid,
}

impl Home {
    fn holds(self, key: &Key) -> bool {
        match self {
            Self::File => matches!(key.place, Place::File | Place::Section | Place::Parameter),
            Self::Block => matches!(key.place, Place::Section | Place::Parameter),
            Self::Limits => key.place == Place::Limit,
            Self::Until => key.place == Place::Until,
            Self::Grid => key.is_axis(),
        }
    }

    fn tables(self) -> &'static [&'static str] {
        match self {
            Self::File => &["limits", "until", "grid", "block"],
            Self::Block => &["limits", "until", "grid"],
            Self::Limits | Self::Until | Self::Grid => &[],
        }
    }

    /// The names that may stand here, each once.
    fn names(self) -> Vec<&'static str> {
        let mut names: Vec<_> = KEYS.iter().filter(|key| self.holds(key)).map(|key| key.name).collect();
        names.dedup();
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
            let message = format!("{} is no list of blocks", with_article(other));
            problems.add(
                value.span(),
                Some("block".to_owned()),
                message,
                Some("start each block with [[block]]".to_owned()),
            );
            Vec::new()
        }
    });
    (top, blocks)
}

fn block(element: &Spanned<DeValue<'_>>, problems: &mut Problems<'_>) -> Option<Section> {
    match element.get_ref() {
        DeValue::Table(table) => Some(section(table, Home::Block, element.span(), problems)),
        other => {
            let message = format!("{} is no block", with_article(other));
            problems.add(
                element.span(),
                Some("block".to_owned()),
                message,
                Some("start each block with [[block]]".to_owned()),
            );
            None
        }
    }
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
            None => section.entries.extend(entry(key, value, home, path, problems)),
        }
    }
    for entry in section.entries.iter().filter(|entry| entry.on_grid && sound(entry)) {
        let twin = section.entries.iter().find(|other| !other.on_grid && other.id == entry.id && sound(other));
        if let Some(twin) = twin {
            let message = format!("it has a fixed value too, `{}`", twin.path);
            let help = "keep the fixed value or the axis".to_owned();
            problems.add(entry.span.clone(), Some(entry.path.clone()), message, Some(help));
        }
    }
    section
}

fn sound(entry: &Entry) -> bool {
    !matches!(entry.given, Given::Broken)
}

/// Reads `limits` or `grid` into its section.
fn inner(value: &Spanned<DeValue<'_>>, home: Home, path: &str, section: &mut Section, problems: &mut Problems<'_>) {
    match value.get_ref() {
        DeValue::Table(table) => {
            for (key, value) in table {
                let path = format!("{path}.{}", key.get_ref());
                section.entries.extend(entry(key, value, home, path, problems));
            }
        }
        other => {
            let message = format!("{} is no table", with_article(other));
            let help = format!("write [{path}] and its keys below");
            problems.add(value.span(), Some(path.to_owned()), message, Some(help));
        }
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
    let tables = home.tables().iter().copied();
    if let Some(table) = tables.clone().find(|table| *table == name) {
        return Some(table);
    }
    let is_table = value.get_ref().is_table() || value.get_ref().is_array();
    let meant = nearest(name, tables).filter(|_| is_table && rows(name).next().is_none())?;
    problems.add(key.span(), Some(path.to_owned()), "unknown key".to_owned(), Some(format!("did you mean `{meant}`?")));
    Some(meant)
}

/// Reads one key; an unknown one counts as the key that was probably meant, so that this is not reported as missing.
fn entry(
    key: &Spanned<Cow<'_, str>>,
    value: &Spanned<DeValue<'_>>,
    home: Home,
    path: String,
    problems: &mut Problems<'_>,
) -> Option<Entry> {
    let name = key.get_ref().as_ref();
    let (id, given) = match rows(name).next() {
        Some(known) if home.holds(known) => (known.id, given(known, value, home, &path, problems)),
        Some(known) => {
            let help = format!("{name} ({}) stands {}", known.doc, place_in_words(known.place));
            problems.add(key.span(), Some(path.clone()), "this key does not belong here".to_owned(), Some(help));
            (known.id, Given::Broken)
        }
        None => {
            let names = home.names();
            let meant = nearest(name, names.iter().copied()).or_else(|| nearest(name, KEYS.iter().map(|key| key.name)));
            let help = match meant {
                Some(meant) => format!("did you mean `{meant}`?"),
                None => format!("the keys here are {}", names.join(", ")),
            };
            problems.add(key.span(), Some(path.clone()), "unknown key".to_owned(), Some(help));
            (rows(meant?).next()?.id, Given::Broken)
        }
    };
    Some(Entry { id, path, span: value.span(), on_grid: home == Home::Grid, given })
}

fn place_in_words(place: Place) -> &'static str {
    match place {
        Place::File => "at the top of the file",
        Place::Section => "at the top of the file or of a block",
        Place::Parameter => "at the top of the file or of a block, or in the grid",
        Place::Limit => "under [limits]",
        Place::Until => "under [until]",
    }
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
    let mistake = match (value.get_ref(), key.kind) {
        (DeValue::String(text), Kind::Text) if key.id != Id::Name || is_name(text) => {
            return Given::Text(text.clone().into_owned());
        }
        (DeValue::String(_), Kind::Text) => {
            let help = "a name has 1 to 64 letters, digits, `_`, `-` and `.`, and starts with a letter or digit";
            ("this name cannot name a folder".to_owned(), help.to_owned())
        }
        (other, Kind::Text) => (format!("{} does not fit here", with_article(other)), allowed(rows)),
        (DeValue::Array(_) | DeValue::Table(_), _) if key.is_axis() => {
            ("several values for one".to_owned(), format!("to sweep {}, write it under [grid]", key.name))
        }
        (other, _) => match read(rows, other) {
            Ok(value_read) => return Given::Fixed(Item { value: value_read, span: value.span() }),
            Err(mistake) => mistake,
        },
    };
    problems.add(value.span(), Some(path.to_owned()), mistake.0, Some(mistake.1));
    Given::Broken
}

/// Names become folder names and SQL values.
fn is_name(text: &str) -> bool {
    let plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-.".contains(&byte));
    plain && text.len() <= 64 && text.bytes().next().is_some_and(|byte| byte.is_ascii_alphanumeric())
}

//! What stands where in a campaign file: the entries of its top level and of its blocks, read but not yet combined.

use crate::campaign::file::keys::{Id, Value};
use std::ops::Range;

/// Bytes of the file.
pub(super) type Span = Range<usize>;

/// The top level of the file, or one block.
#[derive(Debug, Default)]
pub(super) struct Section {
    pub(super) entries: Vec<Entry>,
    /// Whether it has a grid, even an empty or faulty one.
    pub(super) has_grid: bool,
    /// Its header.
    pub(super) span: Span,
}

/// A key and what it was given.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) id: Id,
    /// Dotted path as in the file, `block.grid.gamma`.
    pub(super) path: String,
    /// Of the value.
    pub(super) span: Span,
    pub(super) on_grid: bool,
    pub(super) given: Given,
}

/// What a key was given.
#[derive(Debug)]
pub(super) enum Given {
    /// One value.
    Fixed(Item),
    /// The values of a grid axis.
    Axis(Vec<Item>),
    /// A text.
    Text(String),
    /// Something faulty that was reported: the key must not be reported as missing as well.
    Broken,
}

/// A value and its place.
#[derive(Clone, Debug)]
pub(super) struct Item {
    pub(super) value: Value,
    pub(super) span: Span,
}

impl Section {
    /// The entry of a key, a sound one rather than a broken one.
    pub(super) fn get(&self, id: Id) -> Option<&Entry> {
        let mut entries = self.entries.iter().filter(|entry| entry.id == id);
        let sound = entries.clone().find(|entry| !matches!(entry.given, Given::Broken));
        sound.or_else(|| entries.next())
    }

    /// The text of a key.
    pub(super) fn text(&self, id: Id) -> Option<&str> {
        match &self.get(id)?.given {
            Given::Text(text) => Some(text),
            Given::Fixed(_) | Given::Axis(_) | Given::Broken => None,
        }
    }
}

/// What counts for one block: its own entries before those of the top level.
#[derive(Clone, Copy)]
pub(super) struct Inherited<'s> {
    pub(super) top: &'s Section,
    /// The block; `None` when the whole file is one block.
    pub(super) own: Option<&'s Section>,
}

impl<'s> Inherited<'s> {
    /// The entry that counts; a block's grid replaces that of the top level wholly.
    pub(super) fn get(&self, id: Id) -> Option<&'s Entry> {
        let own_grid = self.own.is_some_and(|own| own.has_grid);
        let inherited = || self.top.get(id).filter(|entry| !(entry.on_grid && own_grid));
        self.own.and_then(|own| own.get(id)).or_else(inherited)
    }

    /// The section that speaks for this block alone.
    pub(super) fn section(&self) -> &'s Section {
        self.own.unwrap_or(self.top)
    }

    /// Where to point when something is missing.
    pub(super) fn header(&self) -> Span {
        let section = self.section();
        section.get(Id::Name).map_or_else(|| section.span.clone(), |name| name.span.clone())
    }

    /// The word of a choice like model or scene, if it is sound.
    pub(super) fn word(&self, id: Id) -> Option<&'static str> {
        match &self.get(id)?.given {
            Given::Fixed(Item { value: Value::Word(word), .. }) => Some(word),
            Given::Fixed(_) | Given::Axis(_) | Given::Text(_) | Given::Broken => None,
        }
    }
}

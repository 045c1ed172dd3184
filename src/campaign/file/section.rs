//! What stands where in a campaign file: the keys of its top level and of its blocks, read but not yet combined.

use crate::parameters::Value;
use std::ops::Range;

/// Bytes of the file.
pub(super) type Span = Range<usize>;

/// The top level of the file, or one block.
#[derive(Debug, Default)]
pub(super) struct Section {
    pub(super) assignments: Vec<Assignment>,
    /// Whether it has a grid, even an empty or faulty one.
    pub(super) has_grid: bool,
    /// Its header.
    pub(super) span: Span,
}

/// A key and what it was given.
#[derive(Debug)]
pub(super) struct Assignment {
    /// The name of the key.
    pub(super) name: &'static str,
    /// Dotted path as in the file, `block.grid.gamma`.
    pub(super) path: String,
    /// Of the value.
    pub(super) span: Span,
    pub(super) on_grid: bool,
    pub(super) given: Given,
}

impl Assignment {
    /// Whether nothing was wrong with it.
    pub(super) fn is_sound(&self) -> bool {
        !matches!(self.given, Given::Broken)
    }
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
    /// Something faulty, which was reported; the key must not be reported as missing as well.
    Broken,
}

/// A value and its place.
#[derive(Clone, Debug)]
pub(super) struct Item {
    pub(super) value: Value,
    pub(super) span: Span,
}

impl Section {
    /// The assignment of a key, a sound one rather than a broken one.
    pub(super) fn get(&self, name: &str) -> Option<&Assignment> {
        let mut all = self.assignments.iter().filter(|assignment| assignment.name == name);
        all.clone().find(|assignment| assignment.is_sound()).or_else(|| all.next())
    }

    /// The text that a key was given.
    pub(super) fn text(&self, name: &str) -> Option<&str> {
        match &self.get(name)?.given {
            Given::Text(text) => Some(text),
            Given::Fixed(_) | Given::Axis(_) | Given::Broken => None,
        }
    }

    /// The number that a key was given, if it is sound.
    pub(super) fn number(&self, name: &str) -> Option<f64> {
        match &self.get(name)?.given {
            Given::Fixed(Item { value: Value::Number(number), .. }) => Some(*number),
            Given::Fixed(_) | Given::Text(_) | Given::Axis(_) | Given::Broken => None,
        }
    }
}

/// What counts for one block: its own keys before those of the top level.
#[derive(Clone, Copy)]
pub(super) struct Inherited<'s> {
    pub(super) top: &'s Section,
    /// The block; `None` when the whole file is one block.
    pub(super) own: Option<&'s Section>,
}

impl<'s> Inherited<'s> {
    /// The assignment that counts; a block's grid replaces that of the top level wholly.
    pub(super) fn get(&self, name: &str) -> Option<&'s Assignment> {
        let own_grid = self.own.is_some_and(|own| own.has_grid);
        let inherited = || self.top.get(name).filter(|assignment| !(assignment.on_grid && own_grid));
        self.own.and_then(|own| own.get(name)).or_else(inherited)
    }

    /// The section that speaks for this block alone.
    pub(super) fn section(&self) -> &'s Section {
        self.own.unwrap_or(self.top)
    }

    /// Where to point when something is missing.
    pub(super) fn header(&self) -> Span {
        let section = self.section();
        section.get("name").map_or_else(|| section.span.clone(), |name| name.span.clone())
    }

    /// The word of a choice like model or scene, if it is sound.
    pub(super) fn word(&self, name: &str) -> Option<&'static str> {
        match &self.get(name)?.given {
            Given::Fixed(Item { value: Value::Word(word), .. }) => Some(word),
            Given::Fixed(_) | Given::Axis(_) | Given::Text(_) | Given::Broken => None,
        }
    }
}

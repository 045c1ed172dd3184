//! The grid points of a block: the product of its axes, and what is wrong with some of them.

use crate::campaign::checks::{Breach, breaches, unmet_tolerance};
use crate::campaign::file::draft::Draft;
use crate::campaign::file::grid::place_on_axes;
use crate::campaign::file::keys::Key;
use crate::campaign::file::problem::Problems;
use crate::campaign::file::section::{Inherited, Item};
use crate::campaign::parallel::in_parallel;
use crate::parameters::{Point, PointId, Short, Value};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// One axis of a block.
pub(super) struct Axis<'s> {
    pub(super) key: &'static Key,
    /// Place of the key in the draft.
    pub(super) place: usize,
    /// The values.
    pub(super) items: &'s [Item],
    /// Where the axis starts in the file.
    pub(super) start: usize,
}

/// The values that all points of a block share, and its axes.
pub(super) struct Product<'p, 's> {
    pub(super) draft: &'p Draft,
    pub(super) axes: &'p [Axis<'s>],
    pub(super) view: Inherited<'s>,
}

impl Product<'_, '_> {
    /// All grid points, the last axis running fastest. Of the points that break a condition the worst is noted.
    pub(super) fn points(&self, problems: &mut Problems<'_>) -> (Vec<Arc<Point>>, Vec<PointId>) {
        let size = self.lengths().iter().product();
        let made = |index: usize| {
            let (point, breaches) = self.point(index);
            let id = point.id();
            ((Arc::new(point), id), breaches)
        };
        let (points, breaches): ((Vec<_>, Vec<_>), Vec<_>) =
            in_parallel(|| (0..size).into_par_iter().map(made).unzip());
        self.note(&breaches, problems);
        points
    }

    fn lengths(&self) -> Vec<usize> {
        self.axes.iter().map(|axis| axis.items.len()).collect()
    }

    /// The axes with the value that each has at one point.
    fn at(&self, index: usize) -> impl Iterator<Item = (&Axis<'_>, Value)> {
        let places = place_on_axes(&self.lengths(), index);
        self.axes.iter().zip(places).map(|(axis, place)| (axis, axis.items[place].value))
    }

    fn point(&self, index: usize) -> (Point, Vec<Breach>) {
        let mut draft = self.draft.clone();
        for (axis, value) in self.at(index) {
            draft.put(axis.place, value);
        }
        let (point, limit) = draft.point();
        let mut breaches = breaches(&point, &limit);
        breaches.extend(draft.tolerance().and_then(|tolerance| unmet_tolerance(&point, tolerance)));
        (point, breaches)
    }

    /// Notes the worst breach of each key that is to blame; `breaches` holds those of each point.
    fn note(&self, breaches: &[Vec<Breach>], problems: &mut Problems<'_>) {
        let size = breaches.len();
        let blamed: BTreeSet<&str> = breaches.iter().flatten().map(|breach| breach.key).collect();
        for key in blamed {
            let all = breaches.iter().enumerate().flat_map(|(index, list)| list.iter().map(move |one| (index, one)));
            let all: Vec<(usize, &Breach)> = all.filter(|(_, breach)| breach.key == key).collect();
            // The first of the worst, whatever the number of threads.
            let worst = all.iter().rev().max_by(|a, b| a.1.excess.total_cmp(&b.1.excess));
            // A key that was left out has its default from the scene.
            let given = self.view.get(key).or_else(|| self.view.get("scene"));
            let (Some(&(index, worst)), Some(given)) = (worst, given) else { continue };
            let place: Vec<String> = self.at(index).map(|(axis, value)| written(axis.key.name, value)).collect();
            let message = match place.is_empty() {
                true => worst.message.clone(),
                false => {
                    format!("{}, at {} ({} of {size} grid points)", worst.message, place.join(", "), all.len())
                }
            };
            problems.note(&given.span, message).key(&given.path).help(&worst.help);
        }
    }
}

/// A key and its value as the file would write them.
fn written(name: &str, value: Value) -> String {
    match value {
        Value::Number(number) => format!("{name} = {}", Short(number)),
        Value::Word(word) => format!("{name} = \"{word}\""),
    }
}

//! One axis of a grid: a list of values, or a range `{ from, to, points | step, scale }`.

use crate::campaign::file::grid::{LONGEST_AXIS, Spacing, spread};
use crate::campaign::file::interval::Short;
use crate::campaign::file::keys::{Key, Value};
use crate::campaign::file::problem::Problems;
use crate::campaign::file::scalar::{number, read, with_article, within};
use crate::campaign::file::section::{Item, Span};
use crate::campaign::file::spelling::nearest;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

const RANGE_KEYS: [&str; 5] = ["from", "to", "points", "step", "scale"];
const RANGE_FORM: &str = "a range is { from, to, points, scale = \"log\" or \"linear\" } or { from, to, step }";

/// Reads the axis of the key `rows`; `None` if something was wrong, which is then among the problems.
pub(super) fn axis(
    rows: impl Iterator<Item = &'static Key> + Clone,
    value: &Spanned<DeValue<'_>>,
    path: &str,
    problems: &mut Problems<'_>,
) -> Option<Vec<Item>> {
    let items = match value.get_ref() {
        DeValue::Array(list) => {
            let mut items = Vec::new();
            let mut sound = true;
            for element in list.iter() {
                match read(rows.clone(), element.get_ref()) {
                    Ok(value) => items.push(Item { value, span: element.span() }),
                    Err((message, help)) => {
                        sound = false;
                        problems.add(element.span(), Some(path.to_owned()), message, Some(help));
                    }
                }
            }
            sound.then_some(items)
        }
        DeValue::Table(table) => range(rows, table, value.span(), path, problems),
        other => {
            let message = format!("{} is no axis", with_article(other));
            let help = "write a list, [0.1, 1.0], or a range; a single value stands above [grid]";
            problems.add(value.span(), Some(path.to_owned()), message, Some(help.to_owned()));
            None
        }
    }?;
    without_repeats(items, value.span(), path, problems)
}

fn without_repeats(items: Vec<Item>, span: Span, path: &str, problems: &mut Problems<'_>) -> Option<Vec<Item>> {
    if items.is_empty() {
        let help = "give it a value, or leave the axis out".to_owned();
        problems.add(span, Some(path.to_owned()), "the axis is empty".to_owned(), Some(help));
        return None;
    }
    // Sorted by value, equal ones stand together; the later one in the file is the repeat.
    let mut order: Vec<&Item> = items.iter().collect();
    order
        .sort_by(|a, b| key_of(a.value).0.total_cmp(&key_of(b.value).0).then(key_of(a.value).1.cmp(key_of(b.value).1)));
    let mut sound = true;
    for pair in order.windows(2).filter(|pair| pair[0].value == pair[1].value) {
        sound = false;
        let help = "each value of an axis stands once".to_owned();
        problems.add(pair[1].span.clone(), Some(path.to_owned()), "this value stands twice".to_owned(), Some(help));
    }
    sound.then_some(items)
}

fn key_of(value: Value) -> (f64, &'static str) {
    match value {
        Value::Number(number) => (number, ""),
        Value::Word(word) => (f64::INFINITY, word),
    }
}

/// A mistake within a range: place, key in the range (or none), what is wrong, what is allowed.
type Mistake = (Span, Option<&'static str>, String, String);

fn range(
    rows: impl Iterator<Item = &'static Key> + Clone,
    table: &DeTable<'_>,
    span: Span,
    path: &str,
    problems: &mut Problems<'_>,
) -> Option<Vec<Item>> {
    let mut mistakes = Vec::new();
    let values = range_values(rows.clone(), &Range { table, span: span.clone() }, &mut mistakes);
    let numbers = values.unwrap_or_default();
    if let Some((message, help)) = numbers.iter().find_map(|number| within(rows.clone(), *number).err()) {
        mistakes.push((span.clone(), None, format!("within the range, {message}"), help));
    }
    let sound = mistakes.is_empty();
    for (span, name, message, help) in mistakes {
        let path = name.map_or(path.to_owned(), |name| format!("{path}.{name}"));
        problems.add(span, Some(path), message, Some(help));
    }
    let item = |number: f64| Item { value: Value::Number(number + 0.0), span: span.clone() };
    sound.then(|| numbers.into_iter().map(item).collect())
}

/// The values of a range; `None` only if a mistake was noted.
fn range_values(
    rows: impl Iterator<Item = &'static Key> + Clone,
    range: &Range<'_, '_>,
    mistakes: &mut Vec<Mistake>,
) -> Option<Vec<f64>> {
    range.unknown_keys(mistakes);
    // A misspelt key must not be reported as missing as well.
    let misspelt = !mistakes.is_empty();
    let [from, to, points, step] = ["from", "to", "points", "step"].map(|name| range.number(name, mistakes));
    let log = range.is_log(mistakes);
    let spacing = match (points, step) {
        (Some(points), None) if points == points.round() && (2.0..=LONGEST_AXIS).contains(&points) => {
            Some(if log { Spacing::Log(points as usize) } else { Spacing::Linear(points as usize) })
        }
        (Some(_), None) => {
            let help = format!("points must be a whole number from 2 to {}", Short(LONGEST_AXIS));
            mistakes.push(range.mistake("points", "so many points cannot be placed", help));
            None
        }
        (None, Some(step)) if !log => Some(Spacing::Step(step)),
        (None, Some(_)) => {
            let help = "write `points` for `step`".to_owned();
            mistakes.push(range.mistake("step", "a step has no meaning on a logarithmic scale", help));
            None
        }
        (Some(_), Some(_)) => {
            mistakes.push(range.mistake("step", "both `points` and `step` are given", RANGE_FORM.to_owned()));
            None
        }
        (None, None) => None,
    };
    if !misspelt {
        range.missing_keys(mistakes);
    }
    // The ends lie within the key's interval before anything between them is computed.
    for (name, end) in [("from", from), ("to", to)] {
        if let Some(Err((message, help))) = end.map(|end| within(rows.clone(), end)) {
            mistakes.push((range.place(name), Some(name), message, help));
        }
    }
    if !mistakes.is_empty() {
        return None;
    }
    let spread = spread(from?, to?, spacing?);
    spread.map_err(|(name, message, help)| mistakes.push((range.place(name), Some(name), message, help))).ok()
}

/// The table of a range, and its place.
struct Range<'t, 'i> {
    table: &'t DeTable<'i>,
    span: Span,
}

impl Range<'_, '_> {
    /// Where the value of a key stands, or the range if it is not there.
    fn place(&self, name: &str) -> Span {
        self.table.get(name).map_or(self.span.clone(), Spanned::span)
    }

    fn mistake(&self, name: &'static str, message: &str, help: String) -> Mistake {
        (self.place(name), Some(name), message.to_owned(), help)
    }

    fn unknown_keys(&self, mistakes: &mut Vec<Mistake>) {
        for key in self.table.keys().filter(|key| !RANGE_KEYS.contains(&key.get_ref().as_ref())) {
            let meant = nearest(key.get_ref(), RANGE_KEYS).map(|near| format!("did you mean `{near}`? "));
            let message = format!("unknown key `{}` in a range", key.get_ref());
            mistakes.push((key.span(), None, message, meant.unwrap_or_default() + RANGE_FORM));
        }
    }

    fn missing_keys(&self, mistakes: &mut Vec<Mistake>) {
        let has = |name: &str| self.table.contains_key(name);
        let missing =
            ["from", "to"].into_iter().filter(|name| !has(name)).map(|name| format!("the range has no `{name}`"));
        let spacing = (!has("points") && !has("step")).then(|| "the range has neither `points` nor `step`".to_owned());
        for message in missing.chain(spacing) {
            mistakes.push((self.span.clone(), None, message, RANGE_FORM.to_owned()));
        }
    }

    fn number(&self, name: &'static str, mistakes: &mut Vec<Mistake>) -> Option<f64> {
        let value = self.table.get(name)?.get_ref();
        let found = number(value);
        if found.is_none() {
            let message = format!("{} does not fit here", with_article(value));
            mistakes.push(self.mistake(name, &message, format!("{name} must be a finite number")));
        }
        found
    }

    fn is_log(&self, mistakes: &mut Vec<Mistake>) -> bool {
        match self.table.get("scale").map(|scale| scale.get_ref().as_str()) {
            None | Some(Some("linear")) => false,
            Some(Some("log")) => true,
            Some(_) => {
                let help = "scale must be \"log\" or \"linear\"".to_owned();
                mistakes.push(self.mistake("scale", "this scale is not known", help));
                false
            }
        }
    }
}

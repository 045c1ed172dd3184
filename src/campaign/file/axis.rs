//! One axis of a grid: a list of values and ranges, or one range `{ from, to, points | step, scale }`.

use crate::campaign::file::grid::{LONGEST_AXIS, Spacing, spread};
use crate::campaign::file::keys::Key;
use crate::campaign::file::problem::{Mistake, Problems};
use crate::campaign::file::scalar::{number, read, with_article, within};
use crate::campaign::file::section::{Item, Span};
use crate::campaign::file::spelling::nearest;
use crate::parameters::{Short, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The keys of a range, and what they are.
pub(crate) const RANGE: [(&str, &str); 5] = [
    ("from", "the first value"),
    ("to", "the last value, above `from`"),
    ("points", "how many values, both ends included"),
    ("step", "how far from one value to the next, instead of `points`"),
    ("scale", "\"linear\" (equal steps, the default) or \"log\" (equal ratios)"),
];
const RANGE_KEYS: [&str; 5] = {
    let [from, to, points, step, scale] = RANGE;
    [from.0, to.0, points.0, step.0, scale.0]
};
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
            // All elements are read, so that all their mistakes are told.
            let elements: Vec<_> = list.iter().map(|element| values(rows.clone(), element, path, problems)).collect();
            elements.into_iter().collect::<Option<Vec<_>>>().map(|elements| elements.concat())
        }
        DeValue::Table(_) => values(rows, value, path, problems),
        other => {
            let help = "write a list, [0.1, 1.0], or a range; a single value stands above [grid]";
            problems.note(&value.span(), format!("{} is not an axis", with_article(other))).key(path).help(help);
            None
        }
    }?;
    without_repeats(items, &value.span(), path, problems)
}

/// The values of one element of an axis: of a range all, else the one that it is.
fn values(
    rows: impl Iterator<Item = &'static Key> + Clone,
    element: &Spanned<DeValue<'_>>,
    path: &str,
    problems: &mut Problems<'_>,
) -> Option<Vec<Item>> {
    let span = element.span();
    let DeValue::Table(table) = element.get_ref() else {
        return match read(rows, element.get_ref()) {
            Ok(value) => Some(vec![Item { value, span }]),
            Err(mistake) => {
                problems.note(&span, mistake).key(path);
                None
            }
        };
    };
    let numbers = Range { table, span: &span, path, problems, sound: true }.values(rows)?;
    let item = |number: f64| Item { value: Value::Number(number + 0.0), span: span.clone() };
    Some(numbers.into_iter().map(item).collect())
}

fn without_repeats(items: Vec<Item>, span: &Span, path: &str, problems: &mut Problems<'_>) -> Option<Vec<Item>> {
    if items.is_empty() {
        problems.note(span, "the axis is empty").key(path).help("give it a value, or leave the axis out");
        return None;
    }
    // Sorted by value, equal ones stand together; the later one in the file is the repeat.
    let by_value = |item: &&Item| (item.value.number().unwrap_or(f64::INFINITY), item.value.word().unwrap_or_default());
    let mut order: Vec<&Item> = items.iter().collect();
    order.sort_by(|a, b| {
        let ((a, a_word), (b, b_word)) = (by_value(a), by_value(b));
        a.total_cmp(&b).then(a_word.cmp(b_word))
    });
    let mut sound = true;
    for pair in order.windows(2).filter(|pair| pair[0].value == pair[1].value) {
        sound = false;
        let twice = match pair[1].value {
            Value::Number(number) => format!("the value {} stands twice", Short(number)),
            Value::Word(word) => format!("\"{word}\" stands twice"),
        };
        problems.note(&pair[1].span, twice).key(path).help("each value of an axis stands once");
    }
    sound.then_some(items)
}

/// The table of a range as it is read, and the problems found so far.
struct Range<'r, 'i, 't> {
    table: &'r DeTable<'i>,
    span: &'r Span,
    path: &'r str,
    problems: &'r mut Problems<'t>,
    sound: bool,
}

impl Range<'_, '_, '_> {
    /// The values of the range; `None` if something was wrong with it.
    fn values(mut self, rows: impl Iterator<Item = &'static Key> + Clone) -> Option<Vec<f64>> {
        self.refuse_unknown_keys();
        // A misspelt key must not be reported as missing as well.
        let misspelt = !self.sound;
        let [from, to, points, step] = ["from", "to", "points", "step"].map(|name| self.number(name));
        let log = self.is_log();
        let spacing = self.spacing(points, step, log);
        if !misspelt {
            self.refuse_missing_keys();
        }
        // The ends lie within the key's interval before anything between them is computed.
        for (name, end) in [("from", from), ("to", to)] {
            if let Some(Err(mistake)) = end.map(|end| within(rows.clone(), end)) {
                self.refuse(name, mistake);
            }
        }
        if !self.sound {
            return None;
        }
        let numbers = spread(from?, to?, spacing?).map_err(|(name, mistake)| self.refuse(name, mistake)).ok()?;
        if let Some(mistake) = numbers.iter().find_map(|number| within(rows.clone(), *number).err()) {
            let message = format!("within the range, {}", mistake.message);
            self.refuse_whole(Mistake { message, ..mistake });
        }
        self.sound.then_some(numbers)
    }

    /// Notes a mistake at the key `name` of the range, or at the whole range if the key is not there.
    fn refuse(&mut self, name: &str, mistake: impl Into<Mistake>) {
        let span = self.table.get(name).map_or(self.span.clone(), Spanned::span);
        self.problems.note(&span, mistake).key(format!("{}.{name}", self.path));
        self.sound = false;
    }

    fn refuse_whole(&mut self, mistake: Mistake) {
        self.problems.note(self.span, mistake).key(self.path);
        self.sound = false;
    }

    fn refuse_unknown_keys(&mut self) {
        for key in self.table.keys().filter(|key| !RANGE_KEYS.contains(&key.get_ref().as_ref())) {
            let meant = nearest(key.get_ref(), RANGE_KEYS).map(|near| format!("did you mean `{near}`? "));
            let message = format!("unknown key `{}` in a range", key.get_ref());
            let help = meant.unwrap_or_default() + RANGE_FORM;
            self.problems.note(&key.span(), message).key(self.path).help(help);
            self.sound = false;
        }
    }

    fn refuse_missing_keys(&mut self) {
        for name in ["from", "to"].into_iter().filter(|name| !self.table.contains_key(*name)) {
            self.refuse_whole(Mistake::new(format!("the range has no `{name}`")).help(RANGE_FORM));
        }
        if !self.table.contains_key("points") && !self.table.contains_key("step") {
            self.refuse_whole(Mistake::new("the range has neither `points` nor `step`").help(RANGE_FORM));
        }
    }

    fn spacing(&mut self, points: Option<f64>, step: Option<f64>, log: bool) -> Option<Spacing> {
        let (name, mistake) = match (points, step) {
            (Some(points), None) if points == points.round() && (2.0..=LONGEST_AXIS).contains(&points) => {
                return Some(if log { Spacing::Log(points as usize) } else { Spacing::Linear(points as usize) });
            }
            (None, Some(step)) if !log => return Some(Spacing::Step(step)),
            (None, None) => return None,
            (Some(_), None) => {
                let help = format!("points must be a whole number from 2 to {}", Short(LONGEST_AXIS));
                ("points", Mistake::new("a range cannot have so many points").help(help))
            }
            (None, Some(_)) => {
                let mistake = Mistake::new("a step has no meaning on a logarithmic scale");
                ("step", mistake.help("write `points` in place of `step`"))
            }
            (Some(_), Some(_)) => ("step", Mistake::new("both `points` and `step` are given").help(RANGE_FORM)),
        };
        self.refuse(name, mistake);
        None
    }

    fn number(&mut self, name: &str) -> Option<f64> {
        let found = number(self.table.get(name)?.get_ref());
        found.map_err(|mistake| self.refuse(name, mistake.help(format!("{name} must be a finite number")))).ok()
    }

    fn is_log(&mut self) -> bool {
        match self.table.get("scale").map(|scale| scale.get_ref().as_str()) {
            None | Some(Some("linear")) => false,
            Some(Some("log")) => true,
            Some(_) => {
                let mistake = Mistake::new("this scale is not known").help("scale must be \"log\" or \"linear\"");
                self.refuse("scale", mistake);
                false
            }
        }
    }
}

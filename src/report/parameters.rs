//! The parameters of grid points under the names that campaigns and the view `runs` use, split into those that vary
//! over the rows of a table and those that do not.

use crate::parameters::{PARAMETERS, Point, Value};
use crate::report::rounding::significant;
use std::cmp::Ordering;

/// Significant digits of a parameter, more only where they tell two values of a column apart.
const DIGITS: usize = 6;

fn text(value: Value, digits: usize) -> String {
    match value {
        Value::Number(number) => significant(number, digits),
        Value::Word(word) => word.to_owned(),
    }
}

/// Numbers by size, before words.
fn order(a: Value, b: Value) -> Ordering {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => a.total_cmp(&b),
        (Value::Number(_), Value::Word(_)) => Ordering::Less,
        (Value::Word(_), Value::Number(_)) => Ordering::Greater,
        (Value::Word(a), Value::Word(b)) => a.cmp(b),
    }
}

/// `gamma = 1.09`, with no-break spaces.
pub(super) fn equation(name: &str, value: Value) -> String {
    format!("{name}\u{a0}=\u{a0}{}", text(value, DIGITS))
}

/// Rows by model and kind of scene, which have different parameters, in the order in which they first appear.
pub(super) fn by_kind<T>(rows: &[T], point: impl Fn(&T) -> &Point) -> Vec<Vec<&T>> {
    let kind = |row: &T| (point(row).model.name(), point(row).scene.name());
    let mut kinds: Vec<Vec<&T>> = Vec::new();
    for row in rows {
        match kinds.iter_mut().find(|known| kind(known[0]) == kind(row)) {
            Some(known) => known.push(row),
            None => kinds.push(vec![row]),
        }
    }
    kinds
}

/// Points of one model in one kind of scene: what they share, and what tells them apart.
pub(super) struct Split {
    /// `gamma = 1.09` and so on, with no-break spaces: the parameters that all points share.
    pub constant: Vec<String>,
    /// Names of the others.
    pub varying: Vec<&'static str>,
    /// Their values, a row per point.
    pub rows: Vec<Vec<String>>,
    /// The points in the order of those values, as positions in the list given.
    pub order: Vec<usize>,
}

/// Splits the parameters of points, all of one model in one kind of scene.
pub(super) fn split(points: &[&Point]) -> Split {
    let mut split = Split {
        constant: vec![],
        varying: vec![],
        rows: vec![vec![]; points.len()],
        order: (0..points.len()).collect(),
    };
    let mut columns: Vec<Vec<Value>> = vec![];
    // Model and scene, which all points share, stand in the title in words.
    for parameter in PARAMETERS.iter().filter(|parameter| !["model", "scene"].contains(&parameter.name)) {
        let column: Vec<Value> = points.iter().filter_map(|point| parameter.get(point)).collect();
        let Some(first) = column.first() else { continue };
        if column.iter().all(|value| value == first) {
            split.constant.push(equation(parameter.name, *first));
            continue;
        }
        split.varying.push(parameter.name);
        split.rows.iter_mut().zip(texts(&column)).for_each(|(row, text)| row.push(text));
        columns.push(column);
    }
    let compare = |&a: &usize, &b: &usize| {
        let orders = columns.iter().map(|column| order(column[a], column[b]));
        orders.fold(Ordering::Equal, Ordering::then)
    };
    split.order.sort_by(compare);
    split
}

/// The values of a column, with the fewest digits from [`DIGITS`] up that keep different values different.
fn texts(column: &[Value]) -> Vec<String> {
    let with = |digits| column.iter().map(|value| text(*value, digits)).collect::<Vec<_>>();
    let distinct = |texts: &[String]| {
        let pairs = || column.iter().zip(texts);
        pairs().all(|(a, text)| pairs().all(|(b, other)| a == b || text != other))
    };
    (DIGITS..17).map(with).find(|texts| distinct(texts)).unwrap_or_else(|| with(17))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_shows_more_digits_only_where_values_would_look_alike() {
        let column = [0.123_456_78, 0.5].map(Value::Number);
        assert_eq!(texts(&column), ["0.123457", "0.5"]);
        let column = [0.123_456_78, 0.123_456_79].map(Value::Number);
        assert_eq!(texts(&column), ["0.12345678", "0.12345679"]);
        assert_eq!(texts(&[Value::Word("saturated"), Value::Number(0.35)]), ["saturated", "0.35"]);
    }
}

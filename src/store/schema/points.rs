//! The parameters of a grid point as columns of the table `points`.
//!
//! A column has one type, so that every client reads it as it is. Where a parameter may be a number or a word, the
//! column holds the number, and NULL stands for the word; for the word of `density` there is the column `saturated`.

use crate::parameters::{self, Domain, Parameter, Point, list};
use rusqlite::types::Value;

/// Beside `density`, which is NULL where this is 1.
const SATURATED: &str = "saturated";

/// Their names, as SQL lists them. Points are listed in the order of these columns: saturated arrays come after those
/// of a density.
pub(in crate::store) fn names() -> String {
    let names = list::columns().flat_map(|parameter| match parameter.name {
        "density" => vec![SATURATED, "density"],
        name => vec![name],
    });
    names.collect::<Vec<_>>().join(", ")
}

/// The parameters of a point, in the order of [`names`]; NULL where a parameter means nothing for it.
pub(in crate::store) fn values(point: &Point) -> Vec<Value> {
    let values = list::columns().flat_map(|parameter| match parameter.name {
        "density" => vec![saturated(point), value(point, parameter)],
        "bond" => vec![bond(point)],
        _ => vec![value(point, parameter)],
    });
    values.collect()
}

fn value(point: &Point, parameter: &Parameter) -> Value {
    let is_word = matches!(parameter.domain, Domain::Choice(_) | Domain::Text);
    match list::value(point, parameter.name) {
        Some(parameters::Value::Number(number))
            if matches!(parameter.domain, Domain::Whole(_) | Domain::WholeOr(..)) =>
        {
            Value::Integer(number as i64)
        }
        Some(parameters::Value::Number(number)) => Value::Real(number),
        Some(parameters::Value::Word(word)) if is_word => Value::Text(word.to_owned()),
        Some(parameters::Value::Word(_)) | None => Value::Null,
    }
}

fn saturated(point: &Point) -> Value {
    let density = list::value(point, "density");
    density.map_or(Value::Null, |density| Value::Integer(density.word().is_some().into()))
}

/// A point keeps gamma alone. Fifteen digits are those that survive two divisions, so a campaign that gives the Bond
/// number finds in this column what it gave.
fn bond(point: &Point) -> Value {
    let gamma = list::value(point, "gamma").and_then(parameters::Value::number);
    gamma.and_then(|gamma| format!("{:.14e}", 1.0 / gamma).parse().ok()).map_or(Value::Null, Value::Real)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Deformable, Model, Scene};

    #[test]
    fn a_bond_number_reads_back_as_a_campaign_gives_it() {
        for given in [0.01, 0.3, 0.917, 3.0, 49.0, 123.456, 1000.0] {
            let mut point = Point::new(Model::Deformable(Deformable::of_tension(1.0)), Scene::Plate);
            let parameter = list::rows("bond").next().unwrap();
            parameter.set(&mut point, parameters::Value::Number(given));
            assert_eq!(bond(&point), Value::Real(given));
        }
    }
}

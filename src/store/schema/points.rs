//! The parameters of a grid point as columns of the table `points`: those of the list of parameters that are columns.

use crate::parameters::{self, Domain, Parameter, Point, list};
use rusqlite::types::Value;

/// Their names, as SQL lists them. Points are listed in the order of these columns.
pub(in crate::store) fn names() -> String {
    list::columns().map(|parameter| parameter.name).collect::<Vec<_>>().join(", ")
}

/// The parameters of a point, in the order of [`names`]; NULL where a parameter means nothing for it.
pub(in crate::store) fn values(point: &Point) -> Vec<Value> {
    let column = |parameter: &Parameter| match list::value(point, parameter.name) {
        Some(parameters::Value::Number(number)) if matches!(parameter.domain, Domain::Whole(_)) => {
            Value::Integer(number as i64)
        }
        Some(parameters::Value::Number(number)) => Value::Real(number),
        Some(parameters::Value::Word(word)) => Value::Text(word.to_owned()),
        None => Value::Null,
    };
    list::columns().map(column).collect()
}

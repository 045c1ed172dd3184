//! Functions of numbers that SQLite leaves out, for queries: `sqrt`, `exp`, `ln`, `log10`, `sin`, `cos`, `floor`,
//! `ceil` and `power(x, y)`.
//!
//! As with SQLite's own, NULL gives NULL, and so does an argument for which there is no value (`sqrt(-1)`, `ln(0)`).
//! For example, the scatter of speeds is `sqrt(avg(v_g_mean * v_g_mean) - avg(v_g_mean) * avg(v_g_mean))`.

use rusqlite::functions::{Context, FunctionFlags};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Result};

/// The name of a function and the function.
type OfOne = (&'static str, fn(f64) -> f64);

const OF_ONE: [OfOne; 8] = [
    ("sqrt", libm::sqrt),
    ("exp", libm::exp),
    ("ln", libm::log),
    ("log10", libm::log10),
    ("sin", libm::sin),
    ("cos", libm::cos),
    ("floor", libm::floor),
    ("ceil", libm::ceil),
];

/// Adds the functions to a connection.
pub(super) fn add_to(conn: &Connection) -> Result<()> {
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC | FunctionFlags::SQLITE_INNOCUOUS;
    for (name, function) in OF_ONE {
        conn.create_scalar_function(name, 1, flags, move |context| {
            Ok(number(context, 0)?.map(function).filter(is_value))
        })?;
    }
    conn.create_scalar_function("power", 2, flags, |context| {
        let (x, y) = (number(context, 0)?, number(context, 1)?);
        Ok(x.zip(y).map(|(x, y)| libm::pow(x, y)).filter(is_value))
    })
}

fn is_value(value: &f64) -> bool {
    value.is_finite()
}

/// An argument; whole numbers are numbers too.
fn number(context: &Context<'_>, at: usize) -> Result<Option<f64>> {
    Ok(match context.get_raw(at) {
        ValueRef::Integer(whole) => Some(whole as f64),
        ValueRef::Real(number) => Some(number),
        ValueRef::Null | ValueRef::Text(_) | ValueRef::Blob(_) => None,
    })
}

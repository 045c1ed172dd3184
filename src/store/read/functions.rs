//! Functions of numbers that SQLite leaves out, for queries: `sqrt`, `exp`, `ln`, `log10`, `sin`, `cos`, `floor`,
//! `ceil` and `power(x, y)`; and of many numbers: `median(x)`, `stddev(x)` and `percentile(x, p)`.
//!
//! As with SQLite's own, NULL gives NULL, and so does an argument for which there is no value (`sqrt(-1)`, `ln(0)`).
//!
//! Those of many numbers leave out NULL and what is no number, and give NULL where nothing is left. `stddev` divides by
//! n - 1 and is NULL for a single number. `percentile` takes p from 0 to 100 and goes straight between neighbours, so
//! `percentile(x, 50)` is the median.

use rusqlite::functions::{Aggregate, Context, FunctionFlags};
use rusqlite::types::ValueRef;
use rusqlite::{Connection, Error, Result};

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
    })?;
    conn.create_aggregate_function("median", 1, flags, OfMany(|numbers, _| percentile(numbers, 50.0)))?;
    conn.create_aggregate_function("stddev", 1, flags, OfMany(|numbers, _| standard_deviation(&numbers)))?;
    conn.create_aggregate_function("percentile", 2, flags, OfMany(percentile))
}

/// A function of many numbers and of one that is the same for all of them, its second argument (NaN if it has none).
struct OfMany(fn(Vec<f64>, f64) -> Option<f64>);

/// The numbers so far, and the second argument.
type Numbers = (Vec<f64>, f64);

impl Aggregate<Numbers, Option<f64>> for OfMany {
    fn init(&self, _: &mut Context<'_>) -> Result<Numbers> {
        Ok((Vec::new(), f64::NAN))
    }

    fn step(&self, context: &mut Context<'_>, (numbers, second): &mut Numbers) -> Result<()> {
        if context.len() > 1 {
            let p = number(context, 1)?.filter(|p| (0.0..=100.0).contains(p));
            let p = p.filter(|p| second.is_nan() || *p == *second).ok_or_else(|| {
                Error::UserFunctionError("the second argument of percentile is one number from 0 to 100".into())
            })?;
            *second = p;
        }
        numbers.extend(number(context, 0)?);
        Ok(())
    }

    fn finalize(&self, _: &mut Context<'_>, numbers: Option<Numbers>) -> Result<Option<f64>> {
        Ok(numbers.and_then(|(numbers, second)| (self.0)(numbers, second)))
    }
}

fn percentile(mut numbers: Vec<f64>, p: f64) -> Option<f64> {
    numbers.sort_unstable_by(f64::total_cmp);
    let place = p / 100.0 * numbers.len().checked_sub(1)? as f64;
    let (low, high) = (numbers[place.floor() as usize], numbers[place.ceil() as usize]);
    // Equal ends may be infinite.
    Some(if low == high { low } else { low + (high - low) * place.fract() })
}

fn standard_deviation(numbers: &[f64]) -> Option<f64> {
    let n = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / n;
    let squares: f64 = numbers.iter().map(|x| (x - mean) * (x - mean)).sum();
    (n > 1.0).then(|| (squares / (n - 1.0)).sqrt())
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

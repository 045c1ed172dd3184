//! One TOML value as the value of a key: its type, its word or its range.

use crate::campaign::file::keys::Key;
use crate::campaign::file::problem::Mistake;
use crate::campaign::file::spelling::nearest;
use crate::parameters::{Applies, Domain, Short, Value};
use toml::de::DeValue;

/// Reads a value as any of the rows of a key allows.
pub(super) fn read(rows: impl Iterator<Item = &'static Key> + Clone, value: &DeValue<'_>) -> Result<Value, Mistake> {
    match value {
        DeValue::String(text) => word(rows, text),
        DeValue::Integer(_) | DeValue::Float(_) => match number(value) {
            Ok(number) => within(rows, number).map(Value::Number),
            Err(mistake) => Err(mistake.help(allowed(rows))),
        },
        DeValue::Boolean(_) | DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => {
            Err(does_not_fit(value).help(allowed(rows)))
        }
    }
}

/// The number as the first row that accepts it holds it.
pub(super) fn within(rows: impl Iterator<Item = &'static Key> + Clone, number: f64) -> Result<f64, Mistake> {
    rows.clone().find_map(|key| key.domain.number(number)).ok_or_else(|| {
        let shown = Short(number);
        let message = match rows.clone().next().map(|key| key.domain) {
            Some(Domain::Whole(_) | Domain::WholeOr(..)) if number != number.round() => {
                format!("{shown} is not a whole number")
            }
            Some(Domain::Text | Domain::Choice(_)) | None => "a number does not fit here".to_owned(),
            Some(Domain::Whole(_) | Domain::WholeOr(..) | Domain::Number(_) | Domain::NumberOr(..)) => {
                format!("{shown} is out of range")
            }
        };
        Mistake::new(message).help(allowed(rows))
    })
}

/// "gamma must be a number from 0.001 to 100".
pub(super) fn allowed(rows: impl Iterator<Item = &'static Key> + Clone) -> String {
    let several = rows.clone().count() > 1;
    let texts = rows.clone().map(|key| match key.applies {
        Applies::Model(model) if several => format!("{} (model {model})", key.domain.allowed()),
        Applies::Model(_) | Applies::Always | Applies::Scene(_) => key.domain.allowed(),
    });
    let mut texts: Vec<_> = texts.collect();
    texts.dedup();
    let name = rows.clone().next().map_or("it", |key| key.name);
    format!("{name} must be {}", texts.join(" or "))
}

fn word(rows: impl Iterator<Item = &'static Key> + Clone, text: &str) -> Result<Value, Mistake> {
    if let Some(word) = rows.clone().find_map(|key| key.domain.word(text)) {
        return Ok(Value::Word(word));
    }
    let known = rows.clone().flat_map(|key| key.domain.words().iter().copied());
    let meant = nearest(text, known).map(|word| format!(" (did you mean \"{word}\"?)"));
    let message = match text.parse::<f64>() {
        Ok(_) => "a number in quotes is a text".to_owned(),
        Err(_) => format!("\"{text}\" is not known here"),
    };
    Err(Mistake::new(message).help(allowed(rows) + &meant.unwrap_or_default()))
}

/// The finite number a value holds, to all its digits.
pub(super) fn number(value: &DeValue<'_>) -> Result<f64, Mistake> {
    let number: Option<f64> = match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|integer| integer as f64)
        }
        other => return Err(does_not_fit(other)),
    };
    let written = written(value);
    match number.filter(|number| number.is_finite()) {
        None => Err(Mistake::new(format!("{written} is not a finite number"))),
        Some(number) if underflows(number, written) => {
            Err(Mistake::new(format!("{written} is too near to 0 to be held with all its digits (below 2.3e-308)")))
        }
        Some(number) => Ok(number),
    }
}

/// Whether digits of a number are lost because it is so near to zero.
fn underflows(number: f64, written: &str) -> bool {
    let mut digits = written.split(['e', 'E']).next().unwrap_or_default().chars();
    number.abs() < f64::MIN_POSITIVE && digits.any(|digit| ('1'..='9').contains(&digit))
}

/// "a boolean does not fit here".
pub(super) fn does_not_fit(value: &DeValue<'_>) -> Mistake {
    Mistake::new(format!("{} does not fit here", with_article(value)))
}

/// "a boolean", "an array".
pub(super) fn with_article(value: &DeValue<'_>) -> String {
    let kind = value.type_str();
    let article = if kind.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {kind}")
}

fn written<'v>(value: &'v DeValue<'_>) -> &'v str {
    match value {
        DeValue::Float(float) => float.as_str(),
        DeValue::Integer(integer) => integer.as_str(),
        _ => value.type_str(),
    }
}

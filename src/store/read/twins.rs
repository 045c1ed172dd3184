//! Numbers of new grid points that differ from a stored number in their last digits alone: hardly ever on purpose, and
//! then the results of what was meant to be one point stand at two.

use crate::campaign::file::Campaign;
use crate::parameters::{PARAMETERS, Point, Value};
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::{open_reading, parse_point};
use rusqlite::{Connection, OptionalExtension};
use std::collections::BTreeMap;
use std::path::Path;

/// Numbers nearer to each other than this, relative to their size, are taken for one that was written in two ways.
const NEAR: f64 = 1e-9;

/// Most twins that are looked for.
const MOST: usize = 5;

/// Two numbers that are nearly the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twin {
    /// The parameter.
    pub name: &'static str,
    /// The number of the campaign.
    pub new: f64,
    /// The number that is there already, in the store or before it in the campaign.
    pub old: f64,
}

/// Numbers by parameter; the bits of positive numbers sort like the numbers.
type Numbers = BTreeMap<&'static str, BTreeMap<u64, f64>>;

/// The numbers of a campaign's new points that have a twin in the store in `dir`, or earlier in the campaign.
///
/// # Errors
/// As [`open_reading`]; [`StoreError::Corrupt`] for a point that cannot be read.
pub fn twins(dir: &Path, campaign: &Campaign) -> Result<Vec<Twin>, StoreError> {
    let store = open_reading(dir)?;
    let new = new_points(store.as_ref(), campaign).map_err(StoreError::sql(&database(dir)))?;
    let mut found = Vec::new();
    if new.is_empty() {
        return Ok(found);
    }
    let mut numbers = Numbers::new();
    if let Some(conn) = &store {
        for (id, spec) in specs(conn).map_err(StoreError::sql(&database(dir)))? {
            read(&parse_point(&spec, id)?, |name, number| {
                keep(&mut numbers, name, number);
            });
        }
    }
    for point in new {
        read(point, |name, new| found.extend(keep(&mut numbers, name, new).map(|old| Twin { name, new, old })));
    }
    found.truncate(MOST);
    Ok(found)
}

/// Points that the store does not hold.
fn new_points<'c>(store: Option<&Connection>, campaign: &'c Campaign) -> rusqlite::Result<Vec<&'c Point>> {
    let mut new = Vec::new();
    let mut find = store.map(|conn| conn.prepare("SELECT 1 FROM points WHERE point_id = ?1")).transpose()?;
    for (point, id) in campaign.blocks.iter().flat_map(|block| block.points.iter().zip(&block.point_ids)) {
        let known = match &mut find {
            Some(find) => find.query_row([id.to_string()], |_| Ok(())).optional()?.is_some(),
            None => false,
        };
        if !known {
            new.push(point.as_ref());
        }
    }
    Ok(new)
}

fn specs(conn: &Connection) -> rusqlite::Result<Vec<(String, String)>> {
    let mut statement = conn.prepare("SELECT point_id, spec FROM points")?;
    statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}

/// Calls `with` for each number of a point that a file gives; what the campaign computes by itself follows from those.
fn read(point: &Point, mut with: impl FnMut(&'static str, f64)) {
    for parameter in PARAMETERS.iter().filter(|parameter| parameter.auto.is_empty()) {
        if let Some(number) = parameter.get(point).and_then(Value::number) {
            with(parameter.name, number);
        }
    }
}

/// Keeps a number; returns its twin if it is new and has one.
fn keep(numbers: &mut Numbers, name: &'static str, number: f64) -> Option<f64> {
    let key = |number: f64| if number < 0.0 { !number.to_bits() } else { number.to_bits() | 1 << 63 };
    let kept = numbers.entry(name).or_default();
    if kept.contains_key(&key(number)) {
        return None;
    }
    let twin = neighbour(kept, key(number), number);
    kept.insert(key(number), number);
    twin
}

/// The number next to this one, if it is nearly the same.
fn neighbour(kept: &BTreeMap<u64, f64>, key: u64, number: f64) -> Option<f64> {
    let mut next = [kept.range(..key).next_back(), kept.range(key..).next()].into_iter().flatten();
    next.find(|(_, old)| (**old - number).abs() <= NEAR * number.abs()).map(|(_, old)| *old)
}

//! Points and jobs against the hashes that name them, as functions of SQL that the rules use.
//!
//! An id is a hash of what it names. So a parameter or a seed that changed on the disk has another id.
//!
//! An upgrade writes the columns of points anew from their texts. So in a store of an earlier schema the texts alone
//! are judged.

use crate::parameters::{JobId, PointId};
use crate::store::read::parse_point;
use crate::store::schema::points;
use rusqlite::Connection;
use rusqlite::functions::{Context, FunctionFlags};
use rusqlite::types::Value;

/// Adds `is_point(point_id, spec, parameters...)`, the parameters all or none, and `is_job(job_id, point_id, seed,
/// physics_version)` to a connection.
pub(super) fn add_to(conn: &Connection) -> rusqlite::Result<()> {
    let flags = FunctionFlags::SQLITE_UTF8 | FunctionFlags::SQLITE_DETERMINISTIC;
    conn.create_scalar_function("is_point", -1, flags, |row| Ok(is_point(row).unwrap_or(false)))?;
    conn.create_scalar_function("is_job", 4, flags, |row| Ok(is_job(row).unwrap_or(false)))
}

/// Whether the id is the hash of the text, and the columns, if given, hold what the text says; `None` if a value cannot
/// be read.
fn is_point(row: &Context<'_>) -> Option<bool> {
    let (id, spec): (String, String) = (row.get(0).ok()?, row.get(1).ok()?);
    let columns: Vec<Value> = (2..row.len()).map(|column| row.get(column)).collect::<rusqlite::Result<_>>().ok()?;
    let point = parse_point(&spec, &id).ok()?;
    let as_told = columns.is_empty() || points::values(&point) == columns;
    Some(PointId::of_canonical(&spec) == id.parse().ok()? && as_told)
}

/// Whether the id is the hash of point, seed and physics version; `None` if a value cannot be read.
fn is_job(row: &Context<'_>) -> Option<bool> {
    let (id, point): (String, String) = (row.get(0).ok()?, row.get(1).ok()?);
    let (seed, version): (i64, u32) = (row.get(2).ok()?, row.get(3).ok()?);
    Some(JobId::of_version(point.parse().ok()?, seed as u64, version) == id.parse().ok()?)
}

//! What the last run has done and left, point by point: an estimate of the time left is made from it.

use crate::parameters::Point;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::status::last_provenance;
use crate::store::read::{open_reading, parse_point};
use crate::store::unix_now;
use rusqlite::Connection;
use std::path::Path;
use std::time::Duration;

/// Points with the number of their jobs that are left, and of those that the last run has ended.
const COUNTS: &str = "
    SELECT points.key, points.spec, sum(left), sum(ended) FROM (
        SELECT point, count(*) AS left, 0 AS ended FROM jobs
        WHERE physics_version = (SELECT physics_version FROM current) AND (state = 'pending' OR state = 'running')
        GROUP BY point
        UNION ALL
        SELECT point, 0, count(*) FROM outcomes JOIN jobs ON jobs.key = outcomes.job WHERE provenance = ?1
        GROUP BY point
    ) JOIN points ON points.key = point GROUP BY points.key";

/// The last run, which is the present one while somebody holds the store.
#[derive(Clone, Debug, PartialEq)]
pub struct LastRun {
    /// Time since it began.
    pub elapsed: Duration,
    /// Its points.
    pub points: Vec<PointWork>,
}

/// A point, and how many of its jobs are done and left.
#[derive(Clone, Debug, PartialEq)]
pub struct PointWork {
    /// The point.
    pub point: Point,
    /// Jobs that have not ended.
    pub left: u64,
    /// Jobs that the last run has ended.
    pub ended: u64,
}

/// The last run of the store in `dir`; `None` if there was none.
///
/// # Errors
/// As [`open_reading`]; [`StoreError::Corrupt`] for a point that cannot be read.
pub fn last_run(dir: &Path) -> Result<Option<LastRun>, StoreError> {
    let Some(conn) = open_reading(dir)? else { return Ok(None) };
    let Some((started, rows)) = counts(&conn).map_err(StoreError::sql(&database(dir)))? else { return Ok(None) };
    let elapsed = Duration::try_from_secs_f64((unix_now() - started).max(0.0)).unwrap_or(Duration::MAX);
    let point = |(key, spec, left, ended): PointRow| {
        Ok(PointWork { point: parse_point(&spec, key)?, left: left as u64, ended: ended as u64 })
    };
    Ok(Some(LastRun { elapsed, points: rows.into_iter().map(point).collect::<Result<_, StoreError>>()? }))
}

/// Key and text of a point, its jobs left and ended.
type PointRow = (i64, String, i64, i64);

/// When the last run began, and its counts.
fn counts(conn: &Connection) -> rusqlite::Result<Option<(f64, Vec<PointRow>)>> {
    // One transaction, so that all numbers are of one moment.
    let conn = conn.unchecked_transaction()?;
    let Some((run, started, _)) = last_provenance(&conn)? else { return Ok(None) };
    let mut statement = conn.prepare(COUNTS)?;
    let counts = statement.query_map([run], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)));
    Ok(Some((started, counts?.collect::<rusqlite::Result<_>>()?)))
}

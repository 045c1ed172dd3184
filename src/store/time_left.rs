//! How long the run that is at work will take.

use super::read::parse_point;
use super::{StoreError, database, open_reading, unix_now};
use crate::job::Point;
use rusqlite::{Connection, OptionalExtension};
use std::path::Path;
use std::time::Duration;

/// Points and how many of their jobs: left, ended by the last run.
const COUNTS: &str = "
    SELECT points.key, points.spec, sum(left), sum(ended) FROM (
        SELECT point, count(*) AS left, 0 AS ended FROM jobs
        WHERE physics_version = (SELECT physics_version FROM current) AND (state = 'pending' OR state = 'running') GROUP BY point
        UNION ALL
        SELECT point, 0, count(*) FROM outcomes JOIN jobs ON jobs.key = outcomes.job WHERE provenance = ?1 GROUP BY point
    ) JOIN points ON points.key = point GROUP BY points.key";

/// Time left to the last run of the store in `dir`, if the rest takes as long compared with `expected_s`, the expected CPU time of a job, as what it has done so
/// far: `elapsed * expected(left)/expected(ended)`. Jobs differ, and the longest come first, so their number says little. `None` before the
/// first has ended.
///
/// # Errors
/// As [`open_reading`].
pub fn time_left(dir: &Path, expected_s: impl Fn(&Point) -> f64) -> Result<Option<Duration>, StoreError> {
    let Some(conn) = open_reading(dir)? else { return Ok(None) };
    let Some((elapsed_s, counts)) = counts(&conn).map_err(StoreError::sql(&database(dir)))? else { return Ok(None) };
    let (mut left_s, mut ended_s) = (0.0, 0.0);
    for PointCounts { key, spec, left, ended } in counts {
        let each_s = expected_s(&parse_point(&spec, key)?);
        left_s += left as f64 * each_s;
        ended_s += ended as f64 * each_s;
    }
    let seconds = elapsed_s * left_s / ended_s;
    Ok((ended_s > 0.0).then(|| Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(Duration::MAX)))
}

/// A point, and how many of its jobs are left and ended by the last run.
struct PointCounts {
    key: i64,
    spec: String,
    left: i64,
    ended: i64,
}

/// For how many seconds the last run has been at work, and its counts.
fn counts(conn: &Connection) -> rusqlite::Result<Option<(f64, Vec<PointCounts>)>> {
    // One transaction, so that all numbers are of one moment.
    let conn = conn.unchecked_transaction()?;
    let last = conn.query_row("SELECT key, started FROM provenance ORDER BY key DESC LIMIT 1", [], |row| {
        Ok((row.get::<_, i64>(0)?, row.get::<_, f64>(1)?))
    });
    let Some((run, started)) = last.optional()? else { return Ok(None) };
    let mut statement = conn.prepare(COUNTS)?;
    let counts = statement.query_map([run], |row| {
        Ok(PointCounts { key: row.get(0)?, spec: row.get(1)?, left: row.get(2)?, ended: row.get(3)? })
    });
    Ok(Some((unix_now() - started, counts?.collect::<rusqlite::Result<_>>()?)))
}

//! What a fit is made from: the finished runs of every grid point.

use crate::parameters::PointId;
use crate::results::fits::{FinishedRun, PointRuns};
use crate::results::trajectory::{Mechanism, Outcome};
use crate::store::error::StoreError;
use crate::store::read::{corrupt, parse_point};
use crate::store::schema::points;
use rusqlite::Connection;
use std::path::Path;

/// The finished runs of the current physics version, by grid point: points by model, then by their parameters as
/// numbers; runs by seed. Points without a finished run are left out.
///
/// # Errors
/// What SQLite reports; [`StoreError::Corrupt`] for a row that cannot be read.
pub fn point_runs(conn: &Connection) -> Result<Vec<PointRuns>, StoreError> {
    let path = conn.path().unwrap_or_default().to_owned();
    let path = Path::new(&path);
    // One transaction, so that all runs are of one moment.
    let conn = conn.unchecked_transaction().map_err(StoreError::sql(path))?;
    let mut found = Vec::new();
    for (key, id, spec) in all_points(&conn).map_err(StoreError::sql(path))? {
        let runs = runs_of(&conn, key).map_err(StoreError::sql(path))?;
        if runs.is_empty() {
            continue;
        }
        let point_id: PointId = id.parse().map_err(|error| corrupt(&id, format!("{error}")))?;
        found.push(PointRuns { point_id, point: parse_point(&spec, &id)?, runs });
    }
    Ok(found)
}

fn all_points(conn: &Connection) -> rusqlite::Result<Vec<(i64, String, String)>> {
    let sql = format!("SELECT key, point_id, spec FROM points ORDER BY {}, point_id", points::names());
    let mut statement = conn.prepare(&sql)?;
    statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?.collect()
}

fn runs_of(conn: &Connection, point: i64) -> rusqlite::Result<Vec<FinishedRun>> {
    let mut statement = conn.prepare_cached(
        "SELECT seed, outcome, r_end, t_end, v_g_mean, mechanism, arrests.r
         FROM jobs JOIN outcomes ON outcomes.job = jobs.key
         LEFT JOIN clogs ON clogs.job = jobs.key LEFT JOIN arrests ON arrests.job = jobs.key
         WHERE point = ?1 AND state = 'done' AND physics_version = (SELECT physics_version FROM current)
         ORDER BY seed",
    )?;
    let runs = statement.query_map([point], |row| {
        let name = row.get_ref(1)?.as_str()?;
        let outcome = Outcome::from_name(name)
            .ok_or_else(|| rusqlite::Error::InvalidColumnType(1, name.to_owned(), rusqlite::types::Type::Text))?;
        Ok(FinishedRun {
            seed: row.get::<_, i64>(0)? as u64,
            outcome,
            r_end: row.get(2)?,
            t_end: row.get(3)?,
            v_g_mean: row.get(4)?,
            mechanism: row.get_ref(5)?.as_str_or_null()?.and_then(Mechanism::from_name),
            arrested: row.get(6)?,
        })
    });
    runs?.collect()
}

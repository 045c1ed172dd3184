//! What `fit` reads, the finished runs of every grid point, and what it leaves: the rows behind `lambda_fits` and
//! `speed_averages`.

use crate::parameters::PointId;
use crate::results::fits::{FinishedRun, LambdaFit, PointRuns, SpeedAverage};
use crate::results::trajectory::{Mechanism, Outcome};
use crate::store::read::{corrupt, parse_point};
use crate::store::{Store, StoreError, database, disk};
use rusqlite::{Connection, Transaction, params};
use std::path::Path;

/// The finished runs of the current physics version, by grid point: points by model, then by their parameters as
/// numbers; runs by seed. Points without a finished run are left out.
///
/// # Errors
/// What SQLite reports; [`StoreError::Corrupt`] for a row that cannot be read.
pub fn point_runs(conn: &Connection) -> Result<Vec<PointRuns>, StoreError> {
    let path = conn.path().unwrap_or_default().to_owned();
    let path = Path::new(&path);
    let mut points = Vec::new();
    for (key, id, spec) in all_points(conn).map_err(StoreError::sql(path))? {
        let runs = runs_of(conn, key).map_err(StoreError::sql(path))?;
        if runs.is_empty() {
            continue;
        }
        let point_id: PointId = id.parse().map_err(|error| corrupt(&id, format!("{error}")))?;
        points.push(PointRuns { point_id, point: parse_point(&spec, &id)?, runs });
    }
    Ok(points)
}

fn all_points(conn: &Connection) -> rusqlite::Result<Vec<(i64, String, String)>> {
    let mut statement = conn.prepare(
        "SELECT key, point_id, spec FROM points
         ORDER BY model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, w, n_vertices, dt,
                  integrator, point_id",
    )?;
    statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?.collect()
}

fn runs_of(conn: &Connection, point: i64) -> rusqlite::Result<Vec<FinishedRun>> {
    let mut statement = conn.prepare_cached(
        "SELECT seed, outcome, r_end, t_end, v_g_mean, mechanism FROM jobs JOIN outcomes ON outcomes.job = jobs.key
         LEFT JOIN clogs ON clogs.job = jobs.key
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
        })
    });
    runs?.collect()
}

/// Replaces what the last fit left, in one transaction.
///
/// # Errors
/// What SQLite reports, a point that is not in the store among it; then the old rows stay.
pub fn save_fits(
    store: &mut Store,
    lambdas: &[(PointId, LambdaFit)],
    speeds: &[(PointId, SpeedAverage)],
) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let save = || {
        transaction.execute_batch("DELETE FROM lambda_rows; DELETE FROM speed_rows;")?;
        lambdas.iter().try_for_each(|(id, fit)| save_lambda(&transaction, *id, fit))?;
        speeds.iter().try_for_each(|(id, average)| save_speed(&transaction, *id, average))
    };
    save().map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)
}

fn save_lambda(transaction: &Transaction<'_>, point: PointId, fit: &LambdaFit) -> rusqlite::Result<()> {
    let mut insert = transaction.prepare_cached(
        "INSERT INTO lambda_rows SELECT key, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9 FROM points WHERE point_id = ?1",
    )?;
    let inserted = insert.execute(params![
        point.to_string(),
        fit.runs,
        fit.clogs,
        fit.lambda,
        fit.lambda_low,
        fit.lambda_high,
        fit.lambda_least_squares,
        fit.p_exponential,
        fit.runs_for_ten_percent,
    ])?;
    one_point(inserted)
}

fn save_speed(transaction: &Transaction<'_>, point: PointId, average: &SpeedAverage) -> rusqlite::Result<()> {
    let mut insert = transaction
        .prepare_cached("INSERT INTO speed_rows SELECT key, ?2, ?3, ?4, ?5, ?6, ?7 FROM points WHERE point_id = ?1")?;
    let inserted = insert.execute(params![
        point.to_string(),
        average.runs,
        average.flowing,
        average.v_g,
        average.v_g_low,
        average.v_g_high,
        average.ca,
    ])?;
    one_point(inserted)
}

/// A row was inserted if, and only if, its point is in the store.
fn one_point(inserted: usize) -> rusqlite::Result<()> {
    if inserted == 1 { Ok(()) } else { Err(rusqlite::Error::QueryReturnedNoRows) }
}

//! What a fit leaves: the rows behind the views `lambda_fits` and `speed_averages`.

use crate::parameters::PointId;
use crate::results::fits::{LambdaFit, SpeedAverage};
use crate::store::disk;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::write::Store;
use rusqlite::{Transaction, params};

/// Replaces the rows of the last fit, in one transaction.
///
/// # Errors
/// What SQLite reports, for example for a point that is not in the store; then the old rows stay.
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
        transaction.execute_batch(SHARES)?;
        speeds.iter().try_for_each(|(id, average)| save_speed(&transaction, *id, average))
    };
    save().map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)
}

/// How the clogs of each point hold, as shares of those whose mechanism is known.
const SHARES: &str = "
    UPDATE lambda_rows SET (wrap_share, squeeze_share, hybrid_share) = (
        SELECT avg(mechanism = 'wrap'), avg(mechanism = 'squeeze'), avg(mechanism = 'hybrid')
        FROM clogs JOIN jobs ON jobs.key = clogs.job
        WHERE jobs.point = lambda_rows.point AND +physics_version = (SELECT physics_version FROM current)
    )";

fn save_lambda(transaction: &Transaction<'_>, point: PointId, fit: &LambdaFit) -> rusqlite::Result<()> {
    let mut insert = transaction.prepare_cached(
        "INSERT INTO lambda_rows
             (point, runs, clogs, lambda, lambda_low, lambda_high, lambda_least_squares, p_exponential,
              runs_for_ten_percent, arrested)
         SELECT key, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10 FROM points WHERE point_id = ?1",
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
        fit.arrested,
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

/// A row is inserted if, and only if, its point is in the store.
fn one_point(inserted: usize) -> rusqlite::Result<()> {
    if inserted == 1 { Ok(()) } else { Err(rusqlite::Error::QueryReturnedNoRows) }
}

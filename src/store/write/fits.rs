//! What a fit leaves: the rows behind the views `lambda_fits`, `speed_averages` and `survival`.

use crate::parameters::PointId;
use crate::results::fits::{LambdaFit, SpeedAverage};
use crate::store::disk;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::write::Store;
use crate::study::fits::FittedPoint;
use crate::study::survival::kaplan_meier::Step;
use rusqlite::{Transaction, params};

/// Replaces the rows of the last fit, in one transaction.
///
/// # Errors
/// What SQLite reports, for example for a point that is not in the store; then the old rows stay.
pub fn save_fits(store: &mut Store, fits: &[FittedPoint<'_>]) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let save = || {
        transaction.execute_batch("DELETE FROM lambda_rows; DELETE FROM speed_rows; DELETE FROM survival_rows")?;
        for FittedPoint { point, lambda, curve, speed } in fits {
            save_lambda(&transaction, point.point_id, lambda)?;
            save_speed(&transaction, point.point_id, speed)?;
            save_curve(&transaction, point.point_id, curve, lambda.r_from)?;
        }
        transaction.execute_batch(SHARES)
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
              runs_for_ten_percent, arrested, by_distance, by_time, beyond_box, r_from, lambda_if_stuck,
              weibull_shape, weibull_low, weibull_high)
         SELECT key, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18 FROM points
         WHERE point_id = ?1",
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
        fit.by_distance,
        fit.by_time,
        fit.beyond_box,
        fit.r_from,
        fit.lambda_if_stuck,
        fit.weibull_shape,
        fit.weibull_low,
        fit.weibull_high,
    ])?;
    one_point(inserted)
}

fn save_speed(transaction: &Transaction<'_>, point: PointId, average: &SpeedAverage) -> rusqlite::Result<()> {
    let mut insert = transaction.prepare_cached(
        "INSERT INTO speed_rows SELECT key, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10 FROM points WHERE point_id = ?1",
    )?;
    let inserted = insert.execute(params![
        point.to_string(),
        average.runs,
        average.flowing,
        average.v_g,
        average.v_g_low,
        average.v_g_high,
        average.ca,
        average.by_distance,
        average.by_time,
        average.arrested,
    ])?;
    one_point(inserted)
}

/// The displacements of the steps count from `from`, those of the rows from the start.
fn save_curve(transaction: &Transaction<'_>, point: PointId, curve: &[Step], from: f64) -> rusqlite::Result<()> {
    if curve.is_empty() {
        return Ok(());
    }
    let mut find = transaction.prepare_cached("SELECT key FROM points WHERE point_id = ?1")?;
    let key: i64 = find.query_row([point.to_string()], |row| row.get(0))?;
    let mut insert = transaction.prepare_cached("INSERT INTO survival_rows VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?;
    for step in curve {
        let [low, high] = step.band().map_or([None; 2], |band| band.map(Some));
        insert.execute(params![
            key,
            from + step.r,
            step.at_risk as i64,
            step.events as i64,
            step.survival,
            low,
            high
        ])?;
    }
    Ok(())
}

/// A row is inserted if, and only if, its point is in the store.
fn one_point(inserted: usize) -> rusqlite::Result<()> {
    if inserted == 1 { Ok(()) } else { Err(rusqlite::Error::QueryReturnedNoRows) }
}

//! Everything that single jobs left, with their time series, and which programs computed it.

use crate::parameters::JobId;
use crate::results::fits::RunRecord;
use crate::results::trajectory::{Outcome, Samples};
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::{open_existing, samples_table};
use rusqlite::{Connection, OptionalExtension};
use std::path::Path;

/// What each of the jobs left, in their order: `None` for one that has not ended or is unknown. Time series are read
/// only if `with_samples`.
///
/// # Errors
/// [`StoreError::Missing`] without a store; what SQLite reports.
pub(crate) fn records(dir: &Path, ids: &[JobId], with_samples: bool) -> Result<Vec<Option<RunRecord>>, StoreError> {
    let conn = open_existing(dir)?;
    samples_table::add_to(&conn, dir)?;
    let read = |id: &JobId| -> rusqlite::Result<Option<RunRecord>> {
        let Some(mut record) = record(&conn, *id)? else { return Ok(None) };
        if with_samples {
            record.samples = samples(&conn, *id)?;
        }
        Ok(Some(record))
    };
    ids.iter().map(read).collect::<rusqlite::Result<_>>().map_err(StoreError::sql(&database(dir)))
}

fn record(conn: &Connection, id: JobId) -> rusqlite::Result<Option<RunRecord>> {
    let mut statement = conn.prepare_cached(
        "SELECT seed, outcome, error, r_end, t_end, v_g_mean, ek_ratio_end, delta_s, wall_s, arrests.r
         FROM jobs JOIN outcomes ON outcomes.job = jobs.key LEFT JOIN arrests ON arrests.job = jobs.key
         WHERE job_id = ?1 AND (state = 'done' OR state = 'failed')",
    )?;
    let found = statement.query_row([id.to_string()], |row| {
        Ok(RunRecord {
            seed: row.get::<_, i64>(0)? as u64,
            outcome: row.get_ref(1)?.as_str_or_null()?.and_then(Outcome::from_name),
            error: row.get(2)?,
            // A failure has no end.
            r_end: row.get::<_, Option<f64>>(3)?.unwrap_or_default(),
            t_end: row.get::<_, Option<f64>>(4)?.unwrap_or_default(),
            v_g_mean: row.get(5)?,
            ek_ratio_end: row.get::<_, Option<f64>>(6)?.unwrap_or_default(),
            delta_s: row.get(7)?,
            wall_s: row.get::<_, Option<f64>>(8)?.unwrap_or_default(),
            samples: Samples::default(),
            arrested: row.get(9)?,
        })
    });
    found.optional()
}

fn samples(conn: &Connection, id: JobId) -> rusqlite::Result<Samples> {
    let mut statement = conn.prepare_cached(
        "SELECT t, r, h, y, v_g, ek_ratio, shape, area_error FROM samples WHERE job_id = ?1 ORDER BY t",
    )?;
    let mut rows = statement.query([id.to_string()])?;
    let mut samples = Samples::default();
    while let Some(row) = rows.next()? {
        samples.t.push(row.get(0)?);
        samples.r.push(row.get(1)?);
        samples.h.push(row.get(2)?);
        samples.y.push(row.get(3)?);
        samples.v_g.push(row.get(4)?);
        samples.ek_ratio.push(row.get(5)?);
        samples.shape.extend(row.get::<_, Option<f64>>(6)?);
        samples.area_error.extend(row.get::<_, Option<f64>>(7)?);
    }
    Ok(samples)
}

/// Where the outcomes of a store come from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Origins {
    /// The commits of the programs that computed them.
    pub commits: String,
    /// The day, or the first and the last.
    pub days: String,
}

/// Where the outcomes of the store in `dir` come from.
///
/// # Errors
/// [`StoreError::Missing`] without a store; what SQLite reports.
pub(crate) fn origins(dir: &Path) -> Result<Origins, StoreError> {
    let conn = open_existing(dir)?;
    let found = conn.query_row(
        "SELECT group_concat(DISTINCT git_commit), date(min(started), 'unixepoch'), date(max(started), 'unixepoch')
         FROM provenance WHERE key IN (SELECT provenance FROM outcomes)",
        [],
        |row| {
            Ok((row.get::<_, Option<String>>(0)?, row.get::<_, Option<String>>(1)?, row.get::<_, Option<String>>(2)?))
        },
    );
    let (commits, first, last) = found.map_err(StoreError::sql(&database(dir)))?;
    let (first, last) = (first.unwrap_or_default(), last.unwrap_or_default());
    let days = if first == last { first } else { format!("{first} to {last}") };
    Ok(Origins { commits: commits.unwrap_or_default(), days })
}

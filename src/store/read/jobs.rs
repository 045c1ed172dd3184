//! Which jobs there are: for the planner, which asks what is done, and for rendering, which asks what one job was.

use crate::parameters::{JobId, JobState, Point};
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::{corrupt, open_existing, open_reading, parse_point};
use rusqlite::{OptionalExtension, params};
use std::path::Path;

/// A job as the store knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredJob {
    /// Its grid point.
    pub point: Point,
    /// Its seed.
    pub seed: u64,
    /// Where it stands.
    pub state: JobState,
    /// The version of the physics that it belongs to; this program computes again only those of its own.
    pub physics_version: u32,
}

/// The ids and states of all jobs of the store in `dir`, of any physics version, by id; none if there is no store.
///
/// # Errors
/// As [`open_reading`]; [`StoreError::Corrupt`] for a row that does not describe a job.
pub fn job_states(dir: &Path) -> Result<Vec<(JobId, JobState)>, StoreError> {
    let Some(conn) = open_reading(dir)? else { return Ok(Vec::new()) };
    let read = || -> rusqlite::Result<Result<Vec<_>, StoreError>> {
        let mut statement = conn.prepare("SELECT job_id, state FROM jobs ORDER BY job_id")?;
        let mut rows = statement.query([])?;
        let mut jobs = Vec::new();
        while let Some(row) = rows.next()? {
            let (id, state) = (row.get_ref(0)?.as_str()?, row.get_ref(1)?.as_str()?);
            match (id.parse(), JobState::from_name(state)) {
                (Ok(id), Some(state)) => jobs.push((id, state)),
                _ => {
                    return Ok(Err(corrupt(id, format!("`{id}` and `{state}` are not the id and the state of a job"))));
                }
            }
        }
        Ok(Ok(jobs))
    };
    read().map_err(StoreError::sql(&database(dir)))?
}

/// The job `id` of the store in `dir`, of any physics version, if it is there.
///
/// # Errors
/// As [`open_reading`]; [`StoreError::Corrupt`] for a point that cannot be read.
pub fn job(dir: &Path, id: JobId) -> Result<Option<StoredJob>, StoreError> {
    let Some(conn) = open_reading(dir)? else { return Ok(None) };
    let found = conn.query_row(
        "SELECT points.spec, jobs.seed, jobs.state, jobs.physics_version
         FROM jobs JOIN points ON points.key = jobs.point WHERE jobs.job_id = ?1",
        [id.to_string()],
        |row| Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?, row.get::<_, String>(2)?, row.get(3)?)),
    );
    let found = found.optional().map_err(StoreError::sql(&database(dir)))?;
    let Some((spec, seed, state, physics_version)) = found else { return Ok(None) };
    let state =
        JobState::from_name(&state).ok_or_else(|| corrupt(id, format!("`{state}` is not the state of a job")))?;
    Ok(Some(StoredJob { point: parse_point(&spec, id)?, seed: seed as u64, state, physics_version }))
}

/// At most `most` jobs, of any physics version, whose id begins with `prefix`, by id.
///
/// # Errors
/// [`StoreError::Missing`] without a store; what SQLite reports.
pub(crate) fn find_jobs(dir: &Path, prefix: &str, most: usize) -> Result<Vec<JobId>, StoreError> {
    let conn = open_existing(dir)?;
    let read = || -> rusqlite::Result<Vec<String>> {
        // `g` follows the last hexadecimal digit.
        let mut statement =
            conn.prepare("SELECT job_id FROM jobs WHERE job_id >= ?1 AND job_id < ?1 || 'g' ORDER BY job_id LIMIT ?2")?;
        statement.query_map(params![prefix.to_ascii_lowercase(), most as i64], |row| row.get(0))?.collect()
    };
    let ids = read().map_err(StoreError::sql(&database(dir)))?;
    ids.iter().map(|id| id.parse().map_err(|error| corrupt(id, format!("{error}")))).collect()
}

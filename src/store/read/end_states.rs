//! From which end states jobs may go on.

use crate::parameters::JobId;
use crate::results::outline::Outline;
use crate::results::trajectory::Samples;
use crate::store::end_state::unsealed;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::{corrupt, open_existing, outlines, records};
use rusqlite::{Connection, OptionalExtension, params};
use std::collections::HashSet;
use std::path::Path;

/// An end state, and what was recorded until then and shortly after.
#[derive(Debug)]
pub(crate) struct FoundEnd {
    /// The state, as its owner encoded it.
    pub state: Vec<u8>,
    /// Wall time spent on it, in seconds.
    pub wall_s: f64,
    /// The series of its job.
    pub samples: Samples,
    /// The outlines of its job, by time.
    pub outlines: Vec<Outline>,
}

/// The courses of which there is an end state.
///
/// # Errors
/// What SQLite reports.
pub(crate) fn ended_courses(conn: &Connection) -> Result<HashSet<JobId>, StoreError> {
    let read = || -> rusqlite::Result<HashSet<JobId>> {
        let mut statement = conn.prepare("SELECT DISTINCT course FROM end_states")?;
        let mut rows = statement.query([])?;
        let mut courses = HashSet::new();
        while let Some(row) = rows.next()? {
            courses.extend(row.get_ref(0)?.as_str()?.parse::<JobId>().ok());
        }
        Ok(courses)
    };
    read().map_err(StoreError::sql(Path::new(conn.path().unwrap_or_default())))
}

/// The latest end state of this course that a job passes too, which ends by `last_step` or after `distance`; `None` if
/// there is none.
///
/// # Errors
/// [`StoreError::Missing`] without a store; [`StoreError::Corrupt`] for a damaged state; what SQLite reports.
pub(crate) fn end_state(
    dir: &Path,
    course: JobId,
    last_step: u64,
    distance: Option<f64>,
) -> Result<Option<FoundEnd>, StoreError> {
    let conn = open_existing(dir)?;
    let last_step = i64::try_from(last_step).unwrap_or(i64::MAX);
    // A shorter distance would have ended the run no later, so every check before the state is one of this job too.
    let found = conn.query_row(
        "SELECT jobs.job_id, end_states.state, coalesce(wall_s, 0.0)
         FROM end_states JOIN jobs ON jobs.key = end_states.job JOIN outcomes ON outcomes.job = jobs.key
         WHERE course = ?1 AND step < ?2 AND (?3 IS NULL OR distance <= ?3) AND jobs.state = 'done'
         ORDER BY step DESC LIMIT 1",
        params![course.to_string(), last_step, distance],
        |row| Ok((row.get::<_, String>(0)?, row.get::<_, Vec<u8>>(1)?, row.get(2)?)),
    );
    let Some((id, state, wall_s)) = found.optional().map_err(StoreError::sql(&database(dir)))? else { return Ok(None) };
    let job: JobId = id.parse().map_err(|error| corrupt(&id, format!("{error}")))?;
    let state = unsealed(&state).ok_or_else(|| corrupt(&id, "its end state does not match its checksum".to_owned()))?;
    let record = records::records(dir, &[job], true)?.pop().flatten();
    let samples = record.map(|record| record.samples).unwrap_or_default();
    Ok(Some(FoundEnd { state: state.to_vec(), wall_s, samples, outlines: outlines::outlines(dir, job)? }))
}

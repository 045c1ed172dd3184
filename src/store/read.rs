//! Reading jobs back: for the planner, which asks what is done, and for rendering, which asks what one job was.
//!
//! Reading takes no lock: it works while a run goes on, and takes a store that does not exist for an empty one.

use crate::parameters::{JobId, JobState, Point};
use crate::store::{BUSY_TIMEOUT, StoreError, database, migrate};
use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags, OptionalExtension};
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
    /// The version of the physics that it belongs to; another than the program's cannot be computed again.
    pub physics_version: u32,
}

/// Opens the store in `dir` for reading, or `None` if there is none yet.
///
/// # Errors
/// [`StoreError::Newer`], [`StoreError::Older`] or [`StoreError::Foreign`]; else what SQLite reports.
pub fn open_reading(dir: &Path) -> Result<Option<Connection>, StoreError> {
    let path = database(dir);
    if !path.exists() {
        return Ok(None);
    }
    let open = || -> rusqlite::Result<Connection> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let conn = Connection::open_with_flags(&path, flags)?;
        conn.busy_timeout(BUSY_TIMEOUT)?;
        keep_plans(&conn)?;
        conn.pragma_update(None, "query_only", true)?;
        // Looking jobs up by their hash goes all over the database.
        conn.pragma_update(None, "cache_size", -64 * 1024)?;
        Ok(conn)
    };
    let conn = open().map_err(StoreError::sql(&path))?;
    Ok(migrate::check_readable(&conn, &path)?.then_some(conn))
}

/// Has SQLite plan a prepared statement once, and not anew for every value that is bound to it.
pub(super) fn keep_plans(conn: &Connection) -> rusqlite::Result<()> {
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_QPSG, true).map(drop)
}

/// The ids and states of all jobs of the store in `dir`, of any physics version, by id; none if there is no store.
///
/// # Errors
/// As [`open_reading`]; [`StoreError::Corrupt`] for a row that is no job.
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
                _ => return Ok(Err(corrupt(id, format!("`{id}`, `{state}` is no job_id and state")))),
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
    let state = JobState::from_name(&state).ok_or_else(|| corrupt(id, format!("`{state}` is no state")))?;
    Ok(Some(StoredJob { point: parse_point(&spec, id)?, seed: seed as u64, state, physics_version }))
}

/// Reads the canonical text of a point; `row` names the row it stands in.
pub(super) fn parse_point(spec: &str, row: impl ToString) -> Result<Point, StoreError> {
    serde_json::from_str(spec).map_err(|error| corrupt(row, format!("its spec is no point: {error}")))
}

pub(super) fn corrupt(row: impl ToString, problem: String) -> StoreError {
    StoreError::Corrupt { row: row.to_string(), problem }
}

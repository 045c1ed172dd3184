//! What a picture of a job needs: the shapes of its droplet, how it went, and its path.

use crate::parameters::JobId;
use crate::results::outline::Outline;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::rows::JobRow;
use crate::store::read::{corrupt, open_existing, samples_table};
use rusqlite::{Connection, OptionalExtension, Row};
use std::path::Path;

/// How a job went, in the words of the store.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JobStory {
    /// How it ended, if it finished.
    pub outcome: Option<String>,
    /// How its clog holds, where that is known.
    pub mechanism: Option<String>,
    /// Displacement at the end, in sigma.
    pub r_end: Option<f64>,
    /// Time at the end, in t0.
    pub t_end: Option<f64>,
    /// Class of its failure.
    pub error_class: Option<String>,
    /// Reason of its failure.
    pub error: Option<String>,
    /// Whether it was at rest when its time ran out.
    pub arrested: bool,
}

/// The kept shapes of a job of the store in `dir`, by time; none for a job that is unknown or has not run.
///
/// # Errors
/// [`StoreError::Missing`] without a store; [`StoreError::Corrupt`] for a row that does not describe a shape.
pub fn outlines(dir: &Path, id: JobId) -> Result<Vec<Outline>, StoreError> {
    let conn = open_existing(dir)?;
    let rows = read(&conn, &id.to_string()).map_err(StoreError::sql(&database(dir)))?;
    let outlines: Option<Vec<_>> = rows.into_iter().collect();
    outlines.ok_or_else(|| corrupt(id, "its outline cannot be read".to_owned()))
}

/// The kept shapes of a job, by time; `None` for a row that does not describe one.
pub(super) fn read(conn: &Connection, job_id: &str) -> rusqlite::Result<Vec<Option<Outline>>> {
    let mut statement = conn.prepare_cached(
        "SELECT t, vertices, loads FROM shape_rows JOIN jobs ON jobs.key = shape_rows.job
         WHERE job_id = ?1 ORDER BY t",
    )?;
    statement.query_map([job_id], outline)?.collect()
}

/// The rows of a job in the table `outline`: its vertices, numbered from 0 in each shape.
pub(super) fn vertices(conn: &Connection, job_id: &str) -> Result<Vec<JobRow>, StoreError> {
    let sql_error = |error| StoreError::sql(Path::new(conn.path().unwrap_or_default()))(error);
    let mut rows = Vec::new();
    for outline in read(conn, job_id).map_err(sql_error)? {
        let outline = outline.ok_or_else(|| corrupt(job_id, "its outline cannot be read".to_owned()))?;
        let vertices = outline.x.iter().zip(&outline.y).zip(0_i64..);
        rows.extend(vertices.map(|((&x, &y), vertex)| [outline.t.into(), vertex.into(), x.into(), y.into()]));
    }
    Ok(rows)
}

/// The shape in a row; `None` if the row does not describe one.
pub(super) fn outline(row: &Row<'_>) -> rusqlite::Result<Option<Outline>> {
    let (t, vertices, loads) = (row.get(0)?, row.get_ref(1)?.as_blob()?, row.get_ref(2)?.as_str()?);
    let (numbers, rest) = vertices.as_chunks::<8>();
    let mut x: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let y = x.split_off(x.len() / 2);
    let loads = serde_json::from_str(loads).ok();
    Ok(loads.map(|loads| Outline { t, x, y, loads }).filter(|outline| rest.is_empty() && outline.is_sound()))
}

/// How a job went; `None` if it has not ended or is unknown.
///
/// # Errors
/// [`StoreError::Missing`] without a store; what SQLite reports.
pub(crate) fn job_story(dir: &Path, id: JobId) -> Result<Option<JobStory>, StoreError> {
    let story = open_existing(dir)?.query_row(
        "SELECT outcome, mechanism, outcomes.r_end, outcomes.t_end, error_class, error, arrests.job IS NOT NULL FROM jobs
         JOIN outcomes ON outcomes.job = jobs.key LEFT JOIN clogs ON clogs.job = jobs.key
         LEFT JOIN arrests ON arrests.job = jobs.key WHERE job_id = ?1",
        [id.to_string()],
        |row| {
            Ok(JobStory {
                outcome: row.get(0)?,
                mechanism: row.get(1)?,
                r_end: row.get(2)?,
                t_end: row.get(3)?,
                error_class: row.get(4)?,
                error: row.get(5)?,
                arrested: row.get(6)?,
            })
        },
    );
    story.optional().map_err(StoreError::sql(&database(dir)))
}

/// The recorded path `[t, x, y]` of a job's centroid, by time; empty if nothing was recorded.
///
/// # Errors
/// [`StoreError::Missing`] without a store; what SQLite reports.
pub(crate) fn job_path(dir: &Path, id: JobId) -> Result<Vec<[f64; 3]>, StoreError> {
    let conn = open_existing(dir)?;
    samples_table::add_to(&conn, dir)?;
    let read = || -> rusqlite::Result<Vec<[f64; 3]>> {
        let mut statement = conn.prepare("SELECT t, h, y FROM samples WHERE job_id = ?1 ORDER BY t")?;
        statement.query_map([id.to_string()], |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?]))?.collect()
    };
    read().map_err(StoreError::sql(&database(dir)))
}

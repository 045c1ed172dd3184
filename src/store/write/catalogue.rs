//! The catalogue of sample files: which there are, and whose rows each holds.

use crate::store::sample_file::{SCHEMA_VERSION, SampleFile};
use rusqlite::{Connection, Row, params};
use std::ops::Range;

/// A file of the catalogue.
#[derive(Debug)]
pub(in crate::store) struct CataloguedFile {
    pub key: i64,
    pub file: SampleFile,
}

/// The rows of a job in a file.
#[derive(Debug)]
pub(in crate::store) struct JobSpan {
    pub key: i64,
    pub job_id: String,
    /// Whether this program can compute it again.
    pub is_current: bool,
    pub rows: Range<usize>,
}

/// The files of the catalogue, oldest first.
///
/// # Errors
/// What SQLite reports; a name that is none of a sample file.
pub(in crate::store) fn list(conn: &Connection) -> rusqlite::Result<Vec<CataloguedFile>> {
    let mut statement = conn.prepare_cached(FILES)?;
    let files = statement.query_map([], read)?;
    files.collect()
}

/// Keys of rows and the names in them, which are none of sample files.
pub(in crate::store) type ForeignNames = Vec<(i64, String)>;

/// The files of the catalogue whose names are those of sample files; and the keys and names of the others.
pub(in crate::store) fn sorted_out(conn: &Connection) -> rusqlite::Result<(Vec<CataloguedFile>, ForeignNames)> {
    let mut statement = conn.prepare_cached(FILES)?;
    let (mut rows, mut files, mut foreign) = (statement.query([])?, Vec::new(), Vec::new());
    while let Some(row) = rows.next()? {
        let name = row.get_ref(1)?.as_bytes_or_null()?.unwrap_or_default();
        match read(row) {
            Ok(file) => files.push(file),
            Err(_) => foreign.push((row.get(0)?, String::from_utf8_lossy(name).into_owned())),
        }
    }
    Ok((files, foreign))
}

const FILES: &str = "SELECT key, path, rows, bytes, checksum FROM sample_files ORDER BY key";

fn read(row: &Row<'_>) -> rusqlite::Result<CataloguedFile> {
    let (rows, bytes) = (row.get::<_, i64>(2)? as u64, row.get::<_, i64>(3)? as u64);
    let file = SampleFile { name: row.get(1)?, rows, bytes, checksum: row.get(4)? };
    Ok(CataloguedFile { key: row.get(0)?, file })
}

impl CataloguedFile {
    /// Whose rows it holds, in the order of the rows.
    pub(in crate::store) fn jobs(&self, conn: &Connection) -> rusqlite::Result<Vec<JobSpan>> {
        jobs_of(conn, self.key)
    }
}

/// Whose rows the file with this key holds, in the order of the rows.
pub(in crate::store) fn jobs_of(conn: &Connection, file: i64) -> rusqlite::Result<Vec<JobSpan>> {
    let mut statement = conn.prepare_cached(
        "SELECT jobs.key, jobs.job_id, first_row, row_count,
                    physics_version = (SELECT physics_version FROM current)
             FROM sample_index JOIN jobs ON jobs.key = sample_index.job WHERE file = ?1 ORDER BY first_row, row_count",
    )?;
    let jobs = statement.query_map([file], |row| {
        let (first, count) = (row.get::<_, u32>(2)? as usize, row.get::<_, u32>(3)? as usize);
        Ok(JobSpan {
            key: row.get(0)?,
            job_id: row.get(1)?,
            is_current: row.get::<_, Option<bool>>(4)?.unwrap_or(true),
            rows: first..first + count,
        })
    });
    jobs?.collect()
}

/// Adds a file to the catalogue; returns its key. A file is named by the hash of its bytes, so one that is listed
/// already is the same: jobs that were computed again, alone, write it again.
pub(super) fn add(conn: &Connection, file: &SampleFile) -> rusqlite::Result<i64> {
    let mut add = conn.prepare_cached(
        "INSERT INTO sample_files (path, rows, bytes, checksum, schema_version) VALUES (?1, ?2, ?3, ?4, ?5)
         ON CONFLICT (path) DO UPDATE SET
             rows = excluded.rows, bytes = excluded.bytes, checksum = excluded.checksum,
             schema_version = excluded.schema_version
         RETURNING key",
    )?;
    add.query_row(params![file.name, file.rows as i64, file.bytes as i64, file.checksum, SCHEMA_VERSION], |row| {
        row.get(0)
    })
}

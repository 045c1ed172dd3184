//! Reading a store: SQL for people, and the questions that the program itself asks.
//!
//! Start with `query.rs`, which answers one statement. `samples_table.rs` makes the Parquet files a table in it,
//! `job_table.rs` the outlines of droplets and the obstacles near their paths (`obstacles.rs`); `parquet_rows.rs` writes
//! an answer as a Parquet file, and `export.rs` writes all tables. `opening.rs` connects to the database, also without
//! the right to write, and `rows.rs` writes rows that the program worked out itself. The other files each answer one
//! question of the program: which jobs there are (`jobs.rs`), what they left (`records.rs`, `outlines.rs`), where they
//! may go on (`end_states.rs`), what a fit is made from (`fits.rs`), where a run stands (`status.rs`, `last_run.rs`).
//!
//! **Locking.** Reading takes no lock on the database, so it works while a run goes on. A connection that reads samples
//! announces itself in the file `readers`, and the writer leaves superseded sample files alone until it has gone.
//!
//! Reading needs no right to write: a store that nobody writes is read as a file that does not change (`opening.rs`).
//!
//! **Compatibility.** A reader changes nothing, so it does not upgrade: it refuses an older schema and says what does.
//! A store that does not exist is an empty one wherever that makes sense.
//!
//! **Performance.** Statements are planned once, not anew for every value bound to them. Whatever must be of one
//! moment is read in one transaction.
//!
//! **Durability.** A sample file is compared with its checksum before its first row is read, so numbers of a damaged
//! file do not get out.

pub(super) mod campaign_texts;
pub(super) mod end_states;
pub(super) mod export;
pub(super) mod fits;
pub(super) mod format;
mod functions;
mod job_table;
pub(super) mod jobs;
pub(super) mod last_run;
mod natural_join;
mod obstacles;
mod opening;
pub(super) mod outlines;
mod parquet_rows;
pub(super) mod query;
pub(super) mod records;
pub(super) mod rows;
mod sample_reader;
mod samples_table;
pub(super) mod status;
pub(super) mod twins;

use crate::parameters::Point;
use crate::store::error::StoreError;
use crate::store::folders::{database, refuse_no_folder};
use crate::store::{entries, schema};
use rusqlite::Connection;
use rusqlite::config::DbConfig;
use std::path::Path;
use std::time::Duration;

pub(super) use opening::connect;

/// How long a connection waits for another one before it reports that the store is busy.
pub(super) const BUSY_TIMEOUT: Duration = Duration::from_secs(30);

/// Opens the store in `dir` for reading; `None` if there is none yet.
///
/// # Errors
/// [`StoreError::Newer`], [`StoreError::Older`] or [`StoreError::Foreign`]; else what SQLite reports.
pub fn open_reading(dir: &Path) -> Result<Option<Connection>, StoreError> {
    if !database(dir).exists() {
        refuse_no_folder(dir)?;
        entries::refuse_foreign(dir)?;
        return Ok(None);
    }
    let conn = connect(dir)?;
    Ok(schema::is_readable(&conn, &database(dir))?.then_some(conn))
}

/// Opens the store in `dir` for reading.
///
/// # Errors
/// [`StoreError::Missing`] without a store, and as [`open_reading`].
fn open_existing(dir: &Path) -> Result<Connection, StoreError> {
    open_reading(dir)?.ok_or_else(|| StoreError::Missing(dir.to_owned()))
}

/// Has SQLite plan a prepared statement once, and not anew for every value that is bound to it.
pub(super) fn plan_once(conn: &Connection) -> rusqlite::Result<()> {
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_QPSG, true).map(drop)
}

/// Reads the canonical text of a point; `row` names the row it stands in.
pub(super) fn parse_point(spec: &str, row: impl ToString) -> Result<Point, StoreError> {
    serde_json::from_str(spec).map_err(|error| corrupt(row, format!("its spec does not describe a point: {error}")))
}

fn corrupt(row: impl ToString, problem: String) -> StoreError {
    StoreError::Corrupt { row: row.to_string(), problem }
}

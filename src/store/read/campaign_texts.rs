//! Which texts of campaigns a store holds.

use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::open_reading;
use std::path::Path;

/// Whether the store in `dir` holds this text of the campaign of that name.
///
/// # Errors
/// As [`open_reading`], and what SQLite reports.
pub fn holds_campaign(dir: &Path, name: &str, text: &str) -> Result<bool, StoreError> {
    let Some(conn) = open_reading(dir)? else { return Ok(false) };
    let found =
        conn.query_row("SELECT EXISTS (SELECT 1 FROM campaigns WHERE name = ?1 AND text = ?2)", (name, text), |row| {
            row.get(0)
        });
    found.map_err(StoreError::sql(&database(dir)))
}

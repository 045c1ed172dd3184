//! SQL over a store: `runs`, `clog_events`, `lambda_fits`, `speed_averages` and `samples` in one statement, read-only.

use crate::store::format::{Format, Sink};
use crate::store::{StoreError, functions, open_reading, samples_table};
use rusqlite::{Connection, Statement};
use std::io::Write;
use std::path::Path;

/// A query that could not be answered.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// The store could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// SQLite did not take the statement, or failed in the middle of it.
    #[error("{problem}{hint}")]
    Sql {
        /// What SQLite says.
        problem: String,
        /// What may help, on lines of its own, or empty.
        hint: String,
    },
    /// The answer could not be written out.
    #[error("writing the answer failed: {0}")]
    Output(#[source] std::io::Error),
}

/// Answers one SQL statement from the store in `dir`, writing rows to `out` as they come (a table: at the end).
///
/// A reader that has seen enough and closes the pipe ends the query without an error.
///
/// # Errors
/// [`StoreError::Missing`] without a store; [`QueryError::Sql`] with SQLite's words, and the names that exist if a table
/// or a column does not; [`QueryError::Output`].
pub fn query(dir: &Path, sql: &str, format: Format, out: &mut dyn Write) -> Result<(), QueryError> {
    let conn = open_reading(dir)?.ok_or_else(|| StoreError::Missing(dir.to_owned()))?;
    samples_table::register(&conn, dir)?;
    functions::register(&conn).map_err(StoreError::sql(dir))?;
    let mut statement = conn.prepare(sql).map_err(|error| explain(&conn, &error))?;
    match answer(&conn, &mut statement, format, out) {
        Err(QueryError::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        answered => answered,
    }
}

fn answer(
    conn: &Connection,
    statement: &mut Statement<'_>,
    format: Format,
    out: &mut dyn Write,
) -> Result<(), QueryError> {
    let sql_error = |error| explain(conn, &error);
    let names: Vec<String> = statement.column_names().map(str::to_owned).collect();
    let columns = names.len();
    let mut sink = Sink::begin(format, names, out).map_err(QueryError::Output)?;
    let mut rows = statement.query([]).map_err(sql_error)?;
    while let Some(row) = rows.next().map_err(sql_error)? {
        let values: Result<Vec<_>, _> = (0..columns).map(|column| row.get_ref(column)).collect();
        sink.row(&values.map_err(sql_error)?).map_err(QueryError::Output)?;
    }
    sink.end().map_err(QueryError::Output)
}

fn explain(conn: &Connection, error: &rusqlite::Error) -> QueryError {
    let problem = match error {
        rusqlite::Error::SqlInputError { msg, sql, offset, .. } => place(msg, sql, *offset),
        rusqlite::Error::SqliteFailure(_, Some(message)) => message.clone(),
        other => other.to_string(),
    };
    let hint = match error {
        _ if problem.contains("no such table") => format!("\n  there are: {}", tables(conn).join(", ")),
        rusqlite::Error::SqlInputError { msg, sql, .. } if msg.contains("no such column") => columns_of(conn, sql),
        _ => String::new(),
    };
    QueryError::Sql { problem, hint }
}

/// The message, then the line of the statement it is about with a mark under the place.
fn place(message: &str, sql: &str, offset: i32) -> String {
    let Some((before, after)) = usize::try_from(offset).ok().and_then(|offset| sql.split_at_checked(offset)) else {
        return message.to_owned();
    };
    let start = before.rsplit('\n').next().unwrap_or_default();
    let end = after.split('\n').next().unwrap_or_default();
    format!("{message}\n  {start}{end}\n  {:>width$}", "^", width = start.chars().count() + 1)
}

/// The columns of every table that the statement names, a line each.
fn columns_of(conn: &Connection, sql: &str) -> String {
    let words: Vec<&str> = sql.split(|c: char| !c.is_alphanumeric() && c != '_').collect();
    let line = |table: String| {
        let statement = conn.prepare(&format!("SELECT * FROM {table} LIMIT 0")).ok()?;
        let names: Vec<&str> = statement.column_names().collect();
        Some(format!("\n  {table} has: {}", names.join(", ")))
    };
    tables(conn)
        .into_iter()
        .filter(|table| words.iter().any(|word| word.eq_ignore_ascii_case(table)))
        .filter_map(line)
        .collect()
}

/// What a query can read, the contract first.
fn tables(conn: &Connection) -> Vec<String> {
    let read = || -> rusqlite::Result<Vec<String>> {
        let mut statement = conn.prepare(
            "SELECT name FROM sqlite_master WHERE type IN ('view', 'table') AND name NOT LIKE 'sqlite_%'
             ORDER BY type DESC, name",
        )?;
        statement.query_map([], |row| row.get(0))?.collect()
    };
    let mut names = vec!["samples".to_owned()];
    names.extend(read().unwrap_or_default());
    names
}

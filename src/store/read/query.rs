//! One SQL statement over a store, which only reads: it may join all views, all tables, and the tables `samples`,
//! `outline` and `obstacles`.

use crate::store::error::StoreError;
use crate::store::read::format::{Format, Sink};
use crate::store::read::opening::still_unchanged;
use crate::store::read::{functions, job_table, natural_join, open_existing, parquet_rows, samples_table};
use rusqlite::{Connection, Statement};
use std::io::Write;
use std::path::{Path, PathBuf};

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
    /// There is something where an export shall be written.
    #[error("{} is not empty: name a new folder, so that no file is overwritten", .0.display())]
    NotEmpty(PathBuf),
    /// The answer could not be written out.
    #[error("writing the answer failed: {0}")]
    Output(#[source] std::io::Error),
}

/// How much of an answer was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// All rows, or all that the reader took.
    Whole,
    /// As many rows as a table may have; there are more.
    Cut,
}

/// Answers one SQL statement from the store in `dir`. Rows are written to `out` as they come; those of a table and of a
/// Parquet file, whose form depends on all of them, at the end.
///
/// A reader that has seen enough and closes the pipe ends the query without an error. A table stops at
/// [`MOST_TABLE_ROWS`](crate::store::MOST_TABLE_ROWS).
///
/// # Errors
/// [`StoreError::Missing`] without a store; [`QueryError::Sql`] with SQLite's words and, where a table or a column
/// does not exist, the names of those that do; [`QueryError::Output`].
pub fn query(dir: &Path, sql: &str, format: Format, out: &mut dyn Write) -> Result<Answer, QueryError> {
    let conn = connection(dir)?;
    let mut statement = conn.prepare(sql).map_err(|error| explain(&conn, &error))?;
    if let Some(problem) = natural_join::way_out(sql) {
        return Err(QueryError::Sql { problem, hint: String::new() });
    }
    // SQLite would let VACUUM INTO write another file.
    if !statement.readonly() && statement.is_explain() == 0 {
        let hint = "`meniscus run`, `fit` and `check --repair` are what changes a store";
        return Err(refusal("this statement writes, and a query only reads", hint));
    }
    if statement.column_count() == 0 {
        let hint =
            format!("type a SELECT, as in \"select * from runs limit 5\"; there are: {}", tables(&conn).join(", "));
        return Err(refusal("this statement asks for nothing", &hint));
    }
    match answer(&conn, &mut statement, format, out) {
        Err(QueryError::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(Answer::Whole),
        answered => still_unchanged(&conn, dir).map_err(QueryError::from).and(answered),
    }
}

fn refusal(problem: &str, hint: &str) -> QueryError {
    QueryError::Sql { problem: problem.to_owned(), hint: format!("\n  {hint}") }
}

/// A connection that knows all tables and functions.
pub(super) fn connection(dir: &Path) -> Result<Connection, StoreError> {
    let conn = open_existing(dir)?;
    samples_table::add_to(&conn, dir)?;
    job_table::add_to(&conn, dir)?;
    functions::add_to(&conn).map_err(StoreError::sql(dir))?;
    Ok(conn)
}

/// A few jobs of each kind, clogs first.
const EXAMPLES: &str = "
    SELECT job_id, model, gamma, e_w, w_ob, seed, coalesce(outcome, error_class) AS ended, mechanism, r_end FROM (
        SELECT *, row_number() OVER
            (PARTITION BY model, outcome, error_class, mechanism ORDER BY gamma, e_w, seed) AS place
        FROM runs LEFT JOIN (SELECT job_id, mechanism FROM clog_events) USING (job_id)
        WHERE state IN ('done', 'failed'))
    WHERE place <= 3 ORDER BY outcome IS NOT 'clogged', outcome, mechanism, model, place LIMIT 24";

/// Writes a table of a few ended jobs of each kind, for people to choose from.
///
/// # Errors
/// As [`query`].
pub(crate) fn example_jobs(dir: &Path, out: &mut dyn Write) -> Result<(), QueryError> {
    query(dir, EXAMPLES, Format::Table, out).map(drop)
}

fn answer(
    conn: &Connection,
    statement: &mut Statement<'_>,
    format: Format,
    out: &mut dyn Write,
) -> Result<Answer, QueryError> {
    let columns = parquet_rows::columns_of(conn, statement);
    let sink = Sink::begin(format, columns, Vec::new(), out).map_err(QueryError::Output)?;
    pour(conn, statement, sink).map(|(_, extent)| extent)
}

/// Writes all rows of a statement, or as many as the sink takes; returns how many there were, and whether that is all.
pub(super) fn pour(
    conn: &Connection,
    statement: &mut Statement<'_>,
    mut sink: Sink<'_>,
) -> Result<(u64, Answer), QueryError> {
    let sql_error = |error| explain(conn, &error);
    let (columns, mut count) = (statement.column_count(), 0);
    let mut rows = statement.query([]).map_err(sql_error)?;
    let mut extent = Answer::Whole;
    while let Some(row) = rows.next().map_err(sql_error)? {
        if sink.is_full() {
            extent = Answer::Cut;
            break;
        }
        let values: Result<Vec<_>, _> = (0..columns).map(|column| row.get_ref(column)).collect();
        sink.row(&values.map_err(sql_error)?).map_err(QueryError::Output)?;
        count += 1;
    }
    sink.end().map_err(QueryError::Output)?;
    Ok((count, extent))
}

pub(super) fn explain(conn: &Connection, error: &rusqlite::Error) -> QueryError {
    let problem = match error {
        rusqlite::Error::SqlInputError { msg, sql, offset, .. } => place(msg, sql, *offset),
        rusqlite::Error::SqliteFailure(_, Some(message)) => message.clone(),
        other => other.to_string(),
    };
    let hint = match error {
        _ if problem.contains("no such table") => format!("\n  there are: {}", tables(conn).join(", ")),
        rusqlite::Error::SqlInputError { msg, sql, .. } if msg.contains("no such column") => columns_of(conn, sql),
        rusqlite::Error::MultipleStatement => "\n  a query is one statement: ask one after the other".to_owned(),
        _ => String::new(),
    };
    QueryError::Sql { problem, hint }
}

/// The message, then the line of the statement that it is about, with a mark under the place.
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

/// The names that a query can read from: `samples`, `outline` and `obstacles`, then views, then tables.
fn tables(conn: &Connection) -> Vec<String> {
    let read = || -> rusqlite::Result<Vec<String>> {
        let mut statement = conn.prepare(
            "SELECT name FROM sqlite_master WHERE type IN ('view', 'table') AND name NOT LIKE 'sqlite_%'
             ORDER BY type DESC, name",
        )?;
        statement.query_map([], |row| row.get(0))?.collect()
    };
    let mut names: Vec<String> = ["samples"].into_iter().chain(job_table::NAMES).map(str::to_owned).collect();
    names.extend(read().unwrap_or_default());
    names
}

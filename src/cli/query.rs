//! `meniscus query DIR "SQL"`.

use crate::cli::output::deliver;
use crate::cli::talk::say;
use crate::cli::{CommandResult, store_here};
use crate::store::{Answer, Format, MOST_TABLE_ROWS, query};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Beside SQLite's functions there are sqrt, exp, ln, log10, sin, cos, floor, ceil, power(x, y), and of many numbers
median(x), stddev(x) and percentile(x, p), p from 0 to 100. These leave NULL out.")]
pub(super) struct Arguments {
    /// The store
    store: PathBuf,
    /// One SQL statement over runs, clog_events, samples, outline, obstacles, lambda_fits, speed_averages; `-` reads it
    /// from stdin
    #[arg(required_unless_present = "file", allow_hyphen_values = true)]
    sql: Option<String>,
    /// Read the statement from a file; `-` is stdin
    #[arg(short, long, value_name = "FILE", conflicts_with = "sql")]
    file: Option<PathBuf>,
    /// Write the answer to a file, which is replaced once the answer is whole
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// How to write the answer: table (of 10000 rows at most), csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let (dir, sql) = (store_here(Some(&self.store))?, self.statement()?);
        let mut answer = Answer::Whole;
        let write = |out: &mut dyn Write| query(&dir, &sql, self.format, out).map(|extent| answer = extent);
        let exit = deliver(self.format, self.output.as_deref(), write)?;
        if answer == Answer::Cut && !quiet {
            say(format!(
                "note: a table stops at {MOST_TABLE_ROWS} rows, and there are more: --format csv or json writes all"
            ));
        }
        Ok(exit)
    }

    /// The statement, from wherever it is.
    fn statement(&self) -> Result<String, String> {
        match (&self.sql, &self.file) {
            (Some(sql), _) if sql != "-" => Ok(sql.clone()),
            (_, Some(path)) if path.as_os_str() != "-" => read(path),
            _ => {
                let mut sql = String::new();
                let read = std::io::stdin().read_to_string(&mut sql);
                read.map(|_| sql).map_err(|error| format!("cannot read the statement from stdin: {error}"))
            }
        }
    }
}

fn read(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("cannot read {}: {error}", path.display()))
}

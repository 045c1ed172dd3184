//! `meniscus query DIR "SQL"`.

use crate::cli::{CommandResult, Exit};
use crate::store::{Format, query};
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store
    store: PathBuf,
    /// One SQL statement over runs, clog_events, samples, lambda_fits and speed_averages
    sql: String,
    /// How to write the answer: table, csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let mut out = BufWriter::new(std::io::stdout().lock());
        query(&self.store, &self.sql, self.format, &mut out)?;
        match out.flush() {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
            _ => Ok(Exit::Done),
        }
    }
}

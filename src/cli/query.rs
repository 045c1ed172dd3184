//! `meniscus query DIR "SQL"`.

use crate::cli::{CommandResult, Exit};
use crate::store::{Format, query};
use std::io::{BufWriter, Write};
use std::path::PathBuf;

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Views and tables, one row for each:
  runs            job: parameters, state, outcome, displacement, speed, cost
  clog_events     clog: when, where, how it holds (wrap, squeeze, hybrid)
  samples         recorded instant of a job: t, r, h, y, v_g, ek_ratio, shape, area_error
  shapes          kept outline of a droplet, and the loads on it
  lambda_fits     grid point: the decay length, with its interval, as `fit` last computed it
  speed_averages  grid point: the mean speed, likewise
  stability       job: rise of energy, area error, overlap
  failures        failed job: class, reason, step, dump
  stale_runs      job of another physics version, with the columns of runs
An example:
  meniscus query quickstart.meniscus \"select gamma, w_ob, avg(r_end) from runs group by 1, 2\"
Columns: meniscus query DIR \"select name, type from pragma_table_info('runs')\"; keys: meniscus keys NAME")]
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

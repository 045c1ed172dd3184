//! `meniscus query DIR "SQL"`.

use crate::campaign::file::read_input;
use crate::cli::output::deliver;
use crate::cli::talk::say;
use crate::cli::{CommandResult, store_here};
use crate::parameters::shown;
use crate::store::{Answer, Format, MOST_TABLE_ROWS, query};
use std::io::{Error, Read, Write};
use std::path::{Path, PathBuf};

/// Arguments of `query`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Views and tables, one row for each:
  runs            job: parameters, state, outcome, displacement, speed, cost
  clog_events     clog: when, where, how it holds (wrap, squeeze, hybrid)
  arrest_events   arrest: a run cut off at rest, above the threshold of a clog; the equilibrium, and what was left
  pinch_events    film that closed, which ends a run: when, where
  samples         recorded instant of a job: t, r, h, y, v_g, ek_ratio, shape, area_error
  shapes          kept outline of a droplet, and the loads on it
  outline         vertex of a kept outline: t, vertex, x, y
  obstacles       obstacle near the path of a job: x, y, radius
  lambda_fits     grid point: the decay length, with its interval, as `fit` last computed it
  speed_averages  grid point: the mean speed, likewise
  survival        step of the survival curve of a grid point: r, at_risk, clogs, survival and its band, likewise
  stability       job: rise of energy, area error, overlap
  failures        failed job: class, reason, step, dump
  stale_runs      job of another physics version, with the columns of runs
An example:
  meniscus query quickstart.meniscus \"select gamma, w_ob, avg(r_end) from runs group by 1, 2\"
Columns: meniscus query DIR \"select name, type from pragma_table_info('runs')\"; keys: meniscus keys NAME
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
                let read = std::io::stdin().take(LONGEST_STATEMENT + 1).read_to_string(&mut sql);
                read.map_err(|error| format!("cannot read the statement from stdin: {error}"))?;
                match sql.len() as u64 {
                    0..=LONGEST_STATEMENT => Ok(sql),
                    _ => Err(format!("the statement on stdin is longer than {LONGEST_STATEMENT} bytes: shorten it")),
                }
            }
        }
    }
}

/// Longest statement, in bytes. People write shorter ones; a device such as /dev/zero has no end.
const LONGEST_STATEMENT: u64 = 1 << 20;

fn read(path: &Path) -> Result<String, String> {
    let text = read_input(path, LONGEST_STATEMENT).and_then(|bytes| String::from_utf8(bytes).map_err(Error::other));
    text.map_err(|error| format!("cannot read {}: {error}", shown(path)))
}

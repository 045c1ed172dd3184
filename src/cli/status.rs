//! `meniscus status [DIR]`: how far a store has come.

use crate::campaign::durations::written;
use crate::cli::output::deliver;
use crate::cli::{CommandResult, store_here};
use crate::execute::Progress;
use crate::execute::machine_speed;
use crate::parameters::plain;
use crate::physics::simd;
use crate::store::{
    CampaignCounts, ColumnKind, Format, LastRun, RunProgress, StateCounts, Status, Value, last_run, status, write_rows,
};
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// As JSON: short for --format json
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// How to write it: table (in words), json, or a row for each campaign as csv or parquet
    #[arg(long, default_value = "table")]
    format: Format,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let dir = store_here(self.store.as_deref())?;
        if crate::store::open_reading(&dir)?.is_none() {
            return Err(crate::store::StoreError::Missing(dir).into());
        }
        let status = status(&dir)?;
        let time_left = match status.holder {
            Some(_) => {
                let speed = machine_speed::measure(simd::best_instruction_set());
                let left =
                    |run: LastRun| Progress::seen(&run.points, |point| speed.expected_s(point)).time_left(run.elapsed);
                last_run(&dir)?.and_then(left)
            }
            None => None,
        };
        let format = if self.json { Format::Json } else { self.format };
        deliver(format, None, |out: &mut dyn Write| match format {
            Format::Table => out.write_all(describe(&status, time_left).as_bytes()),
            Format::Json => {
                let time_left_s = time_left.map(|left| left.as_secs_f64());
                serde_json::to_writer_pretty(&mut *out, &WithTimeLeft { status: &status, time_left_s })?;
                writeln!(out)
            }
            format => write_rows(&COLUMNS, status.campaigns.iter().map(row), format, out),
        })
    }
}

const COLUMNS: [(&str, ColumnKind); 6] = [
    ("campaign", ColumnKind::Text),
    ("jobs", ColumnKind::Whole),
    ("pending", ColumnKind::Whole),
    ("running", ColumnKind::Whole),
    ("done", ColumnKind::Whole),
    ("failed", ColumnKind::Whole),
];

/// The values of [`COLUMNS`].
fn row(campaign: &CampaignCounts) -> Vec<Value> {
    let counts = &campaign.counts;
    let numbers = [counts.jobs(), counts.pending, counts.running, counts.done, counts.failed];
    [Value::from(campaign.campaign.clone())].into_iter().chain(numbers.map(|n| Value::from(n as i64))).collect()
}

/// The status, and how long the run that is under way will take.
#[derive(serde::Serialize)]
struct WithTimeLeft<'a> {
    #[serde(flatten)]
    status: &'a Status,
    time_left_s: Option<f64>,
}

/// The status in words.
fn describe(status: &Status, time_left: Option<Duration>) -> String {
    let mut text = String::new();
    let mut line = |words: String| text.extend([&*plain(&words), "\n"]);
    for campaign in &status.campaigns {
        line(format!("{}: {}", campaign.campaign, counts(&campaign.counts)));
    }
    if status.campaigns.len() != 1 {
        line(format!("all: {}", counts(&status.total)));
    }
    line(format!("{} clogs", status.clogs));
    if status.stale > 0 {
        line(format!("{} jobs of another physics version, kept in the view stale_runs", status.stale));
    }
    for failure in &status.failures {
        line(format!("{} {}, such as {}: {}", failure.jobs, failure.class, failure.example_job, failure.example));
    }
    match (&status.holder, &status.run) {
        (Some(holder), run) => {
            let rate = run.as_ref().and_then(rate).map(|rate| format!(", {rate:.1} jobs/min"));
            let left = time_left.map(|left| format!(", {} left", written(left)));
            line(format!("{holder} is at work{}{}", rate.unwrap_or_default(), left.unwrap_or_default()));
        }
        (None, _) if status.total.pending + status.total.running > 0 => {
            line("nobody is at work; `meniscus run CAMPAIGN.toml` goes on".to_owned());
        }
        (None, _) => {}
    }
    text
}

fn counts(counts: &StateCounts) -> String {
    let StateCounts { pending, running, done, failed } = counts;
    format!("{} jobs: {done} done, {failed} failed, {running} running, {pending} pending", counts.jobs())
}

/// Jobs a minute, over the last minute.
fn rate(run: &RunProgress) -> Option<f64> {
    (run.finished_in_window > 0 && run.window_s > 0.0).then(|| 60.0 * run.finished_in_window as f64 / run.window_s)
}

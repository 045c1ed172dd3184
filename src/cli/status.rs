//! `meniscus status [DIR]`: how far a store has come.

use super::progress::human;
use super::{Exit, Outcome, print, store_here};
use meniscus::store::{StateCounts, Status, status};
use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// As JSON
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Runs the subcommand.
    pub fn run(&self) -> Outcome {
        let dir = store_here(self.store.as_deref())?;
        if meniscus::store::open_reading(&dir)?.is_none() {
            return Err(meniscus::store::StoreError::Missing(dir).into());
        }
        let status = status(&dir)?;
        let text = if self.json { serde_json::to_string_pretty(&status)? + "\n" } else { describe(&status) };
        print(&text)?;
        Ok(Exit::Done)
    }
}

/// The status in words.
fn describe(status: &Status) -> String {
    let mut text = String::new();
    let mut line = |words: String| text.extend([words.as_str(), "\n"]);
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
            line(format!("{holder} is at work{}", run.as_ref().map(|run| rate(run, status)).unwrap_or_default()))
        }
        (None, _) if status.total.pending + status.total.running > 0 => {
            line("nobody is at work; `meniscus run` on the campaign file goes on".to_owned());
        }
        (None, _) => {}
    }
    text
}

fn counts(counts: &StateCounts) -> String {
    let StateCounts { pending, running, done, failed } = counts;
    format!("{} jobs: {done} done, {failed} failed, {running} running, {pending} pending", counts.jobs())
}

/// Rate over the last minute, and what it makes of the rest.
fn rate(run: &meniscus::store::RunProgress, status: &Status) -> String {
    let mut text = String::new();
    if run.finished_in_window > 0 && run.window_s > 0.0 {
        let per_second = run.finished_in_window as f64 / run.window_s;
        let left = (status.total.pending + status.total.running) as f64 / per_second;
        let left = Duration::try_from_secs_f64(left).unwrap_or(Duration::MAX);
        let _ = write!(text, ", {:.1} jobs/min, {} left at this rate", 60.0 * per_second, human(left));
    }
    text
}

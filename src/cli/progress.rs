//! How a run shows where it stands: a bar for people who watch, a line now and then for logs.

use crate::campaign::plan::Plan;
use crate::execute::schedule::Progress;
use std::fmt::Write;
use std::io::IsTerminal;
use std::path::Path;
use std::time::Duration;
use tracing::Span;
use tracing_indicatif::span_ext::IndicatifSpanExt;
use tracing_indicatif::style::ProgressStyle;

/// Time between two plain lines: short at first, so that one sees it works, then longer.
const FIRST_LINE: Duration = Duration::from_secs(5);
const LONGEST_PAUSE: Duration = Duration::from_secs(300);

/// The display of one run.
pub struct Display {
    bar: Option<Span>,
    quiet: bool,
    next_line: Duration,
    elapsed: Duration,
}

impl Display {
    /// Says what is about to happen; `go_on` of the jobs have a checkpoint.
    pub fn new(plan: &Plan, go_on: usize, dir: &Path, threads: usize, quiet: bool) -> Self {
        let bar = (!quiet && std::io::stderr().is_terminal()).then(|| {
            let bar = tracing::error_span!("campaign");
            let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}");
            bar.pb_set_style(&style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.pb_set_length(plan.jobs.len() as u64);
            bar.pb_start();
            bar
        });
        if !quiet {
            let (jobs, dir) = (plan.jobs.len(), dir.display());
            let from = if go_on == 0 { String::new() } else { format!(", {go_on} from where they were saved,") };
            eprintln!("{}: {jobs} jobs to run{from} on {threads} threads, results go to {dir}", plan.campaign);
        }
        Self { bar, quiet, next_line: FIRST_LINE, elapsed: Duration::ZERO }
    }

    /// Shows the progress.
    pub fn update(&mut self, progress: &Progress, elapsed: Duration) {
        self.elapsed = elapsed;
        if let Some(bar) = &self.bar {
            bar.pb_set_position(progress.ended);
            bar.pb_set_message(&describe(progress, elapsed));
        } else if !self.quiet && elapsed >= self.next_line {
            self.next_line = elapsed + elapsed.min(LONGEST_PAUSE);
            eprintln!("{}/{} jobs {}", progress.ended, progress.jobs, describe(progress, elapsed));
        }
    }

    /// Clears the bar and sums up.
    pub fn finish(self, progress: &Progress) {
        drop(self.bar);
        if !self.quiet {
            let (ended, clogs, failed) = (progress.ended, progress.clogs, progress.failed());
            eprintln!("{ended} jobs ran in {}: {clogs} clogs, {failed} failures", human(self.elapsed));
        }
    }
}

/// Clogs, failures, rate and time left.
fn describe(progress: &Progress, elapsed: Duration) -> String {
    let mut text = format!("{} clogs", progress.clogs);
    for (class, number) in &progress.failures {
        let _ = write!(text, ", {number} {}", class.name());
    }
    let rate = progress.rate(elapsed);
    let _ = if rate < 1.0 { write!(text, ", {:.1}/min", 60.0 * rate) } else { write!(text, ", {rate:.0}/s") };
    if let Some(left) = progress.time_left(elapsed) {
        let _ = write!(text, ", {} left", human(left));
    }
    text
}

/// A time in the two units that matter.
pub fn human(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds {
        0..60 => format!("{:.1} s", time.as_secs_f64()),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        3600..172_800 => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
        _ => format!("{} days", seconds / 86400),
    }
}

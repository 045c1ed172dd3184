//! How a run shows where it stands: a bar for people who watch, a line now and then for logs.

use crate::campaign::durations::written;
use crate::cli::talk::{is_watched, say, typed};
use crate::execute::{Event, Options, Progress};
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;
use tracing::Span;
use tracing_indicatif::span_ext::IndicatifSpanExt;
use tracing_indicatif::style::ProgressStyle;

/// Time to the first plain line: short, so that one sees that it works. Later lines come after twice the time so far,
/// but no further apart than the longest pause.
const FIRST_LINE: Duration = Duration::from_secs(5);
const LONGEST_PAUSE: Duration = Duration::from_secs(300);

/// The display of one run.
pub(super) struct Display<'a> {
    dir: &'a Path,
    quiet: bool,
    /// How the deadline was understood, until it is said.
    remark: Option<String>,
    bar: Option<Span>,
    next_line: Duration,
}

impl<'a> Display<'a> {
    /// Of a run that writes to the store in `dir`.
    pub(super) fn new(dir: &'a Path, quiet: bool, remark: Option<String>) -> Self {
        Self { dir, quiet, remark, bar: None, next_line: FIRST_LINE }
    }

    /// Shows what happens.
    pub(super) fn show(&mut self, event: Event<'_>) {
        if self.quiet {
            return;
        }
        match event {
            Event::RoundBegins { rounds_before, campaign, jobs, resumed, threads } => {
                if rounds_before > 0 {
                    say(format!("not every interval is as narrow as asked for: another round, of {jobs} runs"));
                }
                self.bar = is_watched().then(|| bar(jobs));
                self.next_line = FIRST_LINE;
                let dir = typed(self.dir);
                let from =
                    if resumed == 0 { String::new() } else { format!(", {resumed} from where they were saved,") };
                say(format!("{campaign}: {jobs} jobs to run{from} on {threads} threads, results go to {dir}"));
                self.remark.take().into_iter().chain(crowded(threads)).for_each(say);
            }
            Event::Progress(progress, elapsed) => self.update(progress, elapsed),
            Event::RoundEnds(progress, elapsed) => {
                self.bar = None;
                let (ended, clogs, failed) = (progress.ended, progress.clogs, progress.failed());
                say(format!("{ended} jobs ran in {}: {clogs} clogs, {failed} failures", written(elapsed)));
            }
        }
    }

    fn update(&mut self, progress: &Progress, elapsed: Duration) {
        if let Some(bar) = &self.bar {
            bar.pb_set_position(progress.ended);
            bar.pb_set_message(&describe(progress, elapsed));
        } else if elapsed >= self.next_line {
            self.next_line = elapsed + elapsed.min(LONGEST_PAUSE);
            say(format!("{}/{} jobs {}", progress.ended, progress.jobs, describe(progress, elapsed)));
        }
    }
}

/// What to say of more threads than cores.
fn crowded(threads: usize) -> Option<String> {
    let cores = Options::default().threads;
    (threads > cores).then(|| format!("note: {threads} threads share {cores} cores, which makes no run faster"))
}

/// A bar that is as long as there are jobs.
fn bar(jobs: usize) -> Span {
    let bar = tracing::error_span!("campaign");
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}");
    bar.pb_set_style(&style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.pb_set_length(jobs as u64);
    bar.pb_start();
    bar
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
        let _ = write!(text, ", {} left", written(left));
    }
    text
}

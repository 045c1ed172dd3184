//! What `run` and `accuracy` share: where results go, what a run may use, and what is said when it stops early.

use crate::cli::deadline::Deadline;
use crate::cli::talk::{say, typed};
use crate::cli::{CommandResult, Exit, store_of};
use crate::execute::{Options, Paused, StopReason, Stopped, set_by_signals};
use crate::store::StoreError;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Where results go, and what a run may use.
#[derive(Debug, clap::Args)]
pub(super) struct Effort {
    /// The store [default: NAME.meniscus in this folder]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Stop after this time (90s, 45m, 8h, 2d, 1h30m, 1:30:00, 1-00:00:00) or when the clock shows it (07:30);
    /// trajectories under way are saved
    #[arg(long, value_name = "TIME", value_parser = Deadline::parse)]
    deadline: Option<Deadline>,
}

impl Effort {
    /// The folder of the store of a campaign of this name.
    pub(super) fn store(&self, campaign: &str) -> PathBuf {
        store_of(self.store.as_deref(), campaign)
    }

    /// How to run, counting the time from now on. From here on the first signal stops the run, and the second the
    /// program.
    pub(super) fn options(&self) -> Result<Options, StoreError> {
        let options = Options::default();
        Ok(Options {
            threads: self.threads.map_or(options.threads, usize::from),
            deadline: self.deadline.map(Deadline::counted_from_now),
            interrupted: set_by_signals(Exit::Interrupted as i32)?,
            ..options
        })
    }

    /// How the deadline was understood, if there is one.
    pub(super) fn remark(&self) -> Option<String> {
        self.deadline.map(Deadline::told)
    }

    /// The command that goes on with a campaign: `program` and these arguments. What came through a pipe has no name
    /// that lasts.
    pub(super) fn command(&self, program: &str, campaign: &Path) -> String {
        let name = if lasts(campaign) { typed(campaign) } else { "CAMPAIGN.toml".to_owned() };
        format!("{program} {name}{}", self.again())
    }

    /// These arguments, but the deadline, as one types them after a command that is to go on.
    pub(super) fn again(&self) -> String {
        let mut text = String::new();
        if let Some(store) = &self.store {
            let _ = write!(text, " --store {}", typed(store));
        }
        if let Some(threads) = self.threads {
            let _ = write!(text, " --threads {threads}");
        }
        text
    }
}

/// Whether a file will be there under this name later: not if a shell made it for one command, as `<(...)` does.
pub(super) fn lasts(file: &Path) -> bool {
    file.is_file() && !file.starts_with("/dev") && !file.starts_with("/proc")
}

/// What to add to a command that goes on with a campaign of no lasting name.
pub(super) fn remark_on(campaign: &Path) -> &'static str {
    if lasts(campaign) { "" } else { "  (with the same campaign)" }
}

/// Says why a run stopped, what is saved, and which command goes on; `retry`, if there is one, is the command that
/// tries failures of a class again. Everything is saved by then; tables of what is finished come after.
pub(super) fn tell_stopped(
    stopped: &Stopped,
    dir: &Path,
    quiet: bool,
    again: &str,
    retry: Option<&str>,
) -> CommandResult {
    let (kept, dir) = (kept(stopped), typed(dir));
    let (why, exit) = match stopped.reason {
        StopReason::Interrupted => ("interrupted", Exit::Interrupted),
        StopReason::Deadline => ("the deadline came", Exit::Done),
        StopReason::Breaker { class, failures } => {
            let class = class.name();
            let retry = retry.map_or_else(String::new, |retry| format!("\n  try them again: {retry} {class}"));
            return Err(format!(
                "stopped, for {failures} jobs, most of them, failed alike ({class}); {kept}.\n  \
                 look: meniscus query {dir} \"select job_id, error, dump from failures limit 5\"\n  \
                 see one fail: meniscus replay {dir}/DUMP{retry}"
            )
            .into());
        }
        StopReason::WriterStopped => return Err(format!("the store took no more outcomes; {kept}").into()),
    };
    if !quiet {
        say(format!("{why}: {kept}.\n  to go on: {again}"));
    }
    Ok(exit)
}

/// What is in the store of the work that a run began.
fn kept(stopped: &Stopped) -> String {
    let (ended, Paused { saved, unsaved }) = (stopped.ended, stopped.paused);
    let lost = match unsaved {
        0 => String::new(),
        _ => format!(", {unsaved} had just begun or could not be saved"),
    };
    format!("{ended} trajectories of this run are finished and in the store, {saved} under way are saved{lost}")
}

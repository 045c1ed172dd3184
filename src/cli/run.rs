//! `meniscus run CAMPAIGN.toml`: plan, run, resume, and end with the tables.

use crate::campaign::file::Campaign;
use crate::campaign::plan::{KnownJobs, Plan, plan};
use crate::cli::deadline::{Deadline, parse_time};
use crate::cli::progress::Display;
use crate::cli::{Exit, Outcome, fit, print, store_of};
use crate::execute::executor::{self, Options, Paused, Report};
use crate::execute::machine_speed;
use crate::execute::rounds::{Results, grown};
use crate::execute::schedule::{Progress, StopReason};
use crate::physics::simd;
use crate::results::trajectory::FailureClass;
use crate::store::{CampaignRecord, PlannedPoint, Provenance, Store, StoreError, job_states, open_reading, point_runs};
use rusqlite::Connection;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::borrow::Cow;
use std::collections::HashSet;
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The campaign file
    campaign: PathBuf,
    /// The store [default: NAME.meniscus in this folder]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Stop after this time (90s, 45m, 8h, 2d) or when the clock shows it (07:30); trajectories under way are saved
    #[arg(long, value_name = "TIME", value_parser = Deadline::parse)]
    deadline: Option<Deadline>,
    /// Save trajectories under way after every so much time
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_time)]
    checkpoint_every: Duration,
    /// Run failed jobs of this class again: unstable, engulfed, crossed, panicked, io, bad_input, or all
    #[arg(long, value_name = "CLASS", value_parser = parse_class)]
    retry: Option<RetryClass>,
}

/// Which failures to try again.
#[derive(Clone, Copy, Debug)]
pub enum RetryClass {
    All,
    Only(FailureClass),
}

impl Arguments {
    /// Runs the subcommand.
    pub fn run(&self, quiet: bool) -> Outcome {
        let begin = Instant::now();
        let deadline = self.deadline.map(Deadline::time_left);
        let campaign = Campaign::load(&self.campaign)?;
        let dir = store_of(self.store.as_deref(), &campaign.name);
        let effort = Effort {
            threads: threads(self.threads),
            deadline: deadline.map(|deadline| deadline.saturating_sub(begin.elapsed())),
            checkpoint_every: self.checkpoint_every,
            retry: self.retry,
        };
        match effort.execute(&campaign, &dir, quiet)? {
            Some(early) => {
                let again = self.again();
                early.tell(&dir, quiet, &again, Some(&format!("{again} --retry")))
            }
            None => self.finish(&campaign, &dir, quiet),
        }
    }

    /// The command that goes on.
    fn again(&self) -> String {
        let mut command = format!("meniscus run {}", shown(&self.campaign));
        if let Some(store) = &self.store {
            let _ = write!(command, " --store {}", shown(store));
        }
        if let Some(threads) = self.threads {
            let _ = write!(command, " --threads {threads}");
        }
        command
    }

    /// Fits, prints the tables, and says how it ended.
    fn finish(&self, campaign: &Campaign, dir: &Path, quiet: bool) -> Outcome {
        let mine: HashSet<_> = campaign.blocks.iter().flat_map(|block| block.point_ids.iter().copied()).collect();
        print(&fit::tables(dir, |id| mine.contains(&id))?)?;
        let round = this_round(campaign, dir)?;
        let plan = plan_now(&round, dir)?;
        let failed: u64 = plan.blocks.iter().map(|block| block.counts.failed).sum();
        let done: u64 = plan.blocks.iter().map(|block| block.counts.done).sum();
        let say = |text: String| {
            if !quiet {
                eprintln!("{text}");
            }
        };
        if failed > 0 {
            say(format!(
                "{done} jobs are done, {failed} failed; see them with: meniscus query {} \"select * from failures\"",
                shown(dir)
            ));
            return Ok(Exit::FailedJobs);
        }
        say(format!("all {done} jobs are done; the results are in {}", dir.display()));
        Ok(Exit::Done)
    }
}

/// How a campaign is run.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Worker threads.
    pub threads: usize,
    /// Time after which to stop.
    pub deadline: Option<Duration>,
    /// Time between two checkpoints.
    pub checkpoint_every: Duration,
    /// Failures to try again.
    pub retry: Option<RetryClass>,
}

/// A run that ended before all was done.
#[derive(Debug)]
pub struct EarlyEnd {
    /// Why.
    pub reason: StopReason,
    /// What it got done.
    pub progress: Progress,
    /// What was under way.
    pub paused: Paused,
}

impl EarlyEnd {
    /// Says why not all was done, what is saved, and with which commands to go on, and to try failures again if there is one. No tables: somebody waits for the end.
    pub fn tell(self, dir: &Path, quiet: bool, again: &str, retry: Option<&str>) -> Outcome {
        let Self { reason, progress, paused } = self;
        let ended = progress.ended;
        let mut kept = format!(
            "{ended} trajectories of this run are finished and in the store, {} under way are saved",
            paused.saved
        );
        if paused.unsaved > 0 {
            let _ = write!(kept, ", {} had just begun or could not be saved", paused.unsaved);
        }
        let say = |why: &str| {
            if !quiet {
                eprintln!(
                    "{why}: {kept}.\n  to go on: {again}\n  tables of what is finished: meniscus fit {}",
                    shown(dir)
                );
            }
        };
        match reason {
            StopReason::Interrupted => say("interrupted"),
            StopReason::Deadline => {
                say("the deadline came");
                return Ok(Exit::Done);
            }
            StopReason::Breaker { class, failures } => {
                let (class, dir) = (class.name(), shown(dir));
                let retry = retry.map_or_else(String::new, |retry| format!("\n  try them again: {retry} {class}"));
                return Err(format!(
                    "stopped, for {failures} jobs, most of them, failed alike ({class}); {kept}.\n  \
                     look: meniscus query {dir} \"select job_id, error, dump from failures limit 5\"\n  \
                     see one fail: meniscus replay {dir}/DUMP{retry}"
                )
                .into());
            }
            StopReason::WriterStopped => return Err(format!("the store took no more outcomes; {kept}").into()),
        }
        Ok(Exit::Interrupted)
    }
}

impl Effort {
    /// Runs what the store in `dir` does not hold yet of a campaign, round after round; tells if not all was run.
    pub fn execute(&self, campaign: &Campaign, dir: &Path, quiet: bool) -> Result<Option<EarlyEnd>, Box<dyn Error>> {
        let (begin, mut effort) = (Instant::now(), *self);
        let mut round = this_round(campaign, dir)?;
        loop {
            if let Some(early) = effort.execute_round(&round, dir, quiet)? {
                return Ok(Some(early));
            }
            // A campaign that does not say until when to run has one round.
            let next @ Cow::Owned(_) = this_round(campaign, dir)? else { return Ok(None) };
            // Not a difference of rounds: where failed jobs were run again, fewer runs may be enough for one point and too few for another.
            let more = plan_now(&next, dir)?.jobs.len();
            if more == 0 {
                return Ok(None);
            }
            if !quiet {
                eprintln!("not every interval is as narrow as asked for: another round, of {more} runs");
            }
            let deadline = self.deadline.map(|deadline| deadline.saturating_sub(begin.elapsed()));
            (round, effort) = (next, Self { deadline, retry: None, ..*self });
        }
    }

    fn execute_round(&self, campaign: &Campaign, dir: &Path, quiet: bool) -> Result<Option<EarlyEnd>, Box<dyn Error>> {
        if self.retry.is_none() && nothing_to_do(campaign, dir)? {
            return Ok(None);
        }
        let begin = Instant::now();
        let interrupted = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // The second signal ends the process at once; only then is the flag set.
            signal_hook::flag::register_conditional_shutdown(signal, Exit::Interrupted as i32, interrupted.clone())?;
            signal_hook::flag::register(signal, interrupted.clone())?;
        }
        let mut store = Store::open(dir)?;
        let instruction_set = simd::best_instruction_set();
        if let Some(class) = self.retry {
            store.retry(match class {
                RetryClass::All => None,
                RetryClass::Only(class) => Some(class),
            })?;
        }
        let registered = register(&mut store, campaign)?;
        let plan = plan(campaign, &KnownJobs::new(job_states(dir)?), &machine_speed::measure(instruction_set));
        store.begin_run(&Provenance {
            program_version: env!("CARGO_PKG_VERSION"),
            git_commit: env!("MENISCUS_COMMIT"),
            rustc: env!("MENISCUS_RUSTC"),
            cpu_features: &format!("{instruction_set:?}"),
            campaign: registered,
        })?;
        let unfinished = store.folders().unfinished();
        let go_on = plan.jobs.iter().filter(|job| unfinished.contains(&job.id)).count();
        let mut display = Display::new(&plan, go_on, dir, self.threads, quiet);
        let deadline = self.deadline.map(|deadline| deadline.saturating_sub(begin.elapsed()));
        let Self { threads, checkpoint_every, .. } = *self;
        let options = Options { threads, instruction_set, deadline, checkpoint_every, interrupted: &interrupted };
        let report = executor::run(&plan.jobs, store, options, |progress, elapsed| display.update(progress, elapsed))?;
        display.finish(&report.progress);
        let Report { store, progress, stopped, paused } = report;
        // The lock goes with the store, before the fits take it again.
        drop(store);
        Ok(stopped.map(|reason| EarlyEnd { reason, progress, paused }))
    }
}

/// Worker threads: as asked, or one a core.
pub fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from)
}

/// The campaign with the seeds that its intervals ask for now; the campaign itself if it does not say until when to run, or if nothing
/// can be read yet.
pub fn this_round<'a>(campaign: &'a Campaign, dir: &Path) -> Result<Cow<'a, Campaign>, Box<dyn Error>> {
    if campaign.blocks.iter().all(|block| block.until.is_none()) {
        return Ok(Cow::Borrowed(campaign));
    }
    let Some(conn) = readable(dir)? else { return Ok(Cow::Borrowed(campaign)) };
    let results = Results::new(point_runs(&conn)?, job_states(dir)?);
    Ok(Cow::Owned(grown(campaign, &results)))
}

/// The store in `dir`, if there is one that can be read; an older one is migrated by the run.
fn readable(dir: &Path) -> Result<Option<Connection>, StoreError> {
    match open_reading(dir) {
        Err(StoreError::Older { .. }) => Ok(None),
        other => other,
    }
}

/// What the campaign still has to do, by what the store says now; no time is estimated.
fn plan_now(campaign: &Campaign, dir: &Path) -> Result<Plan, Box<dyn Error>> {
    Ok(plan(campaign, &KnownJobs::new(job_states(dir)?), &crate::campaign::plan::Speed::default()))
}

/// Whether every job of the campaign is done or has failed.
fn nothing_to_do(campaign: &Campaign, dir: &Path) -> Result<bool, Box<dyn Error>> {
    if readable(dir)?.is_none() {
        return Ok(false);
    }
    let plan = plan_now(campaign, dir)?;
    Ok(plan.jobs.is_empty() && plan.blocks.iter().all(|block| block.counts.running == 0))
}

fn register(store: &mut Store, campaign: &Campaign) -> Result<i64, Box<dyn Error>> {
    let points: Vec<_> = PlannedPoint::all(campaign).collect();
    let record = CampaignRecord { name: &campaign.name, text: &campaign.text };
    Ok(store.register(&record, &points)?.campaign)
}

/// A path as one types it.
pub(super) fn shown(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "-_./+,:@%=".contains(c);
    if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

fn parse_class(text: &str) -> Result<RetryClass, String> {
    if text == "all" {
        return Ok(RetryClass::All);
    }
    let class = FailureClass::from_name(text).map(RetryClass::Only);
    class.ok_or_else(|| format!("`{text}` is no class: unstable, engulfed, crossed, panicked, io, bad_input, or all"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_with_their_unit() {
        assert_eq!(parse_time("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(parse_time("1.5h"), Ok(Duration::from_secs(5400)));
        for wrong in ["", "8", "h", "-1h", "8 parsecs", "nan s"] {
            assert!(parse_time(wrong).is_err(), "{wrong}");
        }
    }
}

//! `meniscus run CAMPAIGN.toml`: plan, run, resume, and end with the tables.

use super::progress::Display;
use super::{Exit, Outcome, fit, print, store_of};
use meniscus::campaign::Campaign;
use meniscus::executor::schedule::StopReason;
use meniscus::executor::{self, Options};
use meniscus::plan::{KnownJobs, Plan, Retry, plan};
use meniscus::store::{CampaignRecord, PlannedPoint, Provenance, Store, job_states, open_reading};
use meniscus::trajectory::FailureClass;
use meniscus::{speed, vector};
use signal_hook::consts::{SIGINT, SIGTERM};
use std::collections::HashSet;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

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
    /// Stop after this time: 90s, 45m, 8h, 2d; trajectories under way begin anew next time
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    deadline: Option<Duration>,
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
        let campaign = Campaign::load(&self.campaign)?;
        let dir = store_of(self.store.as_deref(), &campaign.name);
        let stopped = self.effort().execute(&campaign, &dir, quiet)?;
        self.finish(&campaign, &dir, quiet, stopped)
    }

    fn effort(&self) -> Effort {
        Effort { threads: threads(self.threads), deadline: self.deadline, retry: self.retry }
    }

    /// Fits, prints the tables, and says how it ended.
    fn finish(&self, campaign: &Campaign, dir: &Path, quiet: bool, stopped: Option<StopReason>) -> Outcome {
        let mine: HashSet<_> = campaign.blocks.iter().flat_map(|block| block.point_ids.iter().copied()).collect();
        print(&fit::tables(dir, |id| mine.contains(&id))?)?;
        let again = format!("meniscus run {}", self.campaign.display());
        let plan = plan_now(campaign, dir)?;
        let failed: u64 = plan.blocks.iter().map(|block| block.counts.failed).sum();
        let done: u64 = plan.blocks.iter().map(|block| block.counts.done).sum();
        let say = |text: String| {
            if !quiet {
                eprintln!("{text}");
            }
        };
        match stopped {
            Some(StopReason::Interrupted) => {
                say(format!("interrupted; everything finished is saved. To go on: {again}"));
                return Ok(Exit::Interrupted);
            }
            Some(StopReason::Deadline) => {
                say(format!("the deadline came; everything finished is saved. To go on: {again}"));
                return Ok(Exit::Done);
            }
            Some(StopReason::Breaker { class, failures }) => {
                return Err(format!(
                    "stopped, for {failures} jobs, most of them, failed alike ({}).\n  look: meniscus query {} \"select job_id, error \
                     from runs where state = 'failed' limit 5\"\n  then: {again} --retry {}",
                    class.name(),
                    dir.display(),
                    class.name()
                )
                .into());
            }
            Some(StopReason::WriterStopped) => return Err("the store took no more outcomes".into()),
            None => {}
        }
        if failed > 0 {
            say(format!(
                "{done} jobs are done, {failed} failed; see them with: meniscus query {} \"select job_id, error_class, error \
                 from runs where state = 'failed'\"",
                dir.display()
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
    /// Failures to try again.
    pub retry: Option<RetryClass>,
}

impl Effort {
    /// Runs what the store in `dir` does not hold yet of a campaign; says why not all was run, if so.
    pub fn execute(&self, campaign: &Campaign, dir: &Path, quiet: bool) -> Result<Option<StopReason>, Box<dyn Error>> {
        if self.retry.is_none() && nothing_to_do(campaign, dir)? {
            return Ok(None);
        }
        let interrupted = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            // The second signal ends the process at once; only then is the flag set.
            signal_hook::flag::register_conditional_shutdown(signal, Exit::Interrupted as i32, interrupted.clone())?;
            signal_hook::flag::register(signal, interrupted.clone())?;
        }
        let mut store = Store::open(dir)?;
        let level = vector::best_level();
        if let Some(class) = self.retry {
            store.retry(match class {
                RetryClass::All => None,
                RetryClass::Only(class) => Some(class),
            })?;
        }
        let registered = register(&mut store, campaign)?;
        let plan = plan(campaign, &KnownJobs::new(job_states(dir)?), &Retry::Nothing, &speed::measure(level));
        store.begin_run(&Provenance {
            program_version: env!("CARGO_PKG_VERSION"),
            git_commit: env!("MENISCUS_COMMIT"),
            rustc: env!("MENISCUS_RUSTC"),
            cpu_features: &format!("{level:?}"),
            campaign: registered,
        })?;
        let mut display = Display::new(&plan, dir, self.threads, quiet);
        let options = Options { threads: self.threads, level, deadline: self.deadline, interrupted: &interrupted };
        let report = executor::run(&plan.jobs, store, options, |progress, elapsed| display.update(progress, elapsed))?;
        display.finish(&report.progress);
        // The lock goes with the store, before the fits take it again.
        drop(report.store);
        Ok(report.stopped)
    }
}

/// Worker threads: as asked, or one a core.
pub fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(|| std::thread::available_parallelism().map_or(1, usize::from), usize::from)
}

/// What the campaign still has to do, by what the store says now; no time is estimated.
fn plan_now(campaign: &Campaign, dir: &Path) -> Result<Plan, Box<dyn Error>> {
    Ok(plan(campaign, &KnownJobs::new(job_states(dir)?), &Retry::Nothing, &meniscus::plan::Speed::default()))
}

/// Whether every job of the campaign is done or has failed.
fn nothing_to_do(campaign: &Campaign, dir: &Path) -> Result<bool, Box<dyn Error>> {
    if open_reading(dir)?.is_none() {
        return Ok(false);
    }
    let plan = plan_now(campaign, dir)?;
    Ok(plan.jobs.is_empty() && plan.blocks.iter().all(|block| block.counts.running == 0))
}

fn register(store: &mut Store, campaign: &Campaign) -> Result<i64, Box<dyn Error>> {
    let points: Vec<_> = campaign
        .blocks
        .iter()
        .flat_map(|block| block.points.iter().zip(&block.point_ids).map(|(point, &id)| (point, id, &block.seeds)))
        .map(|(point, point_id, seeds)| PlannedPoint { point, point_id, seeds: seeds.clone() })
        .collect();
    let record = CampaignRecord { name: &campaign.name, text: &campaign.text };
    Ok(store.register(&record, &points)?.campaign)
}

/// `90s`, `45m`, `8h`, `2d`.
pub fn parse_time(text: &str) -> Result<Duration, String> {
    let wrong = || format!("`{text}` is no time: write a number and s, m, h or d, like 8h");
    let unit = match text.chars().last() {
        Some('s') => 1.0,
        Some('m') => 60.0,
        Some('h') => 3600.0,
        Some('d') => 86400.0,
        _ => return Err(wrong()),
    };
    let number: f64 = text[..text.len() - 1].parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(number * unit).map_err(|_| wrong())
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

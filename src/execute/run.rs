//! A campaign from what its store holds to its end, round after round.

use crate::campaign::file::Campaign;
use crate::campaign::plan::{self, Counts, KnownJobs, Plan, Speed};
use crate::execute::executor::{self, RoundReport, RunError};
use crate::execute::keeping::Keeping;
use crate::execute::machine_speed;
use crate::execute::options::{Options, Retry};
use crate::execute::rounds::{Evidence, grown};
use crate::execute::schedule::{Paused, Progress, StopReason};
use crate::physics::simd::{InstructionSet, best_instruction_set};
use crate::store::{
    CampaignRecord, PlannedPoint, Provenance, Store, StoreError, Twin, holds_campaign, job_states, open_reading,
    point_runs, twins,
};
use rusqlite::Connection;
use std::borrow::Cow;
use std::path::Path;
use std::time::Duration;

/// What the caller is told while a run goes on.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A round begins.
    RoundBegins {
        /// Rounds before it; a campaign without `until` has one round.
        rounds_before: usize,
        /// The name of the campaign.
        campaign: &'a str,
        /// Jobs to run.
        jobs: usize,
        /// Those of them that go on from a checkpoint, or from where a job with a smaller limit ended.
        resumed: usize,
        /// Worker threads.
        threads: usize,
    },
    /// Where the round stands, so long after it began; told about ten times a second.
    Progress(&'a Progress, Duration),
    /// The round is over, everything is committed.
    RoundEnds(&'a Progress, Duration),
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RunReport {
    /// Every job of the campaign has a result or has failed.
    Complete {
        /// Jobs with a result, of this run and of earlier ones.
        done: u64,
        /// Jobs that failed.
        failed: u64,
    },
    /// The run stopped before that; another call of [`run`] goes on.
    Stopped(Stopped),
}

/// A run that stopped before its campaign was complete.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stopped {
    /// Why.
    pub reason: StopReason,
    /// Jobs that this run brought to an end.
    pub ended: u64,
    /// Jobs that were under way.
    pub paused: Paused,
}

impl RunReport {
    /// The report where nothing is left to do; `None` where something is, or where a dead process left jobs `running`.
    fn complete(plan: &Plan) -> Option<Self> {
        let sum = |count: fn(&Counts) -> u64| -> u64 { plan.blocks.iter().map(|block| count(&block.counts)).sum() };
        let complete = plan.jobs.is_empty() && sum(|counts| counts.running) == 0;
        complete.then(|| Self::Complete { done: sum(|counts| counts.done), failed: sum(|counts| counts.failed) })
    }
}

/// Runs what the store in `dir` does not hold yet of a campaign, round after round, and tells `watch` how it goes.
///
/// The store is created if there is none. If nothing is left to do it is not opened for writing, but for the text of a
/// campaign that it does not hold yet.
///
/// # Errors
/// [`RunError`]; what was committed stays.
pub fn run(
    campaign: &Campaign,
    dir: &Path,
    options: &Options,
    mut watch: impl FnMut(Event<'_>),
) -> Result<RunReport, RunError> {
    let (mut rounds, mut ended, mut retry) = (0, 0, options.retry);
    warn_of_twins(campaign, dir)?;
    loop {
        let round = current_round(campaign, dir)?;
        // Where the store is missing, or is to be migrated first, there is something to do.
        if retry == Retry::Nothing && readable(dir)?.is_some() {
            // No time is estimated.
            if let Some(report) = RunReport::complete(&planned(&round, dir, &Speed::default())?) {
                note_claim(&round, dir)?;
                return Ok(report);
            }
        }
        let report = run_round(&round, dir, options, retry, rounds, &mut watch)?;
        ended += report.progress.ended;
        if let Some(reason) = report.stopped {
            return Ok(RunReport::Stopped(Stopped { reason, ended, paused: report.paused }));
        }
        (rounds, retry) = (rounds + 1, Retry::Nothing);
    }
}

/// Notes in the store that this campaign too plans jobs that are all there: another campaign that is forgotten must not
/// take them along. A store that cannot be written stays as it is.
fn note_claim(campaign: &Campaign, dir: &Path) -> Result<(), StoreError> {
    if holds_campaign(dir, &campaign.name, &campaign.text)? {
        return Ok(());
    }
    let record = CampaignRecord { name: &campaign.name, text: &campaign.text };
    let points: Vec<_> = PlannedPoint::all(campaign).collect();
    if let Err(error) = Store::open(dir).and_then(|mut store| store.register(&record, &points)) {
        tracing::warn!("the store does not learn of the campaign {}, whose jobs are all there: {error}", campaign.name);
    }
    Ok(())
}

/// What [`run`] would do now, with the time that it would take on this machine; writes nothing.
///
/// # Errors
/// What reading the store reports.
pub fn plan(campaign: &Campaign, dir: &Path) -> Result<Plan, StoreError> {
    warn_of_twins(campaign, dir)?;
    let round = current_round(campaign, dir)?;
    planned(&round, dir, &machine_speed::measure(best_instruction_set()))
}

/// Warns of numbers that were probably meant to be those that the store holds.
fn warn_of_twins(campaign: &Campaign, dir: &Path) -> Result<(), StoreError> {
    let found = match twins(dir, campaign) {
        Err(StoreError::Older { .. }) => Vec::new(),
        found => found?,
    };
    for Twin { name, new, old } in found {
        tracing::warn!(
            "{name} = {new} is nearly, but not, {old}, which is there already: the two are kept as two points"
        );
    }
    Ok(())
}

/// Opens the store for one round; it is closed, and its lock released, when the round is over.
fn run_round(
    campaign: &Campaign,
    dir: &Path,
    options: &Options,
    retry: Retry,
    rounds_before: usize,
    watch: &mut dyn FnMut(Event<'_>),
) -> Result<RoundReport, RunError> {
    let mut store = Store::open(dir)?;
    match retry {
        Retry::Nothing => 0,
        Retry::Only(class) => store.retry(Some(class))?,
        Retry::All => store.retry(None)?,
    };
    let instruction_set = best_instruction_set();
    let points: Vec<_> = PlannedPoint::all(campaign).collect();
    let registered = store.register(&CampaignRecord { name: &campaign.name, text: &campaign.text }, &points)?;
    let Plan { jobs, .. } = planned(campaign, dir, &machine_speed::measure(instruction_set))?;
    begin_run(&mut store, registered.campaign, instruction_set)?;
    let keeping = Keeping::new(&store, options.checkpoint_every)?;
    watch(Event::RoundBegins {
        rounds_before,
        campaign: &campaign.name,
        jobs: jobs.len(),
        resumed: keeping.resumed(&jobs),
        threads: options.workers(jobs.len()),
    });
    let mut tell = |progress: &Progress, elapsed| watch(Event::Progress(progress, elapsed));
    let report = executor::run(&jobs, store, &keeping, options, instruction_set, &mut tell)?;
    watch(Event::RoundEnds(&report.progress, report.elapsed));
    Ok(report)
}

/// Records which program runs on which processor.
fn begin_run(store: &mut Store, campaign: i64, instruction_set: InstructionSet) -> Result<(), StoreError> {
    store.begin_run(&Provenance {
        program_version: env!("CARGO_PKG_VERSION"),
        git_commit: env!("MENISCUS_COMMIT"),
        rustc: env!("MENISCUS_RUSTC"),
        cpu_features: &format!("{instruction_set:?}"),
        campaign,
    })?;
    Ok(())
}

/// What a round still has to do by what the store says now.
fn planned(round: &Campaign, dir: &Path, speed: &Speed) -> Result<Plan, StoreError> {
    Ok(plan::plan(round, &KnownJobs::new(job_states(dir)?), speed))
}

/// The campaign with the seeds that its intervals ask for now; the campaign itself if no block says `until`, or if
/// there is no store that can be read.
fn current_round<'a>(campaign: &'a Campaign, dir: &Path) -> Result<Cow<'a, Campaign>, StoreError> {
    if campaign.blocks.iter().all(|block| block.until.is_none()) {
        return Ok(Cow::Borrowed(campaign));
    }
    let Some(conn) = readable(dir)? else { return Ok(Cow::Borrowed(campaign)) };
    Ok(Cow::Owned(grown(campaign, &Evidence::new(point_runs(&conn)?, job_states(dir)?))))
}

/// The store in `dir`, if there is one of the present schema.
fn readable(dir: &Path) -> Result<Option<Connection>, StoreError> {
    match open_reading(dir) {
        Err(StoreError::Older { .. }) => Ok(None),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::Ordering;

    const CAMPAIGN: &str = r#"
        name = "two"
        model = "SP"
        scene = "obstacles"
        w_ob = 0.2
        sigma_ob = 0.3
        density = 0.7
        box_size = 20.0
        e_w = 1.0
        runs_per_point = 2
        limits.t_max = 20.0
    "#;

    #[test]
    fn a_caller_stops_a_run_and_the_next_one_completes_it_on_as_many_threads_as_jobs() {
        let campaign = Campaign::parse("two.toml", CAMPAIGN).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let options = Options { threads: 64, ..Options::default() };
        options.interrupted.store(true, Ordering::Relaxed);
        let report = run(&campaign, folder.path(), &options, |_| ()).unwrap();
        assert!(matches!(report, RunReport::Stopped(Stopped { reason: StopReason::Interrupted, .. })), "{report:?}");

        options.interrupted.store(false, Ordering::Relaxed);
        let mut begun = Vec::new();
        let watch = |event: Event<'_>| {
            if let Event::RoundBegins { rounds_before, jobs, threads, .. } = event {
                begun.push((rounds_before, jobs == threads));
            }
        };
        let complete = RunReport::Complete { done: 2, failed: 0 };
        assert_eq!(run(&campaign, folder.path(), &options, watch).unwrap(), complete);
        assert!(begun.iter().all(|&round| round == (0, true)), "{begun:?}");
        let nothing = |event: Event<'_>| panic!("nothing is left to do: {event:?}");
        assert_eq!(run(&campaign, folder.path(), &options, nothing).unwrap(), complete);
    }
}

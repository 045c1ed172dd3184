//! Keeps unfinished trajectories and dumps of failures in the folders of a store.
//!
//! A trajectory is saved by wall time, and never so often that saving takes more than a hundredth of it. If saving or
//! loading fails, a warning says so and the job goes on: nothing is lost but the time to compute it anew.

use crate::campaign::plan::PlannedJob;
use crate::execute::saved::{Saved, SavedFailure, decode_end, encode_end};
use crate::parameters::{Job, JobId};
use crate::physics::simulate::{EndState, Keeper, Snapshot, last_step};
use crate::results::trajectory::Failure;
use crate::store::checkpoint_file::{self, CheckpointError};
use crate::store::{self, Folders, FoundEnd, Store, StoreError, ended_courses};
use std::collections::HashSet;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The next snapshot waits at least this many times as long as the last one took to save.
const SHARE: u32 = 100;

/// The checkpoints and dumps of one run.
#[derive(Debug)]
pub(super) struct Keeping {
    dir: PathBuf,
    folders: Folders,
    every: Duration,
    /// Jobs that had a checkpoint when the run began.
    waiting: HashSet<JobId>,
    /// The courses of which the store had an end state when the run began.
    ended: HashSet<JobId>,
}

impl Keeping {
    /// Saves in the folders of a store, at least so long apart.
    ///
    /// # Errors
    /// What SQLite reports.
    pub(super) fn new(store: &Store, every: Duration) -> Result<Self, StoreError> {
        let (dir, folders) = (store.dir().to_owned(), store.folders());
        Ok(Self { waiting: folders.unfinished(), ended: ended_courses(store.connection())?, dir, folders, every })
    }

    /// How many of these jobs go on from a checkpoint, or may go on from where a job with other limits ended.
    pub(super) fn resumed(&self, jobs: &[PlannedJob]) -> usize {
        let goes_on = |job: &&PlannedJob| self.waiting.contains(&job.id) || self.has_ended(job);
        jobs.iter().filter(goes_on).count()
    }

    /// Whether a job of the same course has ended.
    fn has_ended(&self, planned: &PlannedJob) -> bool {
        !self.ended.is_empty() && self.ended.contains(&planned.job.course())
    }

    /// Where a job of the same course with a smaller time limit or distance ended.
    pub(super) fn end_of_shorter(&self, planned: &PlannedJob) -> Option<Saved> {
        if !self.has_ended(planned) {
            return None;
        }
        let (job, limits) = (&planned.job, &planned.job.point.limits);
        let found = store::end_state(&self.dir, job.course(), last_step(&job.point), limits.distance);
        let FoundEnd { state, wall_s, samples, outlines } = match found {
            Ok(found) => found?,
            Err(error) => {
                tracing::warn!(%error, job = %planned.id, "an end state cannot be read, the job begins anew");
                return None;
            }
        };
        let snapshot = decode_end(&state)?.snapshot(samples, outlines)?;
        Some(Saved::new(job, wall_s, Some(snapshot)))
    }

    /// Where the job was when it was last saved. A file that is of no use is put aside with a warning.
    pub(super) fn load(&self, planned: &PlannedJob) -> Option<Saved> {
        if !self.waiting.contains(&planned.id) {
            return None;
        }
        let path = checkpoint_file::path_of(&self.folders.checkpoints(), planned.id);
        match checkpoint_file::read(&path) {
            Ok(payload) => {
                let saved = Saved::decode(&payload.state).filter(|_| payload.job == planned.id);
                if saved.is_none() {
                    self.put_aside(planned.id, "its content is not a state of this job");
                }
                saved
            }
            Err(CheckpointError::Missing(_)) => None,
            Err(error @ CheckpointError::Io { .. }) => {
                tracing::warn!(%error, job = %planned.id, "a checkpoint cannot be read, the job begins anew");
                None
            }
            Err(error) => {
                self.put_aside(planned.id, &error.to_string());
                None
            }
        }
    }

    /// Moves the job's checkpoint out of the way.
    pub(super) fn put_aside(&self, job: JobId, problem: &str) {
        let path = checkpoint_file::path_of(&self.folders.checkpoints(), job);
        match self.folders.quarantine(&path) {
            Ok(to) => {
                tracing::warn!(%job, problem, kept = %to.display(), "a checkpoint is of no use, the job begins anew");
            }
            Err(error) => {
                tracing::warn!(%job, problem, %error, "a checkpoint is of no use and stays where it is, the job begins anew");
            }
        }
    }

    /// Saves a job.
    fn save(&self, id: JobId, saved: &Saved) -> Result<(), StoreError> {
        checkpoint_file::write(&self.folders.checkpoints(), id, &saved.encode()).map(drop)
    }

    /// Writes the file from which `meniscus replay` shows a failure again: where the job was last saved, or its
    /// beginning.
    pub(super) fn dump(&self, planned: &PlannedJob, failure: &Failure, wall_s: f64) {
        let checkpoint = checkpoint_file::path_of(&self.folders.checkpoints(), planned.id);
        let last = checkpoint_file::read(&checkpoint).ok().and_then(|payload| Saved::decode(&payload.state));
        let mut dump = last.unwrap_or_else(|| Saved::new(&planned.job, wall_s, None));
        dump.failure = Some(SavedFailure::from(failure));
        if let Err(error) = checkpoint_file::write(&self.folders.dumps(), planned.id, &dump.encode()) {
            tracing::warn!(%error, job = %planned.id, "a failed job leaves no dump; its class and reason are kept");
        }
    }

    /// Keeps snapshots of a job on which `spent` seconds were spent before `begin`.
    pub(super) fn keeper<'a>(&'a self, planned: &'a PlannedJob, spent: f64, begin: Instant) -> JobKeeper<'a> {
        let due = begin + self.every;
        JobKeeper { keeping: self, id: planned.id, job: &planned.job, spent, begin, due, end: None }
    }
}

/// Saves one job now and then.
pub(super) struct JobKeeper<'a> {
    keeping: &'a Keeping,
    id: JobId,
    job: &'a Job,
    spent: f64,
    begin: Instant,
    due: Instant,
    end: Option<EndState>,
}

impl JobKeeper<'_> {
    /// Wall time spent on the job so far, in seconds.
    pub(super) fn wall_s(&self) -> f64 {
        self.spent + self.begin.elapsed().as_secs_f64()
    }

    /// The end state, for the store, once the job has come to its end.
    pub(super) fn take_end(&mut self) -> Option<store::EndState> {
        let end = self.end.take()?;
        let (step, distance) = (end.step(), self.job.point.limits.distance);
        Some(store::EndState { course: self.job.course(), step, distance, state: encode_end(&end) })
    }

    /// Saves the snapshot with which a job that was told to stop goes on; false, with a warning, if that fails.
    pub(super) fn save_last(&self, snapshot: Snapshot) -> bool {
        let saved = self.save(snapshot);
        if let Err(error) = &saved {
            tracing::warn!(%error, job = %self.id, "this job could not be saved, it goes on from where it last was");
        }
        saved.is_ok()
    }

    fn save(&self, snapshot: Snapshot) -> Result<(), StoreError> {
        self.keeping.save(self.id, &Saved::new(self.job, self.wall_s(), Some(snapshot)))
    }
}

impl Keeper for JobKeeper<'_> {
    fn wants(&mut self) -> bool {
        Instant::now() >= self.due
    }

    fn keep(&mut self, snapshot: Snapshot) {
        let begin = Instant::now();
        if let Err(error) = self.save(snapshot) {
            tracing::warn!(%error, job = %self.id, "a checkpoint could not be written, the job goes on without");
        }
        let took = begin.elapsed();
        tracing::debug!(job = %self.id, ?took, "saved");
        self.due = Instant::now() + self.keeping.every.max(SHARE * took);
    }

    fn wants_end(&self) -> bool {
        true
    }

    fn keep_end(&mut self, end: EndState) {
        self.end = Some(end);
    }
}

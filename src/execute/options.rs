//! What a caller may ask of a run.

use crate::results::trajectory::FailureClass;
use crate::store::Deadline;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// How to run a campaign.
///
/// ```
/// use meniscus::execute::{Deadline, Options};
/// use std::time::Duration;
///
/// let until_morning = Deadline::after(Duration::from_secs(14 * 3600));
/// let options = Options { threads: 4, deadline: Some(until_morning), ..Options::default() };
/// assert_eq!(options.checkpoint_every, Duration::from_secs(60));
/// ```
#[derive(Clone, Debug)]
pub struct Options {
    /// The most worker threads; there are never more of them than jobs.
    pub threads: usize,
    /// When jobs under way are saved and no other is started.
    pub deadline: Option<Deadline>,
    /// Time between two checkpoints of a job.
    pub checkpoint_every: Duration,
    /// Which failed jobs are run again, in the first round.
    pub retry: Retry,
    /// Ends the run once it is true: jobs under way are saved and no other is started.
    pub interrupted: Arc<AtomicBool>,
}

impl Default for Options {
    /// One thread per core, no deadline, a checkpoint every minute, no failed job run again.
    fn default() -> Self {
        Self {
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            deadline: None,
            checkpoint_every: Duration::from_secs(60),
            retry: Retry::Nothing,
            interrupted: Arc::default(),
        }
    }
}

impl Options {
    /// Worker threads for so many jobs.
    pub(super) fn workers(&self, jobs: usize) -> usize {
        self.threads.max(1).min(jobs)
    }
}

/// Which failed jobs to run again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Retry {
    /// None of them.
    #[default]
    Nothing,
    /// Those that failed in this way.
    Only(FailureClass),
    /// All of them.
    All,
}

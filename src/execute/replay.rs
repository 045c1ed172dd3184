//! Runs a dump again, from where the job was last saved, to see whether it fails as it did.

use crate::campaign::checks;
use crate::execute::attempt::{Attempt, attempt};
use crate::execute::saved::{Saved, SavedFailure};
use crate::parameters::{Job, JobId, plain, shown};
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::{Context, NoKeeper};
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::results::trajectory::Outcome;
use crate::store::checkpoint_file::{self, CheckpointError};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// What a dump holds.
#[derive(Debug)]
pub(crate) struct Dump {
    /// The job.
    pub(crate) job: Job,
    /// Its identity.
    pub(crate) id: JobId,
    saved: Saved,
}

/// Why a file cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReplayError {
    /// The file is missing, damaged, or of another kind.
    #[error(transparent)]
    File(#[from] CheckpointError),
    /// The file is sound but holds something else.
    #[error("{0} holds no job that this version can run: name a dump, as in the column dump of the view `failures`")]
    NoJob(String),
    /// The job is one that no campaign file can ask for.
    #[error("{0} holds a job that no campaign can ask for ({1}); ask whoever made it")]
    BadPoint(String, String),
}

impl Dump {
    /// Reads a dump, or a checkpoint.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub(crate) fn read(path: &Path) -> Result<Self, ReplayError> {
        // A link that somebody names is followed; a link in a store is not.
        let path = &std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let payload = checkpoint_file::read(path)?;
        let no_job = || ReplayError::NoJob(shown(path));
        let saved = Saved::decode(&payload.state).ok_or_else(no_job)?;
        let job = saved.job().filter(|job| job.id() == payload.job).ok_or_else(no_job)?;
        checks::validate(&job.point)
            .map_err(|problem| ReplayError::BadPoint(shown(path), plain(&problem).into_owned()))?;
        Ok(Self { job, id: payload.job, saved })
    }

    /// The failure that was recorded; `None` in a checkpoint.
    pub(crate) fn failure(&self) -> Option<&SavedFailure> {
        self.saved.failure.as_ref()
    }

    /// The time step from which it goes on.
    pub(crate) fn first_step(&self) -> u64 {
        self.saved.snapshot.as_ref().map_or(0, |snapshot| snapshot.step())
    }

    /// Runs the job to its end, and returns its outcome or its failure.
    ///
    /// # Errors
    /// [`ReplayError::NoJob`] if the state is not one of the job.
    pub(crate) fn run(&self, instruction_set: InstructionSet) -> Result<Result<Outcome, SavedFailure>, ReplayError> {
        let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
        let context = Context { arrays: &arrays, instruction_set, stop: &stop };
        match attempt(&self.job, context, self.saved.snapshot.as_ref(), &mut NoKeeper) {
            Attempt::Arrived(trajectory) => Ok(Ok(trajectory.outcome)),
            Attempt::Failed(failure) => Ok(Err(SavedFailure::from(&failure))),
            Attempt::Stopped(_) | Attempt::WrongSnapshot => Err(ReplayError::NoJob(format!("the dump of {}", self.id))),
        }
    }
}

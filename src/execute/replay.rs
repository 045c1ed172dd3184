//! Runs a dump again, from where the job was last saved: does it fail as it did?

use crate::execute::executor::panicked;
use crate::execute::saved::{Saved, SavedFailure};
use crate::parameters::{Job, JobId};
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::{Context, NoKeeper, RunEnded, go_on};
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::results::trajectory::Outcome;
use crate::store::checkpoint_file::{self, CheckpointError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// What a dump holds.
#[derive(Debug)]
pub struct Dump {
    /// The job.
    pub job: Job,
    /// Its identity.
    pub id: JobId,
    saved: Saved,
}

/// Why there is nothing to run.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The file is of no use.
    #[error(transparent)]
    File(#[from] CheckpointError),
    /// It is a sound file of something else.
    #[error("{0} holds no job that this program can run")]
    NoJob(String),
}

impl Dump {
    /// Reads a dump, or a checkpoint.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub fn read(path: &Path) -> Result<Self, ReplayError> {
        let payload = checkpoint_file::read(path)?;
        let no_job = || ReplayError::NoJob(path.display().to_string());
        let saved = Saved::decode(&payload.state).ok_or_else(no_job)?;
        let job = saved.job().filter(|job| job.id() == payload.job).ok_or_else(no_job)?;
        Ok(Self { job, id: payload.job, saved })
    }

    /// The failure that was recorded; none in a checkpoint.
    pub fn failure(&self) -> Option<&SavedFailure> {
        self.saved.failure.as_ref()
    }

    /// The time step from which on it is run.
    pub fn from_step(&self) -> u64 {
        self.saved.snapshot.as_ref().map_or(0, |snapshot| snapshot.step())
    }

    /// Runs it to its end, whatever that is.
    ///
    /// # Errors
    /// [`ReplayError::NoJob`] if the state is not one of the job.
    pub fn run(&self, instruction_set: InstructionSet) -> Result<Result<Outcome, SavedFailure>, ReplayError> {
        let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
        let context = Context { arrays: &arrays, instruction_set, stop: &stop };
        let from = self.saved.snapshot.as_ref();
        let ended = catch_unwind(AssertUnwindSafe(|| go_on(&self.job, context, from, &mut NoKeeper)))
            .unwrap_or_else(|panic| Err(panicked(panic.as_ref())));
        match ended {
            Ok(RunEnded::Finished(trajectory)) => Ok(Ok(trajectory.outcome)),
            Ok(RunEnded::Stopped(_) | RunEnded::WrongSnapshot) => {
                Err(ReplayError::NoJob(format!("the dump of {}", self.id)))
            }
            Err(failure) => Ok(Err(SavedFailure::from(&failure))),
        }
    }
}

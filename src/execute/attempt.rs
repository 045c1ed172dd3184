//! One attempt at a job, and the four ways in which it ends.

use crate::parameters::Job;
use crate::physics::simulate::{Context, Keeper, RunEnded, Snapshot, go_on};
use crate::results::trajectory::{Failure, FailureClass, Trajectory};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How an attempt ended.
pub(super) enum Attempt {
    /// The trajectory came to its end.
    Arrived(Box<Trajectory>),
    /// The job failed; a panic is a failure too.
    Failed(Failure),
    /// It was told to stop. It can go on from this snapshot, or from where it began if there is none.
    Stopped(Option<Box<Snapshot>>),
    /// The snapshot belongs to another job; nothing was computed.
    WrongSnapshot,
}

/// Computes a job from a snapshot on, or from its beginning.
pub(super) fn attempt(job: &Job, context: Context<'_>, from: Option<&Snapshot>, keeper: &mut dyn Keeper) -> Attempt {
    match catch_unwind(AssertUnwindSafe(|| go_on(job, context, from, keeper))) {
        Ok(Ok(RunEnded::Finished(trajectory))) => Attempt::Arrived(trajectory),
        Ok(Ok(RunEnded::Stopped(snapshot))) => Attempt::Stopped(snapshot),
        Ok(Ok(RunEnded::WrongSnapshot)) => Attempt::WrongSnapshot,
        Ok(Err(failure)) => Attempt::Failed(failure),
        Err(panic) => Attempt::Failed(failure_of(panic.as_ref())),
    }
}

/// The failure that a panic stands for.
fn failure_of(panic: &(dyn Any + Send)) -> Failure {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let reason = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned());
    Failure { class: FailureClass::Panicked, reason, step: 0, outline: None }
}

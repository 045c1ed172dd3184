//! What a worker thread does: it takes jobs from the list, one after another, and hands their outcomes to the writer.

use crate::campaign::plan::PlannedJob;
use crate::execute::attempt::{Attempt, attempt};
use crate::execute::keeping::Keeping;
use crate::execute::schedule::JobEnd;
use crate::physics::simulate::Context;
use crate::results::trajectory::{Failure, Trajectory};
use crate::store::{EndState, Message, OutcomeSender, WriterStopped};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::Sender;
use std::time::Instant;

/// What the workers of a round share.
pub(super) struct Work<'a> {
    /// The jobs, in the order in which they are taken.
    pub(super) jobs: &'a [PlannedJob],
    /// The place of the next one.
    pub(super) next: AtomicUsize,
    /// Obstacle arrays, instruction set, and the flag that stops the round.
    pub(super) context: Context<'a>,
    /// Checkpoints and dumps.
    pub(super) keeping: &'a Keeping,
}

/// What a worker tells the watching thread.
pub(super) enum Note {
    /// A job ended.
    Ended(JobEnd),
    /// A job was told to stop; if it was not saved, it goes on from an earlier checkpoint or from its beginning.
    Paused { saved: bool },
    /// The writer takes no more outcomes.
    WriterStopped,
}

/// What became of a job.
enum Computed {
    Ended(Result<Box<Trajectory>, Failure>, Option<EndState>),
    Paused { saved: bool },
}

impl Work<'_> {
    /// Takes jobs until none is left, the round is told to stop, or nobody takes outcomes any more.
    pub(super) fn take_jobs(&self, writer: &OutcomeSender, told: &Sender<Note>) {
        while !self.context.stop.load(Ordering::Relaxed) {
            let Some(planned) = self.jobs.get(self.next.fetch_add(1, Ordering::Relaxed)) else { return };
            let note = self.run_one(planned, writer).unwrap_or(Note::WriterStopped);
            let goes_on = matches!(note, Note::Ended(_));
            if told.send(note).is_err() || !goes_on {
                return;
            }
        }
    }

    /// Runs one job and hands its outcome over.
    fn run_one(&self, planned: &PlannedJob, writer: &OutcomeSender) -> Result<Note, WriterStopped> {
        let job = planned.id;
        writer.send(Message::Started(job))?;
        let (computed, wall_s) = self.compute(planned);
        self.context.arrays.release(&planned.job);
        let (result, end) = match computed {
            Computed::Ended(result, end) => (result.map(|trajectory| *trajectory), end),
            Computed::Paused { saved } => return Ok(Note::Paused { saved }),
        };
        let how = result.as_ref().map(|run| run.outcome).map_err(|failure| failure.class);
        let creeps = result.as_ref().is_ok_and(Trajectory::creeps);
        if let Some(end) = end {
            writer.send(Message::Ended(job, end))?;
        }
        writer.send(Message::Finished { job, result, wall_s })?;
        Ok(Note::Ended(JobEnd { how, expected_s: planned.expected_s, creeps }))
    }

    /// Computes a job from its checkpoint, from where a shorter job ended, or from its beginning, and measures the wall
    /// time spent on it so far. Leaves a checkpoint if it is told to stop, and a dump if the job fails.
    fn compute(&self, planned: &PlannedJob) -> (Computed, f64) {
        let checkpoint = self.keeping.load(planned);
        let mut is_checkpoint = checkpoint.is_some();
        let mut last = checkpoint.or_else(|| self.keeping.end_of_shorter(planned));
        loop {
            let spent = last.as_ref().map_or(0.0, |saved| saved.wall_s);
            let from = last.as_ref().and_then(|saved| saved.snapshot.as_ref());
            let mut keeper = self.keeping.keeper(planned, spent, Instant::now());
            let attempt = attempt(&planned.job, self.context, from, &mut keeper);
            let wall_s = keeper.wall_s();
            let computed = match attempt {
                Attempt::Arrived(trajectory) => Computed::Ended(Ok(trajectory), keeper.take_end()),
                Attempt::Failed(failure) => {
                    self.keeping.dump(planned, &failure, wall_s);
                    Computed::Ended(Err(failure), None)
                }
                Attempt::Stopped(None) => Computed::Paused { saved: false },
                Attempt::Stopped(Some(snapshot)) => Computed::Paused { saved: keeper.save_last(*snapshot) },
                Attempt::WrongSnapshot => {
                    if std::mem::take(&mut is_checkpoint) {
                        self.keeping.put_aside(planned.id, "its state is not one of this job");
                    } else {
                        tracing::warn!(job = %planned.id, "an end state is not one of this job, which begins anew");
                    }
                    last = None;
                    continue;
                }
            };
            return (computed, wall_s);
        }
    }
}

//! Runs the jobs of a plan on all cores and hands every outcome to the store's writer.
//!
//! Workers of a rayon pool take jobs from one list, longest expected first, so that no straggler is left to the end.
//! A thread that computes nothing watches: signals, deadline, the breaker, progress. What is decided stands in
//! [`schedule`]; here it is acted on.

use crate::campaign::plan::PlannedJob;
use crate::execute::keeping::Keeping;
use crate::execute::schedule::{Ended, Progress, StopReason};
use crate::parameters::JobId;
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::{Context, RunEnded, go_on};
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::results::trajectory::{Failure, FailureClass, Trajectory};
use crate::store::{Hurry, Message, OutcomeSender, Store, StoreError, Writer, WriterOptions};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// How often the watching thread looks up.
const TICK: Duration = Duration::from_millis(100);

/// How to run.
#[derive(Clone, Copy, Debug)]
pub struct Options<'a> {
    /// Worker threads.
    pub threads: usize,
    /// Instruction set.
    pub instruction_set: InstructionSet,
    /// Time after which jobs under way are saved and no other is taken up.
    pub deadline: Option<Duration>,
    /// Time between two checkpoints of a job.
    pub checkpoint_every: Duration,
    /// Set by a signal.
    pub interrupted: &'a Arc<AtomicBool>,
}

/// How a run ended.
#[derive(Debug)]
pub struct Report {
    /// The store, everything committed.
    pub store: Store,
    /// What was done.
    pub progress: Progress,
    /// Why not all was done, if so.
    pub stopped: Option<StopReason>,
    /// Jobs under way at the end.
    pub paused: Paused,
}

/// Jobs that were under way when a run was told to stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paused {
    /// Those that go on where they were.
    pub saved: u64,
    /// Those that go on from their last checkpoint or begin anew: they had not begun to move, or could not be saved.
    pub unsaved: u64,
}

/// Why a run could not go on.
#[derive(Debug, thiserror::Error)]
pub enum ExecutorError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// No worker threads.
    #[error("cannot start {threads} worker threads: {source}; try --threads 1")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Runs all `jobs`, in their order, and calls `watch` now and then with the progress and the time since the start.
///
/// One bad job never stops the others: a failure or a panic is a row. Returns early, with everything finished so far
/// committed, when [`Progress::stop`] says so.
///
/// # Errors
/// [`ExecutorError`]; what was committed stays.
pub fn run(
    jobs: &[PlannedJob],
    store: Store,
    options: Options<'_>,
    mut watch: impl FnMut(&Progress, Duration),
) -> Result<Report, ExecutorError> {
    let threads = options.threads.max(1);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|k| format!("worker-{k}"))
        .build()
        .map_err(|source| ExecutorError::Threads { threads, source })?;
    let arrays = ArrayLibrary::default();
    jobs.iter().for_each(|planned| arrays.announce(&planned.job));
    let keeping = Keeping::new(store.folders(), options.checkpoint_every);
    let begin = Instant::now();
    let deadline = options.deadline.and_then(|deadline| begin.checked_add(deadline));
    let hurry = Hurry { interrupted: options.interrupted.clone(), deadline };
    let writer = Writer::spawn(store, WriterOptions { hurry, ..WriterOptions::default() })?;
    let (stop, next) = (AtomicBool::new(false), AtomicUsize::new(0));
    let (told, heard) = channel();
    let mut progress = Progress::of(jobs.len() as u64, jobs.iter().map(|job| job.expected_s).sum());
    let (stopped, paused) = std::thread::scope(|threads_of_run| {
        threads_of_run.spawn(|| {
            let context = Context { arrays: &arrays, instruction_set: options.instruction_set, stop: &stop };
            let worker = Worker { jobs, next: &next, context, keeping: &keeping };
            pool.broadcast(|_| worker.work(&writer.sender(), &told.clone()));
            // The last sender: the watching thread ends with it.
            drop(told);
        });
        watch_over(&heard, &stop, &options, begin, &mut progress, &mut watch)
    });
    watch(&progress, begin.elapsed());
    let store = writer.finish()?;
    Ok(Report { store, progress, stopped, paused })
}

/// What the watching thread hears.
enum Note {
    Ended(Ended),
    Paused { saved: bool },
    WriterStopped,
}

/// Ticks until all workers are gone; sets `stop` when it is time.
fn watch_over(
    heard: &Receiver<Note>,
    stop: &AtomicBool,
    options: &Options<'_>,
    begin: Instant,
    progress: &mut Progress,
    watch: &mut impl FnMut(&Progress, Duration),
) -> (Option<StopReason>, Paused) {
    let (mut stopped, mut paused) = (None, Paused::default());
    let mut last_tick = Instant::now();
    loop {
        match heard.recv_timeout(TICK) {
            Ok(Note::Ended(job)) => progress.note(job),
            Ok(Note::Paused { saved: true }) => paused.saved += 1,
            Ok(Note::Paused { saved: false }) => paused.unsaved += 1,
            Ok(Note::WriterStopped) => {
                stopped.get_or_insert(StopReason::WriterStopped);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return (stopped, paused),
        }
        if last_tick.elapsed() >= TICK {
            last_tick = Instant::now();
            watch(progress, begin.elapsed());
        }
        if stopped.is_none() {
            let interrupted = options.interrupted.load(Ordering::Relaxed);
            stopped = progress.stop(begin.elapsed(), options.deadline, interrupted);
        }
        stop.store(stopped.is_some(), Ordering::Relaxed);
    }
}

/// What the workers share.
struct Worker<'a> {
    jobs: &'a [PlannedJob],
    next: &'a AtomicUsize,
    context: Context<'a>,
    keeping: &'a Keeping,
}

/// A job that a worker brought to its end.
struct Done {
    result: Result<Trajectory, Failure>,
    wall_s: f64,
}

/// A job that was told to stop.
struct Unfinished {
    saved: bool,
}

impl Worker<'_> {
    /// Takes jobs until none is left or it is told to stop.
    fn work(&self, writer: &OutcomeSender, told: &Sender<Note>) {
        while !self.context.stop.load(Ordering::Relaxed) {
            let Some(planned) = self.jobs.get(self.next.fetch_add(1, Ordering::Relaxed)) else { return };
            if !self.run_one(planned, writer, told) {
                return;
            }
        }
    }

    /// Runs one job and hands its outcome over; false when there is nobody to take it, or it was told to stop.
    fn run_one(&self, planned: &PlannedJob, writer: &OutcomeSender, told: &Sender<Note>) -> bool {
        let job: JobId = planned.id;
        let taken = writer.send(Message::Started(job)).and_then(|()| {
            let work = self.compute(planned);
            self.context.arrays.release(&planned.job);
            let Done { result, wall_s } = match work {
                Ok(done) => done,
                Err(Unfinished { saved }) => return Ok(Note::Paused { saved }),
            };
            let ended = result.as_ref().map(|run| run.outcome).map_err(|failure| failure.class);
            writer.send(Message::Finished { job, result, wall_s })?;
            Ok(Note::Ended(Ended { result: ended, expected_s: planned.expected_s }))
        });
        let note = taken.unwrap_or(Note::WriterStopped);
        let goes_on = matches!(note, Note::Ended(_));
        // A watching thread that is gone needs no news.
        told.send(note).is_ok() && goes_on
    }

    /// Runs one job from its checkpoint, or from its beginning; leaves a checkpoint if it is told to stop, a dump if it fails.
    fn compute(&self, planned: &PlannedJob) -> Result<Done, Unfinished> {
        let mut last = self.keeping.load(planned);
        loop {
            let spent = last.as_ref().map_or(0.0, |saved| saved.wall_s);
            let from = last.as_ref().and_then(|saved| saved.snapshot.as_ref());
            let mut keeper = self.keeping.keeper(planned, spent, Instant::now());
            let ended = catch_unwind(AssertUnwindSafe(|| go_on(&planned.job, self.context, from, &mut keeper)))
                .unwrap_or_else(|panic| Err(panicked(panic.as_ref())));
            let wall_s = keeper.wall_s();
            match ended {
                Ok(RunEnded::Finished(trajectory)) => return Ok(Done { result: Ok(*trajectory), wall_s }),
                Ok(RunEnded::Stopped(None)) => return Err(Unfinished { saved: false }),
                Ok(RunEnded::Stopped(Some(snapshot))) => {
                    let saved = keeper.save(*snapshot);
                    if let Err(error) = &saved {
                        let what = "this job could not be saved, it goes on from where it last was";
                        tracing::warn!(%error, job = %planned.id, "{what}");
                    }
                    return Err(Unfinished { saved: saved.is_ok() });
                }
                Ok(RunEnded::WrongSnapshot) => {
                    self.keeping.put_aside(planned.id, "its state is not one of this job");
                    last = None;
                }
                Err(failure) => {
                    self.keeping.dump(planned, &failure, wall_s);
                    return Ok(Done { result: Err(failure), wall_s });
                }
            }
        }
    }
}

/// The failure that a panic is.
pub fn panicked(panic: &(dyn std::any::Any + Send)) -> Failure {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let reason = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned());
    Failure { class: FailureClass::Panicked, reason, step: 0, outline: None }
}

//! Runs the jobs of a plan on all cores and hands every outcome to the store's writer.
//!
//! Workers of a rayon pool take jobs from one list, longest expected first, so that no straggler is left to the end.
//! A thread that computes nothing watches: signals, deadline, the breaker, progress. What is decided stands in
//! [`schedule`]; here it is acted on.

pub mod schedule;

use crate::job::JobId;
use crate::plan::PlannedJob;
use crate::scene::library::ArrayLibrary;
use crate::simulate::{Context, simulate};
use crate::store::{Message, OutcomeSender, Store, StoreError, Writer, WriterOptions};
use crate::trajectory::{Failure, FailureClass, Trajectory};
use fearless_simd::Level;
use schedule::{Ended, Progress, StopReason};
use std::panic::{AssertUnwindSafe, catch_unwind};
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
    pub level: Level,
    /// Time after which no job is taken up any more.
    pub deadline: Option<Duration>,
    /// Set by a signal.
    pub interrupted: &'a AtomicBool,
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
    let writer = Writer::spawn(store, WriterOptions::default())?;
    let (stop, next) = (AtomicBool::new(false), AtomicUsize::new(0));
    let (told, heard) = channel();
    let begin = Instant::now();
    let mut progress = Progress::of(jobs.len() as u64, jobs.iter().map(|job| job.expected_s).sum());
    let stopped = std::thread::scope(|threads_of_run| {
        threads_of_run.spawn(|| {
            let worker = Worker { jobs, next: &next, arrays: &arrays, level: options.level, stop: &stop };
            pool.broadcast(|_| worker.work(&writer.sender(), &told.clone()));
            // The last sender: the watching thread ends with it.
            drop(told);
        });
        watch_over(&heard, &stop, &options, begin, &mut progress, &mut watch)
    });
    watch(&progress, begin.elapsed());
    let store = writer.finish()?;
    Ok(Report { store, progress, stopped })
}

/// What the watching thread hears.
enum Note {
    Ended(Ended),
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
) -> Option<StopReason> {
    let mut stopped = None;
    let mut last_tick = Instant::now();
    loop {
        match heard.recv_timeout(TICK) {
            Ok(Note::Ended(job)) => progress.note(job),
            Ok(Note::WriterStopped) => {
                stopped.get_or_insert(StopReason::WriterStopped);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return stopped,
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
    arrays: &'a ArrayLibrary,
    level: Level,
    stop: &'a AtomicBool,
}

impl Worker<'_> {
    /// Takes jobs until none is left or it is told to stop.
    fn work(&self, writer: &OutcomeSender, told: &Sender<Note>) {
        while !self.stop.load(Ordering::Relaxed) {
            let Some(planned) = self.jobs.get(self.next.fetch_add(1, Ordering::Relaxed)) else { return };
            if !self.run_one(planned, writer, told) {
                return;
            }
        }
    }

    /// Runs one job and hands its outcome over; false when there is nobody to take it, or it was told to stop.
    fn run_one(&self, planned: &PlannedJob, writer: &OutcomeSender, told: &Sender<Note>) -> bool {
        let id: JobId = planned.id;
        let begin = Instant::now();
        let context = Context { arrays: self.arrays, level: self.level, stop: self.stop };
        let taken = writer.send(Message::Started(id)).and_then(|()| {
            let result = catch_unwind(AssertUnwindSafe(|| simulate(&planned.job, context)))
                .unwrap_or_else(|panic| Err(panicked(panic.as_ref())));
            self.arrays.release(&planned.job);
            let Some(result): Option<Result<Trajectory, Failure>> = result.transpose() else { return Ok(None) };
            let ended = result.as_ref().map(|run| run.outcome).map_err(|failure| failure.class);
            let wall_s = begin.elapsed().as_secs_f64();
            writer.send(Message::Finished { job: id, result, wall_s }).map(|()| Some(ended))
        });
        // A watching thread that is gone needs no news.
        match taken {
            Ok(Some(result)) => told.send(Note::Ended(Ended { result, expected_s: planned.expected_s })).is_ok(),
            Ok(None) => false,
            Err(_) => {
                let _ = told.send(Note::WriterStopped);
                false
            }
        }
    }
}

fn panicked(panic: &(dyn std::any::Any + Send)) -> Failure {
    let text = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
    let reason = text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned());
    Failure { class: FailureClass::Panicked, reason, step: 0, shape: None }
}

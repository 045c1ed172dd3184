//! One round: runs the jobs of a plan on worker threads and hands every outcome to the store's writer.
//!
//! Workers take jobs from one list, longest expected first, so that no straggler is left to the end. The calling thread
//! computes nothing: it watches signals, the deadline and failures, and tells the caller how it goes. [`schedule`]
//! decides; this file acts on it.
//!
//! [`schedule`]: crate::execute::schedule

use crate::campaign::plan::PlannedJob;
use crate::execute::keeping::Keeping;
use crate::execute::options::Options;
use crate::execute::schedule::{Paused, Progress, StopReason};
use crate::execute::worker::{Note, Work};
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::Context;
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::store::{Deadline, Hurry, Store, StoreError, Writer, WriterOptions};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// How often the watching thread looks up.
const TICK: Duration = Duration::from_millis(100);

/// How a round ended.
#[derive(Debug)]
pub(super) struct RoundReport {
    /// What was done.
    pub(super) progress: Progress,
    /// How long it took.
    pub(super) elapsed: Duration,
    /// Why not all was done, if so.
    pub(super) stopped: Option<StopReason>,
    /// Jobs that were under way at the end.
    pub(super) paused: Paused,
}

/// Why a run could not go on; what was committed stays.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The system gave no worker threads.
    #[error(
        "cannot start {threads} worker threads: {source}; ask for fewer with --threads, or allow more \
         (`ulimit -u`, `ulimit -v`)"
    )]
    Threads {
        /// How many there should be.
        threads: usize,
        /// What the system says.
        source: std::io::Error,
    },
}

/// Runs all `jobs`, in their order, and calls `watch` now and then with the progress and the time since the start.
///
/// A job that fails or panics becomes a row and does not stop the others. Returns early, with everything finished so
/// far committed, when [`Progress::stop`] says so.
///
/// # Errors
/// [`RunError`].
pub(super) fn run(
    jobs: &[PlannedJob],
    store: Store,
    keeping: &Keeping,
    options: &Options,
    instruction_set: InstructionSet,
    watch: &mut dyn FnMut(&Progress, Duration),
) -> Result<RoundReport, RunError> {
    let arrays = ArrayLibrary::default();
    jobs.iter().for_each(|planned| arrays.announce(&planned.job));
    let hurry = Hurry { interrupted: options.interrupted.clone(), deadline: options.deadline };
    let writer = Writer::spawn(store, WriterOptions { hurry, ..WriterOptions::default() })?;
    let stop = AtomicBool::new(false);
    let context = Context { arrays: &arrays, instruction_set, stop: &stop };
    let work = Work { jobs, next: AtomicUsize::new(0), context, keeping };
    let threads = options.workers(jobs.len());
    let (told, heard) = channel();
    let (report, started) = std::thread::scope(|scope| {
        let work = &work;
        let started = (0..threads).try_for_each(|k| {
            let (writer, told) = (writer.sender(), told.clone());
            let worker = std::thread::Builder::new().name(format!("worker-{k}"));
            worker.spawn_scoped(scope, move || work.take_jobs(&writer, &told)).map(drop)
        });
        stop.store(started.is_err(), Ordering::Relaxed);
        // The workers hold the other senders: the watching ends with them.
        drop(told);
        (watch_over(Progress::of(jobs), &heard, &stop, options, watch), started)
    });
    drop(writer.finish()?);
    started.map_err(|source| RunError::Threads { threads, source })?;
    warn_of_creeping(report.progress.creeping);
    Ok(report)
}

/// Warns of runs of which nobody knows whether they would have clogged.
fn warn_of_creeping(runs: u64) {
    if runs > 0 {
        let what = if runs == 1 { "1 run was".to_owned() } else { format!("{runs} runs were") };
        tracing::warn!(
            "{what} slower than V_t/100, and at no equilibrium, when t_max cut them off: they count as flowing; raise \
             limits.t_max to learn whether they clog"
        );
    }
}

/// Watches until all workers are gone; sets `stop` when it is time.
fn watch_over(
    progress: Progress,
    heard: &Receiver<Note>,
    stop: &AtomicBool,
    options: &Options,
    watch: &mut dyn FnMut(&Progress, Duration),
) -> RoundReport {
    let begin = Instant::now();
    let mut report = RoundReport { progress, elapsed: Duration::ZERO, stopped: None, paused: Paused::default() };
    let mut next_look = begin + TICK;
    loop {
        let now = Instant::now();
        if report.stopped.is_none() {
            let interrupted = options.interrupted.load(Ordering::Relaxed);
            report.stopped = report.progress.stop(options.deadline.is_some_and(Deadline::has_come), interrupted);
        }
        if report.stopped.is_some() {
            stop.store(true, Ordering::Relaxed);
        }
        if now >= next_look {
            next_look = now + TICK;
            watch(&report.progress, now - begin);
        }
        match heard.recv_timeout(TICK) {
            Ok(note) => report.hear(note),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    report.elapsed = begin.elapsed();
    report
}

impl RoundReport {
    /// Takes note of what a worker tells.
    fn hear(&mut self, note: Note) {
        match note {
            Note::Ended(end) => self.progress.note(end),
            Note::Paused { saved: true } => self.paused.saved += 1,
            Note::Paused { saved: false } => self.paused.unsaved += 1,
            Note::WriterStopped => {
                self.stopped.get_or_insert(StopReason::WriterStopped);
            }
        }
    }
}

//! The one thread that writes: outcomes come over a channel and commit in groups.
//!
//! A group commits when it is large enough, or when its oldest message has waited long enough. So a crash costs at
//! most the work of that time, and a million tiny jobs do not cost a million disk flushes.
//!
//! When a commit fails, the batch is kept and tried again: without end while the disk is full, a few times for any
//! other reason. After the last try, or when the run is to end, the writer stops, and [`Writer::finish`] says why.

use crate::parameters::JobId;
use crate::results::trajectory::{Failure, FailureClass, Trajectory};
use crate::store::end_state::EndState;
use crate::store::error::StoreError;
use crate::store::unix_now;
use crate::store::write::commit::{Batch, FinishedJob, commit};
use crate::store::write::patience::{self, Hurry};
use crate::store::write::waiting::Waiting;
use crate::store::write::{Store, compact, orphans};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What a worker tells the writer.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "moved once, and most messages are the large one")]
pub enum Message {
    /// A worker took the job up.
    Started(JobId),
    /// The state in which a job ended; its result follows.
    Ended(JobId, EndState),
    /// The job ended, with a result or a failure.
    Finished {
        /// The job.
        job: JobId,
        /// What it produced.
        result: Result<Trajectory, Failure>,
        /// Wall time it took, in seconds.
        wall_s: f64,
    },
}

/// When the writer commits, and how patient it is.
#[derive(Clone, Debug)]
pub struct WriterOptions {
    /// The writer commits after so many outcomes.
    pub outcomes: usize,
    /// It commits after so many recorded samples.
    pub samples: usize,
    /// It commits when the oldest message has waited so long.
    pub age: Duration,
    /// So many messages may wait for the writer; then workers wait too.
    pub queue: usize,
    /// So many small sample files of about one size are merged into one.
    pub merge: usize,
    /// The pauses after failed commits. The writer gives up after the last one, except while the disk is full.
    pub pauses: Vec<Duration>,
    /// Says when the writer must not pause any more.
    pub hurry: Hurry,
}

impl Default for WriterOptions {
    fn default() -> Self {
        Self {
            outcomes: 1000,
            samples: 1 << 20,
            age: Duration::from_secs(1),
            queue: 1024,
            merge: compact::TIER,
            pauses: [0.2, 1.0, 5.0, 15.0, 30.0].map(Duration::from_secs_f64).to_vec(),
            hurry: Hurry::default(),
        }
    }
}

/// The writer takes no more messages: it gave up, or has finished. [`Writer::finish`] says which.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the writer of the store has stopped")]
pub struct WriterStopped;

/// A worker's way to the writer; every worker has a clone.
#[derive(Clone, Debug)]
pub struct OutcomeSender {
    /// `None` asks the writer to finish.
    messages: SyncSender<Option<Message>>,
    waiting: Arc<Waiting>,
}

impl OutcomeSender {
    /// Hands a message over. An outcome waits for a place in the queue, and while much waits for the writer. A
    /// [`Message::Started`] is dropped when there is no place, because the outcome makes up for it.
    ///
    /// # Errors
    /// [`WriterStopped`].
    pub fn send(&self, message: Message) -> Result<(), WriterStopped> {
        use std::sync::mpsc::TrySendError::Disconnected;
        match message {
            Message::Started(_) => match self.messages.try_send(Some(message)) {
                Err(Disconnected(_)) => Err(WriterStopped),
                _ => Ok(()),
            },
            Message::Finished { ref result, .. } => {
                self.waiting.enter(result.as_ref().map_or(0, rows));
                self.messages.send(Some(message)).map_err(|_| WriterStopped)
            }
            Message::Ended(..) => self.messages.send(Some(message)).map_err(|_| WriterStopped),
        }
    }
}

/// The writer thread of a store.
///
/// Dropping it without [`Writer::finish`] saves what was sent, but only logs errors.
#[derive(Debug)]
pub struct Writer {
    sender: OutcomeSender,
    thread: Option<JoinHandle<Result<Store, StoreError>>>,
}

impl Writer {
    /// Starts the thread.
    ///
    /// # Errors
    /// If the system cannot start a thread.
    pub fn spawn(store: Store, options: WriterOptions) -> Result<Self, StoreError> {
        let (messages, receiver) = sync_channel(options.queue);
        let waiting = Arc::new(Waiting::default());
        let work = {
            let waiting = waiting.clone();
            move || {
                let written = write(store, &receiver, &options, &waiting);
                waiting.close();
                written
            }
        };
        let builder = std::thread::Builder::new().name("store-writer".to_owned());
        let thread = builder.spawn(work).map_err(StoreError::NoThread)?;
        Ok(Self { sender: OutcomeSender { messages, waiting }, thread: Some(thread) })
    }

    /// A sender to this writer, for a worker.
    pub fn sender(&self) -> OutcomeSender {
        self.sender.clone()
    }

    /// Commits everything that was sent before, notes the end of the run, and gives the store back.
    ///
    /// # Errors
    /// [`StoreError::GaveUp`] when outcomes could not be saved, [`StoreError::UnknownJob`] when one had no place.
    pub fn finish(mut self) -> Result<Store, StoreError> {
        self.stop().unwrap_or(Err(StoreError::WriterPanicked))
    }

    fn stop(&mut self) -> Option<Result<Store, StoreError>> {
        // A writer that gave up takes no message; joining its thread says why.
        let _ = self.sender.messages.send(None);
        self.thread.take()?.join().ok()
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        if self.thread.is_some()
            && let Some(Err(error)) = self.stop()
        {
            tracing::error!(%error, "the store could not save everything");
        }
    }
}

/// The thread: collects and commits, until it is told to finish or nobody can send any more.
fn write(
    mut store: Store,
    receiver: &Receiver<Option<Message>>,
    options: &WriterOptions,
    waiting: &Waiting,
) -> Result<Store, StoreError> {
    let mut pending = Pending::default();
    let mut unknown = Vec::new();
    loop {
        let event = match pending.oldest {
            None => receiver.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(oldest) => receiver.recv_timeout(options.age.saturating_sub(oldest.elapsed())),
        };
        let last = match event {
            Ok(Some(message)) => {
                pending.add(message);
                if !pending.is_due(options) {
                    continue;
                }
                false
            }
            Err(RecvTimeoutError::Timeout) => false,
            Ok(None) | Err(RecvTimeoutError::Disconnected) => true,
        };
        let Pending { batch, handed_over, .. } = std::mem::take(&mut pending);
        unknown.extend(patiently_commit(&mut store, &batch, options)?);
        waiting.leave(handed_over);
        orphans::clear_checkpoints(&store.folders(), batch.finished.iter().map(|finished| finished.job));
        if let Err(error) = compact::compact(&mut store, options.merge) {
            // Nothing is lost: the small files stay.
            tracing::warn!(%error, "small sample files could not be merged; the next commit tries again");
        }
        if last {
            store.end_run()?;
            return unknown.first().map_or(Ok(store), |job| Err(StoreError::UnknownJob(*job)));
        }
    }
}

/// What has come since the last commit.
#[derive(Default)]
struct Pending {
    batch: Batch,
    samples: usize,
    /// The same as [`Waiting`] counts them: with those of trajectories that cannot be stored.
    handed_over: usize,
    oldest: Option<Instant>,
}

impl Pending {
    fn add(&mut self, message: Message) {
        self.oldest.get_or_insert_with(Instant::now);
        match message {
            Message::Started(job) => self.batch.started.push(job),
            Message::Ended(job, end) => self.batch.ends.push((job, end)),
            Message::Finished { job, result, wall_s } => {
                self.handed_over += result.as_ref().map_or(0, rows);
                let result = result.and_then(storable);
                self.samples += result.as_ref().map_or(0, rows);
                self.batch.finished.push(FinishedJob { job, result, wall_s, at: unix_now() });
            }
        }
    }

    /// Whether it is time to commit. The age is asked too, because in a steady stream of messages no wait times out.
    fn is_due(&self, options: &WriterOptions) -> bool {
        self.batch.finished.len() >= options.outcomes
            || self.samples >= options.samples
            || self.oldest.is_some_and(|oldest| oldest.elapsed() >= options.age)
    }
}

fn patiently_commit(store: &mut Store, batch: &Batch, options: &WriterOptions) -> Result<Vec<JobId>, StoreError> {
    let mut attempts = 0;
    loop {
        let error = match commit(store, batch) {
            Ok(unknown) => return Ok(unknown),
            Err(error) => error,
        };
        let pause = patience::pause(&error, attempts, &options.pauses, &options.hurry);
        let unsaved = batch.finished.len();
        attempts += 1;
        let Some(pause) = pause else {
            return Err(StoreError::GaveUp { unsaved, attempts, source: Box::new(error) });
        };
        if patience::is_full(&error) {
            let what = "the disk is full; outcomes wait and are saved as soon as there is room";
            tracing::warn!(%error, unsaved, "{what}");
        } else {
            tracing::warn!(%error, unsaved, attempts, ?pause, "saving outcomes failed; they are kept and tried again");
        }
        options.hurry.pause(pause);
    }
}

/// The size of a trajectory in rows of samples; four vertices of a kept shape take as much as a row.
fn rows(trajectory: &Trajectory) -> usize {
    let vertices: usize = trajectory.outlines.iter().map(|outline| outline.x.len()).sum();
    trajectory.samples.len() + vertices / 4
}

/// Makes a failed run of a trajectory with a number that SQL cannot keep, or with columns of different lengths: it
/// must not keep the others of its batch from being saved.
fn storable(trajectory: Trajectory) -> Result<Trajectory, Failure> {
    let step = trajectory.steps;
    let last_outline = trajectory.outlines.iter().rfind(|outline| outline.is_sound());
    let fail =
        |class, reason: String| Err(Failure { class, reason, step, outline: last_outline.cloned().map(Box::new) });
    let numbers = [
        ("r_end", trajectory.r_end),
        ("t_end", trajectory.t_end),
        ("ek_ratio_end", trajectory.ek_ratio_end),
        ("overlap_max", trajectory.overlap_max),
    ];
    let clog = trajectory.clog.iter().flat_map(|clog| {
        [
            ("clog t", clog.t),
            ("clog r", clog.r),
            ("clog x", clog.x),
            ("clog y", clog.y),
            ("clog ek_ratio", clog.ek_ratio),
        ]
    });
    if let Some((name, value)) = numbers.into_iter().chain(clog).find(|(_, value)| !value.is_finite()) {
        return fail(FailureClass::Unstable, format!("{name} is {value}"));
    }
    if let Some(outline) = trajectory.outlines.iter().find(|outline| !outline.is_sound()) {
        return fail(
            FailureClass::Unstable,
            format!("the outline at t = {} has a coordinate that is not a number", outline.t),
        );
    }
    let samples = &trajectory.samples;
    let full = [&samples.t, &samples.r, &samples.h, &samples.y, &samples.v_g, &samples.ek_ratio];
    let optional = [&samples.shape, &samples.area_error].into_iter().filter(|column| !column.is_empty());
    if full.into_iter().chain(optional).any(|column| column.len() != samples.len()) {
        return fail(FailureClass::Panicked, "the recorded columns differ in length".to_owned());
    }
    Ok(trajectory)
}

//! What a checkpoint or a dump holds: the job itself, its state, and its failure if it failed.

use crate::parameters::{Job, plain};
use crate::physics::simulate::{EndState, Snapshot};
use crate::results::trajectory::{Failure, FailureClass};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A job under way. It holds all that is needed to go on with it, without a store.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Saved {
    /// Its point in canonical form.
    point: String,
    seed: u64,
    /// Wall time spent on it so far, in seconds.
    pub(super) wall_s: f64,
    /// Its state; `None` stands for its beginning.
    pub(super) snapshot: Option<Snapshot>,
    /// How it failed after that, if it did.
    pub(super) failure: Option<SavedFailure>,
}

/// A failure as a dump holds it: without the outline.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{}: {} (step {step})", class.name(), plain(reason))]
pub(crate) struct SavedFailure {
    /// What kind of failure.
    class: FailureClass,
    /// What happened, in a sentence.
    reason: String,
    /// The time step at which it was noticed.
    step: u64,
}

impl From<&Failure> for SavedFailure {
    fn from(failure: &Failure) -> Self {
        Self { class: failure.class, reason: failure.reason.clone(), step: failure.step }
    }
}

/// Version of the bytes of an end state; raised whenever it is written in another way.
const END_FORMAT: u32 = 1;

/// An end state as bytes, every number with all its bits.
pub(super) fn encode_end(end: &EndState) -> Vec<u8> {
    postcard::to_stdvec(&(END_FORMAT, end)).expect("plain numbers, texts and lists can be encoded")
}

/// An end state from bytes; `None` if they are of another format.
pub(super) fn decode_end(bytes: &[u8]) -> Option<EndState> {
    let (format, state) = postcard::take_from_bytes::<u32>(bytes).ok()?;
    let whole = |(end, rest): (EndState, &[u8])| rest.is_empty().then_some(end);
    if format == END_FORMAT { postcard::take_from_bytes(state).ok().and_then(whole) } else { None }
}

impl Saved {
    /// A job at a snapshot, or at its beginning.
    pub(super) fn new(job: &Job, wall_s: f64, snapshot: Option<Snapshot>) -> Self {
        Self { point: job.point.canonical(), seed: job.seed, wall_s, snapshot, failure: None }
    }

    /// As bytes, every number with all its bits.
    pub(super) fn encode(&self) -> Vec<u8> {
        postcard::to_stdvec(self).expect("plain numbers, texts and lists can be encoded")
    }

    /// From bytes; `None` if they are not those of a saved job.
    pub(super) fn decode(bytes: &[u8]) -> Option<Self> {
        postcard::take_from_bytes(bytes).ok().filter(|(_, rest)| rest.is_empty()).map(|(saved, _)| saved)
    }

    /// The job; `None` if its point cannot be read.
    pub(super) fn job(&self) -> Option<Job> {
        let point: crate::parameters::Point = serde_json::from_str(&self.point).ok()?;
        Some(Job { point_id: point.id(), point: Arc::new(point), seed: self.seed })
    }
}

//! The state in which a trajectory ended, so that a job with a larger time limit or distance goes on from there.
//!
//! Its bytes are those of whoever computed it. Before them stands their checksum, so that a damaged state is not taken
//! up.

use crate::parameters::JobId;

/// Where a trajectory was at the check before its last one.
#[derive(Clone, Debug, PartialEq)]
pub struct EndState {
    /// Identity of its course, whatever cuts it off.
    pub course: JobId,
    /// Time steps taken.
    pub step: u64,
    /// How far the job was to go, in sigma; `None` where that was not limited.
    pub distance: Option<f64>,
    /// The state, as its owner encoded it.
    pub state: Vec<u8>,
}

/// A state behind its checksum.
pub(super) fn sealed(state: &[u8]) -> Vec<u8> {
    [blake3::hash(state).as_bytes().as_slice(), state].concat()
}

/// The state behind a checksum that is right.
pub(super) fn unsealed(bytes: &[u8]) -> Option<&[u8]> {
    let (checksum, state) = bytes.split_at_checked(blake3::OUT_LEN)?;
    (blake3::hash(state).as_bytes() == checksum).then_some(state)
}

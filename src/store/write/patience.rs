//! How long the writer waits when saving fails: on a full disk until there is room, otherwise a few times. Once the
//! run is to end it waits no longer than for a few more attempts.

use crate::store::deadline::Deadline;
use crate::store::error::StoreError;
use std::error::Error;
use std::io::ErrorKind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Longest pause between two looks at a full disk.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// Pause between the last attempts, once the run is to end.
const SHORTEST_PAUSE: Duration = Duration::from_millis(200);

/// How many attempts there are once the run is to end.
const LAST_ATTEMPTS: usize = 3;

/// How often a pause looks whether the run is to end.
const TICK: Duration = Duration::from_millis(50);

/// Says when there is no time left to wait.
#[derive(Clone, Debug, Default)]
pub struct Hurry {
    /// Set when somebody asks the run to end.
    pub interrupted: Arc<AtomicBool>,
    /// When the run has to end by itself.
    pub deadline: Option<Deadline>,
}

impl Hurry {
    /// Whether it is time to end.
    pub(crate) fn is_now(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed) || self.deadline.is_some_and(Deadline::has_come)
    }

    /// Waits, but not for long once it is time to end.
    pub(super) fn pause(&self, pause: Duration) {
        let begin = Instant::now();
        while begin.elapsed() < if self.is_now() { pause.min(SHORTEST_PAUSE) } else { pause } {
            std::thread::sleep(TICK.min(pause));
        }
    }
}

/// The pause after a failed attempt that came after `attempts` others; `None` to give up, at once if the store is
/// damaged.
pub(super) fn pause(error: &StoreError, attempts: usize, pauses: &[Duration], hurry: &Hurry) -> Option<Duration> {
    if is_damaged(error) || (hurry.is_now() && attempts + 1 >= LAST_ATTEMPTS) {
        return None;
    }
    if is_full(error) {
        let pause = pauses.get(attempts).or(pauses.last());
        return Some(pause.map_or(LONGEST_PAUSE, |&pause| pause.min(LONGEST_PAUSE)));
    }
    pauses.get(attempts).copied()
}

/// Whether the store itself is damaged, which no waiting mends.
fn is_damaged(error: &StoreError) -> bool {
    use rusqlite::ErrorCode::{DatabaseCorrupt, NotADatabase};
    match error {
        StoreError::Damaged { .. } | StoreError::ForeignEntry { .. } => true,
        StoreError::Sql { source, .. } => {
            matches!(source.sqlite_error_code(), Some(DatabaseCorrupt | NotADatabase))
        }
        _ => false,
    }
}

/// Whether the disk, or what one may use of it, is full.
pub(super) fn is_full(error: &StoreError) -> bool {
    let full = |kind| matches!(kind, ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    if let StoreError::Sql { source, .. } = error {
        return source.sqlite_error_code() == Some(rusqlite::ErrorCode::DiskFull);
    }
    let mut cause: Option<&(dyn Error + 'static)> = Some(error);
    while let Some(error) = cause {
        if error.downcast_ref::<std::io::Error>().is_some_and(|error| full(error.kind())) {
            return true;
        }
        cause = error.source();
    }
    false
}

//! How much may wait for the writer. Workers that bring more wait themselves, so the memory of a run has a bound
//! however slow the disk is.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Most rows of samples that wait; a row takes 64 bytes. A trajectory with more waits alone.
const MOST_ROWS: usize = 4 << 20;

/// The rows of all trajectories that were handed over and are not committed yet.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    rows: usize,
    /// Set when nobody commits any more.
    closed: bool,
}

impl Waiting {
    /// Counts a trajectory of so many rows, once there is room for it.
    pub(super) fn enter(&self, rows: usize) {
        let is_full = |state: &mut State| !state.closed && state.rows > 0 && state.rows + rows > MOST_ROWS;
        let state = self.changed.wait_while(self.lock(), is_full);
        state.unwrap_or_else(PoisonError::into_inner).rows += rows;
    }

    /// So many rows were committed.
    pub(super) fn leave(&self, rows: usize) {
        let mut state = self.lock();
        state.rows = state.rows.saturating_sub(rows);
        self.changed.notify_all();
    }

    /// Lets all in: what they bring is refused elsewhere.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// The state. A panic of another thread cannot leave it wrong, because every change is one statement.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;

    #[test]
    fn a_trajectory_waits_until_there_is_room_or_nobody_commits_any_more() {
        let (waiting, is_in) = (Arc::new(Waiting::default()), Arc::new(AtomicBool::new(false)));
        // However large, one is let in.
        waiting.enter(2 * MOST_ROWS);
        for open in [|waiting: &Waiting| waiting.leave(2 * MOST_ROWS), |waiting: &Waiting| waiting.close()] {
            is_in.store(false, Ordering::Relaxed);
            let worker = std::thread::spawn({
                let (waiting, is_in) = (waiting.clone(), is_in.clone());
                move || {
                    waiting.enter(MOST_ROWS);
                    is_in.store(true, Ordering::Relaxed);
                }
            });
            std::thread::sleep(Duration::from_millis(20));
            assert!(!is_in.load(Ordering::Relaxed));
            open(&waiting);
            worker.join().unwrap();
        }
    }
}

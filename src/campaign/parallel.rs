//! Work that is divided among the cores, also where the system gives no threads.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::OnceLock;

/// Calls `work` with the threads of one pool for its parallel iterators, as many as there are cores. If they cannot be
/// started, this thread does all the work: rayon's own pool would panic.
pub(crate) fn in_parallel<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    thread_local! {
        // A pool of this thread alone starts none.
        static ALONE: Option<ThreadPool> = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok();
    }
    match POOL.get_or_init(|| ThreadPoolBuilder::new().build().ok()) {
        Some(pool) => pool.install(work),
        None => ALONE.with(|_| work()),
    }
}

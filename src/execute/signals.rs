//! Ctrl-C and SIGTERM as a flag.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A flag for [`Options::interrupted`](crate::execute::Options::interrupted) that SIGINT and SIGTERM set. A second
/// signal ends the process at once, with `exit_code`.
///
/// # Errors
/// If the system takes no signal handlers.
pub fn set_by_signals(exit_code: i32) -> std::io::Result<Arc<AtomicBool>> {
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // Handlers run in this order, so the first signal finds the flag unset, and only then sets it.
        flag::register_conditional_shutdown(signal, exit_code, interrupted.clone())?;
        flag::register(signal, interrupted.clone())?;
    }
    Ok(interrupted)
}

//! Ctrl-C, SIGTERM and SIGHUP as a flag.

use crate::store::StoreError;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use signal_hook::low_level::exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Signals within this time of the first are one with it: `timeout` signals its child and then the group of both, and a
/// terminal that closes its shell.
const TOGETHER: Duration = Duration::from_secs(1);

/// A flag for [`Options::interrupted`](crate::execute::Options::interrupted) that SIGINT, SIGTERM and SIGHUP set. A
/// signal that comes a second later, or more, ends the process at once, with `exit_code`.
///
/// A SIGHUP that is ignored when the program starts stays so, as `nohup` has it. From here on a file that outgrows
/// `ulimit -f` is an error of whoever writes it, and not the end of the process.
///
/// # Errors
/// If the system takes no signal handlers; [`StoreError::NoThread`].
pub fn set_by_signals(exit_code: i32) -> Result<Arc<AtomicBool>, StoreError> {
    let interrupted = Arc::new(AtomicBool::new(false));
    flag::register(SIGXFSZ, Arc::default()).map_err(StoreError::NoThread)?;
    let mut heeded = vec![SIGINT, SIGTERM];
    if !hangup_is_ignored() {
        heeded.push(SIGHUP);
    }
    let mut signals = Signals::new(heeded).map_err(StoreError::NoThread)?;
    let flag = interrupted.clone();
    let listen = move || {
        let mut first: Option<Instant> = None;
        for _ in signals.forever() {
            if first.get_or_insert_with(Instant::now).elapsed() >= TOGETHER {
                exit(exit_code);
            }
            flag.store(true, Ordering::Relaxed);
        }
    };
    std::thread::Builder::new().name("signals".to_owned()).spawn(listen).map_err(StoreError::NoThread)?;
    Ok(interrupted)
}

/// Whether whoever started this program wants it to outlive the terminal. Linux says so; elsewhere it is not known.
fn hangup_is_ignored() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or_default();
    mask & 1 << (SIGHUP - 1) != 0
}

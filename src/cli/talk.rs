//! What the program says: data to stdout or to a file, everything else to stderr.

use crate::campaign::file::CampaignErrors;
use crate::parameters::{harmless, shown};
pub(super) use crate::store::typed;
use crate::study::calibrate::frames::BadFrames;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::retry_on_intr;
use std::error::Error;
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use tracing_indicatif::IndicatifLayer;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::fmt::writer::BoxMakeWriter;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Sends warnings and debug messages to stderr, past the progress bar.
pub(super) fn log_to_stderr(quiet: bool, verbose: u8) {
    let level = match (quiet, verbose) {
        (true, _) => LevelFilter::ERROR,
        (false, 0) => LevelFilter::WARN,
        (false, 1) => LevelFilter::INFO,
        (false, _) => LevelFilter::DEBUG,
    };
    // RUST_LOG may ask for more of single modules, as in `RUST_LOG=meniscus::store=debug`.
    let asked = std::env::var("RUST_LOG").ok().and_then(|text| text.parse::<Targets>().ok()).unwrap_or_default();
    let filter = asked.with_default(level);
    // Bars are for people who watch.
    let bars = (!quiet && is_watched()).then(IndicatifLayer::new);
    let writer = match &bars {
        Some(bars) => BoxMakeWriter::new(bars.get_stderr_writer()),
        None => BoxMakeWriter::new(|| Talk),
    };
    let lines =
        tracing_subscriber::fmt::layer().with_writer(writer).with_ansi(colour()).without_time().with_target(false);
    // A bar is a span of level `error`, so the filter above must not see it.
    tracing_subscriber::registry().with(lines.with_filter(filter)).with(bars).init();
}

/// Shows an error on stderr.
pub(super) fn complain(error: &(dyn Error + 'static)) {
    match (error.downcast_ref::<CampaignErrors>(), error.downcast_ref::<BadFrames>()) {
        // What shows the lines of a file in colour makes them harmless itself.
        (Some(problems), _) if colour() => utter(&problems.render(true)),
        (_, Some(problems)) if colour() => utter(&problems.render(true)),
        (Some(problems), _) => say(problems.render(false)),
        (_, Some(problems)) => say(problems.render(false)),
        _ => say(format!("error: {error}")),
    }
}

/// How long talk waits for somebody who does not read on, such as a pager; once that was in vain it waits no more.
const PATIENCE: Timespec = Timespec { tv_sec: 1, tv_nsec: 0 };
const NO_PATIENCE: Timespec = Timespec { tv_sec: 0, tv_nsec: 0 };
static WAITED_IN_VAIN: AtomicBool = AtomicBool::new(false);

/// Stderr for talk that need not be heard. If the pipe is broken, the disk full, or nobody reads on, the program goes
/// on all the same: its work and its exit code do not depend on that.
struct Talk;

impl Write for Talk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let stderr = std::io::stderr();
        let patience = if WAITED_IN_VAIN.load(Ordering::Relaxed) { NO_PATIENCE } else { PATIENCE };
        let ready = retry_on_intr(|| poll(&mut [PollFd::new(&stderr, PollFlags::OUT)], Some(&patience)));
        let in_vain = ready == Ok(0);
        WAITED_IN_VAIN.store(in_vain, Ordering::Relaxed);
        if !in_vain {
            let _ = stderr.lock().write_all(bytes);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Says something on stderr, where no terminal obeys it; nothing else here prints to it.
pub(super) fn say(text: impl Display) {
    utter(&harmless(&text.to_string()));
}

fn utter(text: &str) {
    let _ = Talk.write_all(format!("{text}\n").as_bytes());
}

/// Whether stderr is a terminal that can move its cursor: one for bars and colours.
pub(super) fn is_watched() -> bool {
    let is_dumb = std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == "dumb");
    std::io::stderr().is_terminal() && !is_dumb
}

/// Whether stderr wants colour.
pub(super) fn colour() -> bool {
    is_watched() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Writes text for people to stdout, where no terminal obeys it.
pub(super) fn print(text: impl AsRef<str>) -> std::io::Result<()> {
    print_data(harmless(text.as_ref()).as_bytes())
}

/// Writes data to stdout as it is; a reader that closes the pipe early has seen enough.
pub(super) fn print_data(data: impl AsRef<[u8]>) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(data.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(std::io::Error::new(error.kind(), format!("cannot write to stdout: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Writes data to a file; an error names it. A file that is a pipe, such as /dev/stdout, may be closed early.
pub(super) fn write_file(path: &Path, data: impl AsRef<[u8]>) -> Result<(), String> {
    match std::fs::write(path, data) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|error| format!("cannot write {}: {error}", shown(path))),
    }
}

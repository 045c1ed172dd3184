//! What the program says: data to stdout or to a file, everything else to stderr.

use crate::campaign::file::CampaignErrors;
use crate::study::calibrate::frames::BadFrames;
use std::error::Error;
use std::io::{IsTerminal, Write};
use std::path::Path;
use tracing_indicatif::IndicatifLayer;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
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
    let bars = IndicatifLayer::new();
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(bars.get_stderr_writer())
        .with_ansi(colour())
        .without_time()
        .with_target(false);
    // Bars are for people who watch. They are spans of level `error`, so the filter above must not see them.
    let bars = (!quiet && std::io::stderr().is_terminal()).then_some(bars);
    tracing_subscriber::registry().with(lines.with_filter(filter)).with(bars).init();
}

/// Shows an error on stderr.
pub(super) fn complain(error: &(dyn Error + 'static)) {
    match (error.downcast_ref::<CampaignErrors>(), error.downcast_ref::<BadFrames>()) {
        (Some(problems), _) => eprintln!("{}", problems.render(colour())),
        (_, Some(problems)) => eprintln!("{}", problems.render(colour())),
        _ => eprintln!("error: {error}"),
    }
}

/// Whether stderr wants colour.
fn colour() -> bool {
    std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Writes data to stdout; a reader that closes the pipe early has seen enough.
pub(super) fn print(data: impl AsRef<[u8]>) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(data.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// Writes data to a file; an error names it.
pub(super) fn write_file(path: &Path, data: impl AsRef<[u8]>) -> Result<(), String> {
    std::fs::write(path, data).map_err(|error| format!("cannot write {}: {error}", path.display()))
}

/// A path as one types it in a shell: in quotes if it needs them.
pub(super) fn typed(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "-_./+,:@%=".contains(c);
    if !text.is_empty() && text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_in_commands_can_be_pasted_into_a_shell() {
        let texts = ["runs/a.meniscus", "my runs", "it's"].map(|path| typed(Path::new(path)));
        assert_eq!(texts, ["runs/a.meniscus", "'my runs'", r"'it'\''s'"]);
    }
}

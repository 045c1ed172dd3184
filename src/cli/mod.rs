//! The command line: one file per subcommand, no logic of its own. stdout is data, stderr is talk.

mod accuracy;
mod calibrate;
mod check;
mod deadline;
mod fit;
mod plan;
mod progress;
mod query;
mod render;
mod replay;
mod run;
mod status;

use crate::campaign::file::CampaignErrors;
use clap::{Parser, Subcommand};
use std::error::Error;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tracing_indicatif::IndicatifLayer;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// What a subcommand returns: how to exit, or an error to be shown.
type Outcome = Result<Exit, Box<dyn Error>>;

/// Campaigns of droplet simulations: flow and clogging of capillary droplets.
#[derive(Debug, Parser)]
#[command(version, about, after_help = "Start with:  meniscus run campaigns/quickstart.toml")]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Say more (twice: debug)
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Plan, run and resume a campaign: always the same command
    Run(run::Arguments),
    /// Show what a campaign would do: jobs, effects, stability, cost
    Plan(plan::Arguments),
    /// Show how far a store has come
    Status(status::Arguments),
    /// Ask a store in SQL
    Query(query::Arguments),
    /// Fit decay lengths and mean speeds to all finished runs
    Fit(fit::Arguments),
    /// Draw a droplet among its obstacles: SVG, PNG, or GIF
    Render(render::Arguments),
    /// Check a store: checksums, counts, rows, orphans; with --repair put it right
    Check(check::Arguments),
    /// Measure what accuracy costs: errors, orders, and error against time
    Accuracy(accuracy::Arguments),
    /// Run what a failed job left behind, and see whether it fails again
    Replay(replay::Arguments),
    /// Find line tension and near-wall drag of a droplet from an experiment's frames
    Calibrate(calibrate::Arguments),
}

/// Reads the command line, does what it asks for, and says how it went.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    talk(&cli);
    match cli.run() {
        Ok(exit) => exit.into(),
        Err(error) => {
            complain(error.as_ref());
            Exit::Error.into()
        }
    }
}

impl Cli {
    /// Runs the subcommand.
    pub fn run(&self) -> Outcome {
        match &self.command {
            Command::Run(arguments) => arguments.run(self.quiet),
            Command::Plan(arguments) => arguments.run(),
            Command::Status(arguments) => arguments.run(),
            Command::Query(arguments) => arguments.run(),
            Command::Fit(arguments) => arguments.run(),
            Command::Render(arguments) => arguments.run(self.quiet),
            Command::Check(arguments) => arguments.run(self.quiet),
            Command::Accuracy(arguments) => arguments.run(self.quiet),
            Command::Replay(arguments) => arguments.run(),
            Command::Calibrate(arguments) => arguments.run(self.quiet),
        }
    }
}

/// Exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All done.
    Done = 0,
    /// An error; nothing, or not all, was done.
    Error = 1,
    /// Finished, but some jobs failed.
    FailedJobs = 3,
    /// Interrupted, everything is saved.
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Sends the program's talk to stderr, past the progress bar.
pub fn talk(cli: &Cli) {
    let level = match (cli.quiet, cli.verbose) {
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
    // Bars are for people who watch; filtered apart, for they are spans of level `error`.
    let bars = (!cli.quiet && std::io::stderr().is_terminal()).then_some(bars);
    tracing_subscriber::registry().with(lines.with_filter(filter)).with(bars).init();
}

/// Shows an error on stderr.
pub fn complain(error: &(dyn Error + 'static)) {
    match (error.downcast_ref::<CampaignErrors>(), error.downcast_ref::<calibrate::BadFrames>()) {
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
fn print(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}

/// The store asked for, or `NAME.meniscus` in the current directory.
fn store_of(asked: Option<&Path>, campaign: &str) -> PathBuf {
    asked.map_or_else(|| PathBuf::from(format!("{campaign}.meniscus")), Path::to_owned)
}

/// The store asked for, or the only one in the current directory.
fn store_here(asked: Option<&Path>) -> Result<PathBuf, Box<dyn Error>> {
    if let Some(dir) = asked {
        return Ok(dir.to_owned());
    }
    let is_store = |path: &PathBuf| path.extension().is_some_and(|e| e == "meniscus") && path.is_dir();
    let mut found: Vec<PathBuf> =
        std::fs::read_dir(".")?.filter_map(|entry| Some(entry.ok()?.path())).filter(is_store).collect();
    found.sort();
    match (found.pop(), found.len()) {
        (Some(only), 0) => Ok(only),
        (None, _) => Err("no store NAME.meniscus in this folder; name one, or start one with `meniscus run`".into()),
        (Some(_), others) => Err(format!("{} stores in this folder; name the one you mean", others + 1).into()),
    }
}

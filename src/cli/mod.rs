//! The command line: arguments and printing, nothing else. Each subcommand has a file of its name; it reads its
//! arguments, calls the library, and prints data to stdout and everything else to stderr.

mod accuracy;
mod calibrate;
mod check;
mod compare;
mod deadline;
mod effort;
mod export;
mod fit;
mod forget;
mod keys;
mod manual;
mod output;
mod plan;
mod progress;
mod query;
mod render;
mod replay;
mod run;
mod status;
mod talk;
mod threshold;

use crate::cli::talk::write_file;
use crate::parameters::shown;
use crate::report::raster::png;
use crate::store;
use clap::{ColorChoice, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Once;

/// How much larger than its SVG a PNG is.
const PNG_ZOOM: f32 = 2.0;

/// What a subcommand returns: how to exit, or an error to be shown.
type CommandResult = Result<Exit, Box<dyn Error>>;

/// Campaigns of droplet simulations: flow and clogging of capillary droplets.
#[derive(Debug, Parser)]
#[command(
    version,
    about,
    after_help = "\
Start with:  meniscus run campaigns/quickstart.toml
To cite:     this program with its version, and Cheng et al., Soft Matter 20, 8036 (2024); see CITATION.cff"
)]
struct Cli {
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
    /// Write all tables as files for pandas, polars, DuckDB, R: Parquet or CSV, with a manifest
    Export(export::Arguments),
    /// Fit decay lengths and mean speeds to all finished runs
    Fit(fit::Arguments),
    /// Compare points of a grid seed by seed: ratios of decay lengths and of mean speeds
    Compare(compare::Arguments),
    /// Draw a droplet among its obstacles: SVG, PNG, or GIF
    Render(render::Arguments),
    /// Check a store: checksums, counts, rows, orphans; with --repair put it right
    Check(check::Arguments),
    /// Take a campaign out of a store, into its quarantine; nothing is lost
    Forget(forget::Arguments),
    /// Measure what accuracy costs: errors, orders, and error against time
    Accuracy(accuracy::Arguments),
    /// Run what a failed job left behind, and see whether it fails again
    Replay(replay::Arguments),
    /// Find line tension and near-wall drag of a droplet from an experiment's frames
    Calibrate(calibrate::Arguments),
    /// Say which droplets of a campaign can pass, by statics alone: Gamma_c of each channel and gap
    Threshold(threshold::Arguments),
    /// Say what may stand in a campaign file: every key with its unit, range and default
    Keys(keys::Arguments),
    /// Write the JSON Schema of campaign files, by which editors complete and check them
    Schema(manual::Schema),
    /// Write the completions of a shell
    Completions(manual::Completions),
    /// Write the manual as man pages
    Man(manual::Manual),
}

/// Reads the command line, does what it asks for, and says how it went.
pub fn main() -> ExitCode {
    let cli = parse(std::env::args_os());
    talk::log_to_stderr(cli.quiet, cli.verbose);
    cli.exit().into()
}

/// Does what a command line asks for, whose first word is the name of the program, and returns the exit code. Unlike
/// [`main`] it may be called again and again.
pub fn obey(command_line: impl IntoIterator<Item = OsString>) -> u8 {
    static LOGS: Once = Once::new();
    LOGS.call_once(|| talk::log_to_stderr(false, 0));
    parse(command_line).exit() as u8
}

/// Reads the command line. What clap says of it has no colour where nothing else has.
fn parse(command_line: impl IntoIterator<Item = OsString>) -> Cli {
    let colour = if talk::colour() { ColorChoice::Auto } else { ColorChoice::Never };
    let matches = Cli::command().color(colour).get_matches_from(command_line);
    Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
}

impl Cli {
    /// Runs the subcommand, and says what went wrong.
    fn exit(&self) -> Exit {
        self.run().unwrap_or_else(|error| {
            talk::complain(error.as_ref());
            Exit::Error
        })
    }

    /// Runs the subcommand.
    fn run(&self) -> CommandResult {
        match &self.command {
            Command::Run(arguments) => arguments.run(self.quiet),
            Command::Plan(arguments) => arguments.run(),
            Command::Status(arguments) => arguments.run(),
            Command::Query(arguments) => arguments.run(self.quiet),
            Command::Export(arguments) => arguments.run(),
            Command::Fit(arguments) => arguments.run(self.quiet),
            Command::Compare(arguments) => arguments.run(),
            Command::Render(arguments) => arguments.run(self.quiet),
            Command::Check(arguments) => arguments.run(self.quiet),
            Command::Forget(arguments) => arguments.run(self.quiet),
            Command::Accuracy(arguments) => arguments.run(self.quiet),
            Command::Replay(arguments) => arguments.run(),
            Command::Calibrate(arguments) => arguments.run(self.quiet),
            Command::Threshold(arguments) => arguments.run(self.quiet),
            Command::Keys(arguments) => arguments.run(),
            Command::Schema(arguments) => arguments.run(),
            Command::Completions(arguments) => arguments.run(),
            Command::Man(arguments) => arguments.run(),
        }
    }
}

/// Exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
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

/// `svg` or `png`, by the name of a picture.
fn picture_kind(path: &Path) -> Result<&'static str, String> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    let kind = ["svg", "png"].into_iter().find(|kind| *kind == extension);
    kind.ok_or_else(|| format!("{} is not a picture that can be written: name it .svg or .png", shown(path)))
}

/// Writes a picture, given as SVG, in the form that the name of its file asks for.
fn write_picture(path: &Path, svg: &str) -> Result<(), Box<dyn Error>> {
    match picture_kind(path)? {
        "png" => write_file(path, png(svg, PNG_ZOOM)?)?,
        _ => write_file(path, svg)?,
    }
    Ok(())
}

/// The store asked for, or `NAME.meniscus` in the current directory.
fn store_of(asked: Option<&Path>, campaign: &str) -> PathBuf {
    asked.map_or_else(|| PathBuf::from(format!("{campaign}.meniscus")), whole_store)
}

/// The store at a path, or the one that the path lies in, as `store.db` and `samples/` do.
fn whole_store(path: &Path) -> PathBuf {
    store::around(path).unwrap_or_else(|| path.to_owned())
}

/// The store asked for, or the only one in the current directory, or the one that the current directory is in.
fn store_here(asked: Option<&Path>) -> Result<PathBuf, Box<dyn Error>> {
    if let Some(dir) = asked {
        return Ok(whole_store(dir));
    }
    let is_store = |path: &PathBuf| path.extension().is_some_and(|e| e == "meniscus") && path.is_dir();
    let paths = std::fs::read_dir(".")?.filter_map(|entry| Some(PathBuf::from(entry.ok()?.file_name())));
    let mut found: Vec<PathBuf> = paths.filter(is_store).collect();
    found.sort();
    match (found.pop(), found.len()) {
        (Some(only), 0) => Ok(only),
        (None, _) if store::is_there(Path::new(".")) => Ok(PathBuf::from(".")),
        (None, _) => store::around(Path::new(".")).ok_or_else(|| {
            "no store NAME.meniscus in this folder; name one, or start one with `meniscus run CAMPAIGN.toml`".into()
        }),
        (Some(_), others) => Err(format!("{} stores in this folder; name the one you mean", others + 1).into()),
    }
}

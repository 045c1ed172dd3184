//! `meniscus check [DIR]`: finds what is damaged or missing in a store, and repairs it if asked to.

use crate::cli::talk::{print, say, typed};
use crate::cli::{CommandResult, Exit, store_here};
use crate::store::{CheckReport, check, repair};
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// Move what is broken to quarantine/ and set its jobs back to pending; nothing is removed
    #[arg(long)]
    repair: bool,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let dir = store_here(self.store.as_deref())?;
        let report = if self.repair { repair(&dir)? } else { check(&dir)? };
        print(described(&report))?;
        let CheckReport { findings, notes, jobs, files, repaired } = &report;
        notes.iter().for_each(|note| say(format!("note: {note}")));
        if !quiet {
            let dir = typed(&dir);
            say(match (findings.len(), repaired) {
                (0, _) => format!("{dir}: nothing is wrong with {jobs} jobs and {files} sample files"),
                (found, false) => format!("{dir}: {found} found; next: meniscus check {dir} --repair"),
                (found, true) => format!("{dir}: {found} found and put right; next: meniscus run CAMPAIGN.toml"),
            });
        }
        Ok(if findings.is_empty() { Exit::Done } else { Exit::Error })
    }
}

/// Two lines per finding: what is wrong with which file, and what is done about it.
fn described(report: &CheckReport) -> String {
    let mut text = String::new();
    for finding in &report.findings {
        let _ = writeln!(text, "{}: {}\n    {}", finding.file.display(), finding.problem, finding.cure);
    }
    text
}

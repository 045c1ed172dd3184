//! `meniscus check [DIR]`: whether a store is what it should be.

use crate::cli::{Exit, Outcome, print, store_here};
use crate::store::{CheckReport, check, repair};
use std::fmt::Write;
use std::path::PathBuf;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// Move what is broken to quarantine/ and set its jobs back to pending; nothing is removed
    #[arg(long)]
    repair: bool,
}

impl Arguments {
    /// Runs the subcommand.
    pub fn run(&self, quiet: bool) -> Outcome {
        let dir = store_here(self.store.as_deref())?;
        let report = if self.repair { repair(&dir)? } else { check(&dir)? };
        print(&described(&report))?;
        let CheckReport { findings, notes, jobs, files, repaired } = &report;
        notes.iter().for_each(|note| eprintln!("note: {note}"));
        if !quiet {
            // As people type it.
            let dir = dir.strip_prefix(".").unwrap_or(&dir).display();
            match (findings.len(), repaired) {
                (0, _) => eprintln!("{dir}: nothing is wrong with {jobs} jobs and {files} sample files"),
                (found, false) => eprintln!("{dir}: {found} found; next: meniscus check {dir} --repair"),
                (found, true) => eprintln!("{dir}: {found} found and put right; next: meniscus run CAMPAIGN.toml"),
            }
        }
        Ok(if findings.is_empty() { Exit::Done } else { Exit::Error })
    }
}

/// What was found, a line each, with what is done about it below.
fn described(report: &CheckReport) -> String {
    let mut text = String::new();
    for finding in &report.findings {
        let _ = writeln!(text, "{}: {}\n    {}", finding.file.display(), finding.problem, finding.cure);
    }
    text
}

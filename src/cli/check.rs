//! `meniscus check [DIR]`: finds what is damaged or missing in a store, and repairs it if asked to.

use crate::cli::output::deliver;
use crate::cli::talk::{say, typed};
use crate::cli::{CommandResult, Exit, store_here};
use crate::parameters::{plain, shown};
use crate::store::{CheckReport, ColumnKind, Finding, Format, Value, check, repair, write_rows};
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// Move what is broken to quarantine/ and set its jobs back to pending; nothing is removed
    #[arg(long)]
    repair: bool,
    /// How to write the findings: table (in words), or a row for each as csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let dir = store_here(self.store.as_deref())?;
        let report = if self.repair { repair(&dir)? } else { check(&dir)? };
        deliver(self.format, None, |out: &mut dyn Write| match self.format {
            Format::Table => out.write_all(described(&report).as_bytes()),
            format => write_rows(&COLUMNS, report.findings.iter().map(row), format, out),
        })?;
        let CheckReport { findings, notes, jobs, files, repaired } = &report;
        notes.iter().for_each(|note| say(format!("note: {}", plain(note))));
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
    let line = |Finding { file, problem, cure }: &Finding| {
        format!("{}: {}\n    {}\n", shown(file), plain(problem), plain(cure))
    };
    report.findings.iter().map(line).collect()
}

const COLUMNS: [(&str, ColumnKind); 3] =
    [("file", ColumnKind::Text), ("problem", ColumnKind::Text), ("cure", ColumnKind::Text)];

fn row(finding: &Finding) -> Vec<Value> {
    vec![
        finding.file.to_string_lossy().into_owned().into(),
        finding.problem.clone().into(),
        finding.cure.clone().into(),
    ]
}

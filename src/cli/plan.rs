//! `meniscus plan CAMPAIGN.toml`: what a campaign would do; writes nothing.

use crate::campaign::file::Campaign;
use crate::cli::talk::print;
use crate::cli::{CommandResult, Exit, store_of};
use crate::execute::{self, Options};
use crate::report::text_table;
use std::path::PathBuf;

/// Width of the labels on the left of a plan.
const LABELS: usize = 11;

/// Arguments of `plan`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The campaign file
    campaign: PathBuf,
    /// The store [default: NAME.meniscus in this folder]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads to estimate the time for [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let campaign = Campaign::load(&self.campaign)?;
        let plan = execute::plan(&campaign, &store_of(self.store.as_deref(), &campaign.name))?;
        let text = plan.render(self.threads.map_or_else(|| Options::default().threads, usize::from));
        print(text_table::hanging(&text, LABELS))?;
        Ok(Exit::Done)
    }
}

//! `meniscus plan CAMPAIGN.toml`: what a campaign would do; writes nothing.

use crate::campaign::file::Campaign;
use crate::campaign::plan::{KnownJobs, plan};
use crate::cli::run::{this_round, threads};
use crate::cli::{Exit, Outcome, print, store_of};
use crate::execute::machine_speed;
use crate::physics::simd;
use crate::store::job_states;
use std::path::PathBuf;

/// Arguments of `plan`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
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
    pub fn run(&self) -> Outcome {
        let campaign = Campaign::load(&self.campaign)?;
        let dir = store_of(self.store.as_deref(), &campaign.name);
        let campaign = this_round(&campaign, &dir)?;
        let known = KnownJobs::new(job_states(&dir)?);
        let plan = plan(&campaign, &known, &machine_speed::measure(simd::best_instruction_set()));
        print(&plan.render(threads(self.threads)))?;
        Ok(Exit::Done)
    }
}

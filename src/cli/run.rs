//! `meniscus run CAMPAIGN.toml`: plans, runs, goes on, and ends with the tables.

use crate::campaign::durations;
use crate::campaign::file::Campaign;
use crate::cli::effort::{Effort, remark_on, tell_stopped};
use crate::cli::progress::Display;
use crate::cli::talk::{print, say, typed};
use crate::cli::{CommandResult, Exit, fit};
use crate::execute::{self, Options, Retry, RunReport};
use crate::results::trajectory::FailureClass;
use std::collections::HashSet;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The campaign file
    campaign: PathBuf,
    #[command(flatten)]
    effort: Effort,
    /// Save trajectories under way after every so much time
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = durations::parse)]
    checkpoint_every: Duration,
    /// Run failed jobs of this class again: unstable, engulfed, crossed, panicked, io, bad_input, or all
    #[arg(long, value_name = "CLASS", value_parser = parse_retry)]
    retry: Option<Retry>,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let options = Options {
            checkpoint_every: self.checkpoint_every,
            retry: self.retry.unwrap_or_default(),
            ..self.effort.options()?
        };
        let campaign = Campaign::load(&self.campaign)?;
        let dir = self.effort.store(&campaign.name);
        let mut display = Display::new(&dir, quiet, self.effort.remark());
        let (done, failed) = match execute::run(&campaign, &dir, &options, |event| display.show(event))? {
            RunReport::Complete { done, failed } => (done, failed),
            RunReport::Stopped(stopped) => {
                let command = self.effort.command("meniscus run", &self.campaign);
                let again = format!("{command}{}", remark_on(&self.campaign));
                let retry = format!("{command} --retry");
                return tell_stopped(&stopped, &dir, quiet, &again, Some(&retry));
            }
        };
        let mine: HashSet<_> = campaign.blocks.iter().flat_map(|block| block.point_ids.iter().copied()).collect();
        print(&fit::tables(&dir, |id| mine.contains(&id))?)?;
        let (exit, how) = if failed > 0 {
            let query = format!("meniscus query {} \"select * from failures\"", typed(&dir));
            (Exit::FailedJobs, format!("{done} jobs are done, {failed} failed; see them with: {query}"))
        } else {
            (Exit::Done, format!("all {done} jobs are done; the results are in {}", typed(&dir)))
        };
        if !quiet {
            say(how);
        }
        Ok(exit)
    }
}

fn parse_retry(text: &str) -> Result<Retry, String> {
    if text == "all" {
        return Ok(Retry::All);
    }
    let class = FailureClass::from_name(text).map(Retry::Only);
    class.ok_or_else(|| {
        format!("`{text}` is not a class: choose unstable, engulfed, crossed, panicked, io, bad_input, or all")
    })
}

//! `meniscus run CAMPAIGN.toml`: plans, runs, goes on, and ends with the tables.

use crate::campaign::durations;
use crate::campaign::file::Campaign;
use crate::cli::effort::{Effort, remark_on, tell_stopped};
use crate::cli::fit::Asked;
use crate::cli::progress::Display;
use crate::cli::talk::{print, say, typed};
use crate::cli::{CommandResult, Exit, fit};
use crate::execute::{self, Options, Retry, RunReport};
use crate::results::trajectory::FailureClass;
use crate::study::fits::FittedPoint;
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
        let asked = asked(&campaign);
        let from = campaign.fit_from;
        let tables = || fit::fit(&dir, quiet, from, |id| asked.contains_key(&id), |fits| print_tables(fits, &asked));
        let mut display = Display::new(&dir, quiet, self.effort.remark());
        let (done, failed) = match execute::run(&campaign, &dir, &options, |event| display.show(event))? {
            RunReport::Complete { done, failed } => (done, failed),
            RunReport::Stopped(stopped) => {
                let command = self.effort.command("meniscus run", &self.campaign);
                let again = format!("{command}{}", remark_on(&self.campaign));
                let retry = format!("{command} --retry");
                let exit = tell_stopped(&stopped, &dir, quiet, &again, Some(&retry))?;
                // All is saved, so how the run ended is what counts.
                if let Err(error) = tables() {
                    say(format!("note: the tables of what is finished could not be made: {error}"));
                }
                return Ok(exit);
            }
        };
        tables()?;
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

/// The seeds that a campaign may ask for at each point, of all blocks that have it.
fn asked(campaign: &Campaign) -> Asked {
    let mut asked = Asked::new();
    for block in &campaign.blocks {
        let most = block.until.map_or(0, |until| block.seeds.start + until.max_runs);
        let seeds = block.seeds.start..block.seeds.end.max(most);
        for &point in &block.point_ids {
            let all = asked.entry(point).or_insert_with(|| seeds.clone());
            *all = all.start.min(seeds.start)..all.end.max(seeds.end);
        }
    }
    asked
}

fn print_tables(fits: &[FittedPoint<'_>], asked: &Asked) -> CommandResult {
    print(fit::tables(fits, Some(asked)))?;
    Ok(Exit::Done)
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

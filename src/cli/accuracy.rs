//! `meniscus accuracy`: what each digit costs, measured on this machine.

use crate::campaign::durations::written_s;
use crate::campaign::file::Campaign;
use crate::cli::effort::{Effort, lasts, remark_on, tell_stopped};
use crate::cli::progress::Display;
use crate::cli::talk::{print, say, typed, write_file};
use crate::cli::{CommandResult, Exit, picture_kind, write_picture};
use crate::execute::{self, RunReport};
use crate::parameters::{JobId, PointId};
use crate::report::accuracy::{Origin, page, text};
use crate::report::error_plot;
use crate::results::fits::RunRecord;
use crate::store::{Origins, StoreError, origins, records};
use crate::study::accuracy::{self, Accuracy, parts};
use std::collections::HashMap;
use std::error::Error;
use std::path::{Path, PathBuf};

/// The campaigns that come with the program: under ten minutes on two quiet cores, and a night.
const SHORT: &str = include_str!("../../campaigns/accuracy.toml");
const FULL: &str = include_str!("../../campaigns/accuracy_full.toml");

/// Arguments of `accuracy`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Runs one scene after another over N_v, dt, integrator, kappa, eps, wall stiffness and threshold, each varied alone, and
shows errors, observed orders, time per t0, and the front of error against time. The runs are a campaign like any other:
stop it, type it again and it goes on; a second call computes nothing. Times are those of the runs in the store: to
measure them anew, remove it.

`tolerance = 0.01` in a campaign file takes the cheapest setting of n_vertices, dt and integrator whose error is at most
that. The error is the largest relative error of the headline observables: A_max - 1 and transit time in channels, <v_g>
in arrays of gaps as wide as a droplet, lambda in narrower ones. --record writes the table that `tolerance` reads.")]
pub(super) struct Arguments {
    /// Another campaign, its blocks named SCENE.KNOB as those of campaigns/accuracy.toml are
    campaign: Option<PathBuf>,
    /// The size for a night: finer rings, more arrays, longer ways
    #[arg(long, conflicts_with = "campaign")]
    full: bool,
    #[command(flatten)]
    effort: Effort,
    /// Write everything as a Markdown page, its plot as SVG and PNG beside it
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
    /// Draw the plot: .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Vec<PathBuf>,
    /// Write the table that `tolerance` reads
    #[arg(long, value_name = "FILE.toml")]
    record: Option<PathBuf>,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let options = self.effort.options()?;
        let campaign = match (&self.campaign, self.full) {
            (Some(path), _) => Campaign::load(path)?,
            (None, true) => Campaign::parse("campaigns/accuracy_full.toml", FULL)?,
            (None, false) => Campaign::parse("campaigns/accuracy.toml", SHORT)?,
        };
        campaign.blocks.iter().try_for_each(|block| parts(&block.name).map(drop))?;
        self.plot.iter().try_for_each(|path| picture_kind(path).map(drop))?;
        let dir = self.effort.store(&campaign.name);
        tell_cost(&campaign, &dir, options.threads, quiet)?;
        let mut display = Display::new(&dir, quiet, self.effort.remark());
        let report = execute::run(&campaign, &dir, &options, |event| display.show(event))?;
        let accuracy = accuracy::judge(&campaign, &runs(&campaign, &dir)?)?;
        print(text(&accuracy))?;
        match report {
            RunReport::Complete { .. } => {
                self.write(&campaign, &dir, &accuracy)?;
                Ok(Exit::Done)
            }
            RunReport::Stopped(stopped) => {
                let remark = self.campaign.as_deref().map_or("", remark_on);
                let again = format!("{}{}{remark}", self.command(), self.effort.again());
                tell_stopped(&stopped, &dir, quiet, &again, None)
            }
        }
    }

    /// The command, apart from where things are kept.
    fn command(&self) -> String {
        let campaign = match &self.campaign {
            Some(path) if lasts(path) => format!(" {}", typed(path)),
            Some(_) => " CAMPAIGN.toml".to_owned(),
            None => String::new(),
        };
        format!("meniscus accuracy{}{campaign}", if self.full { " --full" } else { "" })
    }

    /// Writes the page, the plots and the table that were asked for.
    fn write(&self, campaign: &Campaign, dir: &Path, accuracy: &Accuracy) -> Result<(), Box<dyn Error>> {
        let svg = error_plot::svg(&accuracy.fronts);
        let mut plots = self.plot.clone();
        if let Some(file) = &self.markdown {
            plots.extend(["svg", "png"].map(|kind| file.with_extension(kind)));
            let picture = file.with_extension("svg").file_name().unwrap_or_default().to_string_lossy().into_owned();
            let command = format!("{} --markdown {}", self.command(), typed(file));
            let origin = Origin { campaign: campaign.name.clone(), measured: measured(dir)?, command, picture };
            write_file(file, page(accuracy, &origin))?;
        }
        for path in &plots {
            write_picture(path, &svg)?;
        }
        if let Some(path) = &self.record {
            let table = toml::to_string(&accuracy.table(measured(dir)?))?;
            let head = "# The settings that `tolerance` chooses among; written by `meniscus accuracy --record`.\n\n";
            write_file(path, head.to_owned() + &table)?;
        }
        Ok(())
    }
}

/// Says how long the runs that are left take, if there are any.
fn tell_cost(campaign: &Campaign, dir: &Path, threads: usize, quiet: bool) -> Result<(), Box<dyn Error>> {
    let plan = execute::plan(campaign, dir)?;
    if let (Some(cost), false, false) = (plan.cost(), quiet, plan.jobs.is_empty()) {
        let time = written_s(cost.wall_s(threads));
        say(format!("{} runs, about {time} on {threads} threads", plan.jobs.len()));
    }
    Ok(())
}

/// What the store holds of each point, its runs by seed; time series only where something is read off them.
fn runs(campaign: &Campaign, dir: &Path) -> Result<HashMap<PointId, Vec<RunRecord>>, Box<dyn Error>> {
    let mut all = HashMap::new();
    for block in &campaign.blocks {
        let (scene, _) = parts(&block.name)?;
        let of_point = |&point: &PointId| block.seeds.clone().map(move |seed| JobId::new(point, seed));
        let ids: Vec<JobId> = block.point_ids.iter().flat_map(of_point).collect();
        let mut found = records(dir, &ids, scene.needs_samples())?.into_iter();
        let seeds = block.seeds.clone().count();
        for &point in &block.point_ids {
            all.insert(point, found.by_ref().take(seeds).flatten().collect());
        }
    }
    Ok(all)
}

/// This machine, and the days and commits of the runs.
fn measured(dir: &Path) -> Result<String, StoreError> {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or("an unknown processor", |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let instruction_set = format!("{:?}", crate::physics::simd::best_instruction_set());
    let instruction_set = instruction_set.split('(').next().unwrap_or_default();
    let Origins { commits, days } = origins(dir)?;
    Ok(format!("{model}, {cores} cores, {instruction_set}, {days}, commit {commits}"))
}

//! `meniscus plan CAMPAIGN.toml`: what a campaign would do; writes nothing.

use crate::campaign::file::Campaign;
use crate::campaign::plan::BlockPlan;
use crate::cli::output::deliver;
use crate::cli::{CommandResult, store_of};
use crate::execute::{self, Options};
use crate::report::text_table;
use crate::store::ColumnKind::{self, Number, Text, Whole};
use crate::store::{Format, Value, write_rows};
use std::io::Write;
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
    /// How to write the plan: table (in words), or a row for each block as csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let campaign = Campaign::load(&self.campaign)?;
        let plan = execute::plan(&campaign, &store_of(self.store.as_deref(), &campaign.name))?;
        let threads = self.threads.map_or_else(|| Options::default().threads, usize::from);
        deliver(self.format, None, |out: &mut dyn Write| match self.format {
            Format::Table => out.write_all(text_table::hanging(&plan.render(threads), LABELS).as_bytes()),
            format => write_rows(&COLUMNS, plan.blocks.iter().map(|block| row(block, threads)), format, out),
        })
    }
}

const COLUMNS: [(&str, ColumnKind); 19] = [
    ("block", Text),
    ("model", Text),
    ("scene", Text),
    ("points", Whole),
    ("runs_per_point", Whole),
    ("new", Whole),
    ("pending", Whole),
    ("running", Whole),
    ("done", Whole),
    ("failed", Whole),
    ("shared", Whole),
    ("dt_min", Number),
    ("dt_max", Number),
    ("dt_limit_min", Number),
    ("dt_limit_max", Number),
    ("cpu_s", Number),
    ("longest_s", Number),
    ("wall_s", Number),
    ("cost_by_distance", Whole),
];

/// The values of [`COLUMNS`]; times in t0, costs in seconds.
fn row(block: &BlockPlan, threads: usize) -> Vec<Value> {
    let (counts, cost) = (&block.counts, &block.cost);
    let mut row = vec![
        Value::from(block.name.clone()),
        block.model.to_owned().into(),
        block.scene.to_owned().into(),
        (block.points as i64).into(),
    ];
    let whole = [block.runs, counts.new, counts.pending, counts.running, counts.done, counts.failed, counts.shared];
    row.extend(whole.map(|count| Value::from(count as i64)));
    let [dt, limit] = [block.dt, block.dt_limit];
    let numbers = [dt.low, dt.high, limit.low, limit.high, cost.total_s, cost.longest_s, cost.wall_s(threads)];
    row.extend(numbers.map(Value::from));
    row.push(cost.by_distance.into());
    row
}

//! `meniscus compare DIR --over KEY`: by how much neighbouring points of a grid differ, seed by seed.

use crate::cli::fit::displacement;
use crate::cli::output::deliver;
use crate::cli::{CommandResult, store_here};
use crate::parameters::{PARAMETERS, Short};
use crate::report::comparison::{COLUMNS, pairs, rows, text, values as values_of};
use crate::store::{Format, StoreError, open_reading, point_runs, write_rows};
use crate::study::series::axes;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Points whose arrays have the same parameters share the obstacles and the start of a seed, so their ratio is known better than
either number. Along the axis each point is compared with the next one, or two values are compared:

  meniscus compare clogging_sp.meniscus --over e_w
  meniscus compare clogging_sp.meniscus --over e_w --values 5 20")]
pub(super) struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// The parameter in which the points differ
    #[arg(long, value_name = "KEY", value_parser = axis)]
    over: &'static str,
    /// Compare these two values of it, instead of neighbours
    #[arg(long, value_name = "VALUE", num_args = 2, allow_negative_numbers = true)]
    values: Vec<f64>,
    /// Begin decay lengths at this displacement, in sigma
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0, value_parser = displacement)]
    from: f64,
    /// How to write the ratios: table, or a row for each pair as csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
}

/// A parameter that is a number.
fn axis(text: &str) -> Result<&'static str, String> {
    let known = PARAMETERS.iter().find(|parameter| parameter.name == text && parameter.instead_of.is_none());
    known.map(|parameter| parameter.name).ok_or_else(|| "it is no parameter; see `meniscus keys`".to_owned())
}

impl Arguments {
    /// Why nothing can be compared, and what can.
    fn no_pair(&self, known: &[f64], keys: &[&str]) -> String {
        let key = self.over;
        match known {
            [] if keys.is_empty() => "no two points of the store differ in one key alone".to_owned(),
            [] => format!("no two points of the store differ in {key} alone; they do in {}", keys.join(", ")),
            known => {
                let shown: Vec<String> = known.iter().map(|value| Short(*value).to_string()).collect();
                format!("no two points have these values of {key}; there are: {}", shown.join(", "))
            }
        }
    }

    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let dir = store_here(self.store.as_deref())?;
        let points = point_runs(&open_reading(&dir)?.ok_or_else(|| StoreError::Missing(dir.clone()))?)?;
        let values = <[f64; 2]>::try_from(&self.values[..]).ok();
        let pairs = pairs(&points, self.over, values, self.from);
        if pairs.is_empty() {
            return Err(self.no_pair(&values_of(&points, self.over), &axes(&points, 2)).into());
        }
        deliver(self.format, None, |out: &mut dyn Write| match self.format {
            Format::Table => out.write_all(text(&pairs, self.over, self.from).as_bytes()),
            format => write_rows(&COLUMNS, rows(&pairs, self.over), format, out),
        })
    }
}

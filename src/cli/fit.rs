//! `meniscus fit DIR`: decay lengths and mean speeds of all finished runs, printed, and kept in the store where nothing
//! forbids that.

use crate::cli::output::deliver;
use crate::cli::talk::say;
use crate::cli::{CommandResult, store_here};
use crate::parameters::PointId;
use crate::report::comparison::monotony;
use crate::report::tables::{decay_lengths, further_runs, mean_speeds};
use crate::store::{Format, Store, StoreError, open_reading, point_runs, save_fits, write_fits};
use crate::study::fits::{FittedPoint, fit_all};
use std::collections::HashMap;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Arguments of `fit`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
    /// How to write the fits: table, or a row for each point as csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
    /// Begin decay lengths at this displacement, in sigma. Before it droplets still feel the gap in which they start
    #[arg(long, value_name = "SIGMA", default_value_t = 0.0, value_parser = displacement)]
    from: f64,
}

/// A displacement, at least zero.
pub(super) fn displacement(text: &str) -> Result<f64, String> {
    let number = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    let is_sound = (0.0..=1e6).contains(&number);
    is_sound.then_some(number).ok_or_else(|| "it must be from 0 to 1e6".to_owned())
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let dir = store_here(self.store.as_deref())?;
        fit(
            &dir,
            quiet,
            self.from,
            |_| true,
            |fits| {
                deliver(self.format, None, |out: &mut dyn Write| match self.format {
                    Format::Table => out.write_all(tables(fits, None).as_bytes()),
                    format => write_fits(fits, format, out),
                })
            },
        )
    }
}

/// The seeds that a campaign asks for, by point.
pub(super) type Asked = HashMap<PointId, Range<u64>>;

/// Fits every point of the store in `dir`, and hands those that are `wanted` to `show`. The fits are saved in the
/// store; where another process writes it, or nobody may write it, they are only shown, and this is said.
pub(super) fn fit(
    dir: &Path,
    quiet: bool,
    from: f64,
    wanted: impl Fn(PointId) -> bool,
    show: impl FnOnce(&[FittedPoint<'_>]) -> CommandResult,
) -> CommandResult {
    let (mut store, mut unsaved) = match Store::open_existing(dir) {
        Ok(store) => (Some(store), None),
        Err(error) if error.forbids_writing_alone() => (None, Some(error)),
        Err(error) => return Err(error.into()),
    };
    let points = match &store {
        Some(store) => point_runs(store.connection())?,
        None => point_runs(&open_reading(dir)?.ok_or_else(|| StoreError::Missing(dir.to_owned()))?)?,
    };
    let mut fits = fit_all(&points, from);
    if let Some(store) = &mut store {
        match save_fits(store, &fits) {
            Err(error) if error.forbids_writing_alone() => unsaved = Some(error),
            saved => saved?,
        }
    }
    // What follows may wait for a reader, and others may want the store.
    drop(store);
    fits.retain(|fit| wanted(fit.point.point_id));
    if fits.is_empty() && !quiet {
        say("no run is finished yet, so there is nothing to fit");
    }
    let exit = show(&fits)?;
    if let Some(error) = unsaved.filter(|_| !quiet) {
        say(format!(
            "note: these fits are not kept in the store, so lambda_fits, speed_averages and survival stay as they were: {error}"
        ));
    }
    Ok(exit)
}

/// Both tables, and where they use more runs than a campaign asks for; nothing where there is nothing.
pub(super) fn tables(fits: &[FittedPoint<'_>], asked: Option<&Asked>) -> String {
    let further = asked.map(|asked| further_runs(fits, asked)).unwrap_or_default();
    let [first, ..] = fits else { return String::new() };
    let points: Vec<_> = fits.iter().map(|fit| fit.point).collect();
    let monotony = monotony(&points, first.lambda.r_from);
    format!("{}{monotony}\n{}{further}", decay_lengths(fits), mean_speeds(fits))
}

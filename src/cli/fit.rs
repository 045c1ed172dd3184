//! `meniscus fit DIR`: decay lengths and mean speeds of all finished runs, kept in the store and printed.

use crate::cli::talk::print;
use crate::cli::{CommandResult, Exit, store_here};
use crate::parameters::PointId;
use crate::report::tables::{decay_lengths, mean_speeds};
use crate::store::{Store, point_runs, save_fits};
use crate::study::fits::fit_all;
use std::error::Error;
use std::path::{Path, PathBuf};

/// Arguments of `fit`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store [default: the only one in this folder]
    store: Option<PathBuf>,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        print(&tables(&store_here(self.store.as_deref())?, |_| true)?)?;
        Ok(Exit::Done)
    }
}

/// Fits every point of the store in `dir`, saves the fits there, and returns the tables of those points that are
/// `wanted`.
pub(super) fn tables(dir: &Path, wanted: impl Fn(PointId) -> bool) -> Result<String, Box<dyn Error>> {
    if crate::store::open_reading(dir)?.is_none() {
        return Err(crate::store::StoreError::Missing(dir.to_owned()).into());
    }
    let mut store = Store::open(dir)?;
    let points = point_runs(store.connection())?;
    let mut fits = fit_all(&points);
    let lambdas: Vec<_> = fits.iter().map(|fit| (fit.point.point_id, fit.lambda)).collect();
    let speeds: Vec<_> = fits.iter().map(|fit| (fit.point.point_id, fit.speed)).collect();
    save_fits(&mut store, &lambdas, &speeds)?;
    fits.retain(|fit| wanted(fit.point.point_id));
    Ok(format!("{}\n{}", decay_lengths(&fits), mean_speeds(&fits)))
}

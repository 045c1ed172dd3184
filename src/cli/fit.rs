//! `meniscus fit DIR`: decay lengths and mean speeds of all finished runs, kept in the store and printed.

use crate::cli::talk::print;
use crate::cli::{CommandResult, Exit, store_here};
use crate::parameters::PointId;
use crate::report::tables::{decay_lengths, further_runs, mean_speeds};
use crate::store::{Store, StoreError, open_reading, point_runs, save_fits};
use crate::study::fits::fit_all;
use std::collections::HashMap;
use std::error::Error;
use std::ops::Range;
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
        print(&tables(&store_here(self.store.as_deref())?, None)?)?;
        Ok(Exit::Done)
    }
}

/// The seeds that a campaign asks for, by point.
pub(super) type Asked = HashMap<PointId, Range<u64>>;

/// Fits every point of the store in `dir`, saves the fits there, and returns the tables: of all points, or of those
/// that a campaign asks for.
pub(super) fn tables(dir: &Path, asked: Option<&Asked>) -> Result<String, Box<dyn Error>> {
    match open_reading(dir) {
        Ok(None) => return Err(StoreError::Missing(dir.to_owned()).into()),
        // Opening it for writing upgrades it.
        Ok(Some(_)) | Err(StoreError::Older { .. }) => {}
        Err(error) => return Err(error.into()),
    }
    let mut store = Store::open(dir)?;
    let points = point_runs(store.connection())?;
    let mut fits = fit_all(&points);
    let lambdas: Vec<_> = fits.iter().map(|fit| (fit.point.point_id, fit.lambda)).collect();
    let speeds: Vec<_> = fits.iter().map(|fit| (fit.point.point_id, fit.speed)).collect();
    save_fits(&mut store, &lambdas, &speeds)?;
    fits.retain(|fit| asked.is_none_or(|asked| asked.contains_key(&fit.point.point_id)));
    let further = asked.map(|asked| further_runs(&fits, asked)).unwrap_or_default();
    Ok(format!("{}\n{}{further}", decay_lengths(&fits), mean_speeds(&fits)))
}

//! `meniscus export DIR OUT`: a store as plain files for other programs.

use crate::cli::talk::print;
use crate::cli::{CommandResult, Exit};
use crate::parameters::shown;
use crate::store::{Format, export};
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store
    store: PathBuf,
    /// A new or empty folder for the files
    out: PathBuf,
    /// What files to write: parquet or csv
    #[arg(long, default_value = "parquet", value_parser = ["parquet", "csv"])]
    format: String,
}

impl Arguments {
    /// Runs the subcommand: writes the files and lists them.
    pub(super) fn run(&self) -> CommandResult {
        let format: Format = self.format.parse()?;
        for file in export(&self.store, &self.out, format)? {
            let rows = file.rows.map_or_else(String::new, |rows| format!("{rows} rows, "));
            print(format!("{}  {rows}{} bytes\n", shown(&file.path), file.bytes))?;
        }
        Ok(Exit::Done)
    }
}

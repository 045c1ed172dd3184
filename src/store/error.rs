//! What can go wrong with a store, each with the place and the next step.

use crate::parameters::JobId;
use crate::store::holder::Holder;
use rusqlite::ErrorCode;
use std::path::{Path, PathBuf};

/// An operation on a store that failed.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder holds no store.
    #[error("no store at {}: `meniscus run CAMPAIGN.toml` creates one", .0.display())]
    Missing(PathBuf),
    /// There is something else than a folder.
    #[error("{} is {what}, and a store is a folder: {way_out}", path.display())]
    NoFolder {
        /// What was named.
        path: PathBuf,
        /// What it is.
        what: String,
        /// The next step.
        way_out: &'static str,
    },
    /// Another process writes this store.
    #[error(
        "{} is in use by {holder}: wait for it, stop it, or name another folder with --store",
        dir.display()
    )]
    Locked {
        /// Folder of the store.
        dir: PathBuf,
        /// Who holds it.
        holder: Holder,
    },
    /// A later program wrote this store.
    #[error(
        "{} has schema {found}, this program knows schemas up to {known}: use the newer meniscus that wrote it",
        path.display()
    )]
    Newer {
        /// The database.
        path: PathBuf,
        /// Its schema.
        found: usize,
        /// The latest schema of this program.
        known: usize,
    },
    /// An earlier program wrote this store, and reading must not change it.
    #[error(
        "{} has the older schema {found}: `meniscus run` or `meniscus fit` upgrades it and keeps a backup",
        path.display()
    )]
    Older {
        /// The database.
        path: PathBuf,
        /// Its schema.
        found: usize,
    },
    /// The database belongs to another program.
    #[error("{} is a database of another program: name another folder with --store", .0.display())]
    Foreign(PathBuf),
    /// The folder lies where SQLite's write-ahead log cannot work.
    #[error(
        "{} is on {kind}, where a store could be damaged: name a folder on a local disk with --store, or, if you know \
         that only this machine has it mounted, set MENISCUS_TRUST_FILE_SYSTEM=1",
        dir.display()
    )]
    NetworkFileSystem {
        /// Folder of the store.
        dir: PathBuf,
        /// The kind of file system.
        kind: &'static str,
    },
    /// Reading or writing a file failed.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The database or a sample file is not what was written.
    #[error("{} is damaged: {problem}; `meniscus check DIR --repair` saves what can be saved", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// SQLite failed.
    #[error("{}: {source}{}", path.display(), hint(source))]
    Sql {
        /// The database.
        path: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// A Parquet file could not be written or read.
    #[error("{}: {source}", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// What the Parquet library said.
        source: parquet::errors::ParquetError,
    },
    /// A row holds what no program of this schema writes.
    #[error("the store's row of {row} cannot be used: {problem}; `meniscus check DIR` examines the whole store")]
    Corrupt {
        /// Which row.
        row: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A seed too large for SQLite's integers.
    #[error("seed {0} is too large: choose seeds below 2^63")]
    SeedTooLarge(u64),
    /// An outcome came for a job that was never registered.
    #[error("job {0} is not in the store, so its outcome could not be kept: register it before it runs")]
    UnknownJob(JobId),
    /// The writer could not save outcomes and stopped trying.
    #[error(
        "{unsaved} outcomes could not be saved in {attempts} attempts ({source}): see to the disk, then `run` again"
    )]
    GaveUp {
        /// Outcomes lost, to be computed again.
        unsaved: usize,
        /// How often the commit was tried.
        attempts: usize,
        /// The last failure.
        source: Box<StoreError>,
    },
    /// The writer thread panicked.
    #[error("the writer of the store panicked: finished jobs are safe, `run` again computes the rest")]
    WriterPanicked,
}

/// What to do about an error of SQLite, where there is something to do.
fn hint(source: &rusqlite::Error) -> &'static str {
    match source.sqlite_error_code() {
        Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => {
            "; `meniscus check DIR --repair` saves what can be saved"
        }
        Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly) => {
            "; SQLite needs the right to write in the folder, even to read: ask for it, or copy the whole folder"
        }
        Some(ErrorCode::DiskFull) => "; free some space, then do the same again",
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            "; another program holds the database: close it, then do the same again"
        }
        _ => "",
    }
}

impl StoreError {
    /// For `map_err`: an I/O error at `path`.
    pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    /// For `map_err`: an SQLite error of the database at `path`.
    pub(super) fn sql(path: &Path) -> impl FnOnce(rusqlite::Error) -> Self {
        move |source| Self::Sql { path: path.to_owned(), source }
    }

    /// For `map_err`: a Parquet error of the file at `path`.
    pub(super) fn parquet(path: &Path) -> impl FnOnce(parquet::errors::ParquetError) -> Self {
        move |source| Self::Parquet { path: path.to_owned(), source }
    }
}

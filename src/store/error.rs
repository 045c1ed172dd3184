//! What can go wrong with a store, each with the place and the next step.

use crate::parameters::{JobId, plain, shown};
use crate::store::holder::Holder;
use crate::store::typed;
use rusqlite::ErrorCode;
use std::path::{Path, PathBuf};

/// An operation on a store that failed.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The folder holds no store.
    #[error("no store at {}: `meniscus run CAMPAIGN.toml` creates one", typed(.0))]
    Missing(PathBuf),
    /// There is something else than a folder.
    #[error("{} is {what}, and a store is a folder: {way_out}", shown(path))]
    NoFolder {
        /// What was named.
        path: PathBuf,
        /// What it is.
        what: String,
        /// The next step.
        way_out: &'static str,
    },
    /// Something else stands where a file or a folder of a store belongs.
    #[error(
        "{} is {found}, and a store has {wanted} there: ask whoever made this store; {}",
        shown(path),
        without(path, found)
    )]
    ForeignEntry {
        /// The entry.
        path: PathBuf,
        /// What it is.
        found: &'static str,
        /// What belongs there.
        wanted: &'static str,
    },
    /// Another process writes this store.
    #[error(
        "{} is in use by {holder}: wait for it or stop it; `run` can use another folder meanwhile, with --store",
        typed(dir)
    )]
    Locked {
        /// Folder of the store.
        dir: PathBuf,
        /// Who holds it.
        holder: Holder,
    },
    /// No campaign of the store has this name or id.
    #[error("{} has no campaign `{}`; it has {known}", typed(dir), plain(asked))]
    NoCampaign {
        /// Folder of the store.
        dir: PathBuf,
        /// What was asked for.
        asked: String,
        /// The campaigns that there are, in words.
        known: String,
    },
    /// A later program wrote this store.
    #[error(
        "{} has schema {found}, this program knows schemas up to {known}: use the newer meniscus that wrote it",
        shown(path)
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
        "{} has the older schema {found}: `meniscus fit {}` upgrades it and keeps a backup",
        shown(path), typed(path.parent().unwrap_or(path))
    )]
    Older {
        /// The database.
        path: PathBuf,
        /// Its schema.
        found: usize,
    },
    /// A process died in the midst of a change, and this one may not undo it.
    #[error(
        "{} was left half-written by a process that died, and you may not write there to undo it: ask somebody who may \
         to call `meniscus status {}`, or copy the whole folder",
        shown(.0), typed(.0)
    )]
    HalfWritten(PathBuf),
    /// The database belongs to another program.
    #[error("{} is a database of another program: name another folder with --store", shown(.0))]
    Foreign(PathBuf),
    /// The database is declared in a way in which no meniscus declares it.
    #[error("{} is not used as it is: {problem}{}", shown(path), repair(path))]
    ForeignSchema {
        /// The database.
        path: PathBuf,
        /// What differs.
        problem: String,
    },
    /// A run that was killed left a log, which cannot be read without writing.
    #[error(
        "{} holds results that are not in store.db yet. To read them SQLite has to write beside it, and there is no \
         right or no room to: copy the whole folder and ask the copy, or let its owner run `meniscus status` on it",
        shown(.0)
    )]
    Unfinished(PathBuf),
    /// Somebody began to write a store that was read without the right to write.
    #[error("{}: a run began to write it while it was read, so the answer may be wrong: ask again", shown(.0))]
    Changed(PathBuf),
    /// The folder lies where SQLite's write-ahead log cannot work.
    #[error(
        "{} is on {kind}, where a store could be damaged: name a folder on a local disk with --store, or, if you know \
         that only this machine has it mounted, set MENISCUS_TRUST_FILE_SYSTEM=1",
        shown(dir)
    )]
    NetworkFileSystem {
        /// Folder of the store.
        dir: PathBuf,
        /// The kind of file system.
        kind: &'static str,
    },
    /// Reading or writing a file failed.
    #[error("{}: {source}", shown(path))]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The database or a sample file is not what was written.
    #[error("{} is damaged: {problem}{}", shown(path), repair(path))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// SQLite failed.
    #[error("{}: {source}{}", shown(path), hint(path, source))]
    Sql {
        /// The database.
        path: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
    /// A Parquet file could not be written or read.
    #[error("{}: {source}", shown(path))]
    Parquet {
        /// The file.
        path: PathBuf,
        /// What the Parquet library said.
        source: parquet::errors::ParquetError,
    },
    /// A row holds what no program of this schema writes.
    #[error(
        "the store's row of {} cannot be used: {}; `meniscus check DIR` examines the whole store",
        plain(row),
        plain(problem)
    )]
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
    /// The system gave no thread.
    #[error(
        "the system starts no more threads ({0}): allow more (`ulimit -u`, `ulimit -v`) or end other programs, then do \
         the same again"
    )]
    NoThread(std::io::Error),
    /// The writer thread panicked.
    #[error("the writer of the store panicked: finished jobs are safe, `run` again computes the rest")]
    WriterPanicked,
}

/// What to do about an entry that does not belong in a store.
fn without(path: &Path, found: &str) -> String {
    let more = match found {
        "a symbolic link" => " (to keep a store elsewhere, move the whole folder and name it with --store)",
        _ => "",
    };
    let remove = if found == "a folder" { "rm -r" } else { "rm" };
    format!("`{remove} {}` takes it out{more}", typed(path))
}

/// The command that repairs the store to which a file belongs.
fn repair(file: &Path) -> String {
    let is_in_folder = |dir: &&Path| dir.ends_with("samples") || dir.ends_with("checkpoints") || dir.ends_with("dumps");
    let dir = file.parent().map(|dir| Some(dir).filter(is_in_folder).and_then(Path::parent).unwrap_or(dir));
    format!("; `meniscus check {} --repair` saves what can be saved", typed(dir.unwrap_or(file)))
}

/// What to do about an error of SQLite, where there is something to do.
fn hint(path: &Path, source: &rusqlite::Error) -> String {
    let hint = match source.sqlite_error_code() {
        Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => return repair(path),
        Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly) => {
            "; ask the owner of the folder for the right to it, or copy the whole folder"
        }
        Some(ErrorCode::DiskFull) => "; free some space, then do the same again",
        Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
            "; another program holds the database: close it, then do the same again"
        }
        _ => "",
    };
    hint.to_owned()
}

impl StoreError {
    /// Whether it only keeps this process from writing, so that reading may still do: another process writes, the
    /// system gives no right to, or there is no room.
    pub(crate) fn forbids_writing_alone(&self) -> bool {
        use std::io::ErrorKind;
        match self {
            Self::Locked { .. } | Self::NetworkFileSystem { .. } => true,
            Self::Io { source, .. } => matches!(
                source.kind(),
                ErrorKind::PermissionDenied
                    | ErrorKind::ReadOnlyFilesystem
                    | ErrorKind::StorageFull
                    | ErrorKind::QuotaExceeded
            ),
            Self::Sql { source, .. } => matches!(
                source.sqlite_error_code(),
                Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen | ErrorCode::DiskFull | ErrorCode::SystemIoFailure)
            ),
            _ => false,
        }
    }

    /// For `map_err`: an I/O error at `path`.
    pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io { path: path.to_owned(), source }
    }

    /// For `map_err`: an SQLite error of the database at `path`.
    pub(super) fn sql(path: &Path) -> impl FnOnce(rusqlite::Error) -> Self {
        move |source| match source {
            // A row holds what no program of this schema writes there.
            rusqlite::Error::FromSqlConversionFailure(_, _, problem) => {
                Self::Damaged { path: path.to_owned(), problem: problem.to_string() }
            }
            source => Self::Sql { path: path.to_owned(), source },
        }
    }

    /// For `map_err`: a Parquet error of the file at `path`.
    pub(super) fn parquet(path: &Path) -> impl FnOnce(parquet::errors::ParquetError) -> Self {
        move |source| Self::Parquet { path: path.to_owned(), source }
    }
}

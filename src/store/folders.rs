//! Where the files of a store are.

use crate::parameters::JobId;
use crate::store::error::StoreError;
use crate::store::{checkpoint_file, disk, quarantine};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The database of the store in `dir`.
pub(super) fn database(dir: &Path) -> PathBuf {
    dir.join("store.db")
}

/// The write-ahead log beside the database.
pub(super) fn log(dir: &Path) -> PathBuf {
    dir.join("store.db-wal")
}

/// The rollback journal beside the database: of a database that is not in the mode of write-ahead logs yet, or no
/// longer, because another program changed it.
pub(super) fn journal(dir: &Path) -> PathBuf {
    dir.join("store.db-journal")
}

/// The folder of the sample files.
pub(super) fn samples_dir(dir: &Path) -> PathBuf {
    dir.join("samples")
}

/// Where the dump of a failed job stands, within the store.
pub(super) fn dump_path(job: JobId) -> String {
    format!("dumps/{job}.ckpt")
}

/// The files in a folder, by name; none if there is no folder.
pub(super) fn files_in(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(StoreError::io(folder))?,
    };
    let paths: std::io::Result<Vec<_>> = entries.map(|entry| Ok(entry?.path())).collect();
    let mut paths = paths.map_err(StoreError::io(folder))?;
    paths.retain(|path| path.is_file());
    paths.sort();
    Ok(paths)
}

/// The folders of unfinished trajectories and of dumps: what a run keeps beside the database.
#[derive(Clone, Debug)]
pub(crate) struct Folders {
    dir: PathBuf,
}

impl Folders {
    /// Those of the store in `dir`.
    pub(super) fn of(dir: &Path) -> Self {
        Self { dir: dir.to_owned() }
    }

    /// Unfinished trajectories, a file each.
    pub(crate) fn checkpoints(&self) -> PathBuf {
        self.dir.join("checkpoints")
    }

    /// Failed jobs, a file each.
    pub(crate) fn dumps(&self) -> PathBuf {
        self.dir.join("dumps")
    }

    /// Makes those that are not there.
    pub(super) fn create(&self) -> Result<(), StoreError> {
        [self.checkpoints(), self.dumps()].iter().try_for_each(|folder| disk::create_folder(folder))
    }

    /// Moves a file to `quarantine/`, under its own name or that and a number; returns where it is now.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub(crate) fn quarantine(&self, file: &Path) -> Result<PathBuf, StoreError> {
        quarantine::take(&self.dir, file)
    }

    /// Jobs that have a checkpoint. A folder that cannot be read counts as empty: its jobs are computed anew.
    pub(crate) fn unfinished(&self) -> HashSet<JobId> {
        let files = std::fs::read_dir(self.checkpoints()).into_iter().flatten().flatten();
        files.filter_map(|entry| checkpoint_file::job_of(&entry.path())).collect()
    }
}

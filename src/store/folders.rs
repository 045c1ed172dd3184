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

/// Refuses a path that leads to something else than a folder; one that leads nowhere may become a store.
///
/// # Errors
/// [`StoreError::NoFolder`].
pub(super) fn refuse_no_folder(dir: &Path) -> Result<(), StoreError> {
    let refuse = |what: String, way_out| Err(StoreError::NoFolder { path: dir.to_owned(), what, way_out });
    if dir.is_dir() {
        return Ok(());
    }
    match (std::fs::read_link(dir), dir.exists()) {
        (Ok(target), false) => refuse(
            format!("a link to {}, which is not there", target.display()),
            "make that folder, or remove the link",
        ),
        (_, true) if dir.extension().is_some_and(|extension| extension == "toml") => refuse(
            "a campaign file".to_owned(),
            "its store is NAME.meniscus, where NAME is the `name` in the file, unless `run` was told another --store",
        ),
        (_, true) => refuse("a file".to_owned(), "name another place; `meniscus run` makes the folder"),
        (Err(_), false) => Ok(()),
    }
}

/// The write-ahead log beside the database.
pub(super) fn log(dir: &Path) -> PathBuf {
    dir.join("store.db-wal")
}

/// Whether the database has pages that are not in its file: a log, or a journal to be rolled back.
pub(super) fn is_unfinished(dir: &Path) -> bool {
    let has_bytes = |path: PathBuf| path.metadata().is_ok_and(|file| file.len() > 0);
    has_bytes(log(dir)) || has_bytes(journal(dir))
}

/// Whether there is a store in `dir`.
pub(crate) fn is_there(dir: &Path) -> bool {
    database(dir).is_file()
}

/// What a store consists of, as [`around`] recognises it.
const PARTS: [&str; 6] = ["samples", "checkpoints", "dumps", "quarantine", "lock", "readers"];

/// The store that an existing path lies in, if it is a part of one: people name `store.db`, or stand in `samples/`.
pub(crate) fn around(path: &Path) -> Option<PathBuf> {
    let path = std::fs::canonicalize(path).ok().filter(|path| !is_there(path))?;
    let is_part = |part: &Path| {
        let name = part.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("store.db") || PARTS.contains(&name.as_ref())
    };
    let part = path.ancestors().find(|part| is_part(part) && part.parent().is_some_and(is_there));
    part.and_then(Path::parent).map(Path::to_owned)
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

/// The folder of sample files that are on their way into `samples/`, or out of it ([`aside`](crate::store::aside)).
pub(super) fn aside_dir(dir: &Path) -> PathBuf {
    dir.join("aside")
}

/// Where a campaign that is being forgotten is copied to, until the copy is whole. What stands here stands in the store
/// too.
pub(super) fn forgetting_dir(dir: &Path) -> PathBuf {
    dir.join("forgetting")
}

/// Where the dump of a failed job stands, within the store.
pub(super) fn dump_path(job: JobId) -> String {
    format!("dumps/{job}.ckpt")
}

/// The plain files in a folder, by name; none if there is no folder. Links and the like are somebody else's.
pub(super) fn files_in(folder: &Path) -> Result<Vec<PathBuf>, StoreError> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(StoreError::io(folder))?,
    };
    let mut paths = Vec::new();
    for entry in entries {
        let entry = entry.map_err(StoreError::io(folder))?;
        if entry.file_type().is_ok_and(|entry| entry.is_file()) {
            paths.push(entry.path());
        }
    }
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

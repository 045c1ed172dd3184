//! The folders of a store that hold unfinished trajectories, dumps of failures, and what was put aside.
//!
//! The database decides what in them counts: a checkpoint of a job that has ended, and a dump of a job that has not failed, are
//! left over from a crash, and go at the next opening.

use crate::parameters::JobId;
use crate::store::{StoreError, checkpoint_file, database, disk, quarantine};
use rusqlite::{Connection, OptionalExtension};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The folders of the store in one folder.
#[derive(Clone, Debug)]
pub struct Folders {
    dir: PathBuf,
}

/// Where a dump stands in a store.
pub(super) fn dump_path(job: JobId) -> String {
    format!("dumps/{job}.ckpt")
}

impl Folders {
    /// Those of the store in `dir`.
    pub fn of(dir: &Path) -> Self {
        Self { dir: dir.to_owned() }
    }

    /// Unfinished trajectories, a file each.
    pub fn checkpoints(&self) -> PathBuf {
        self.dir.join("checkpoints")
    }

    /// Failed jobs, a file each.
    pub fn dumps(&self) -> PathBuf {
        self.dir.join("dumps")
    }

    /// Makes those that are not there.
    pub(super) fn create(&self) -> Result<(), StoreError> {
        for folder in [self.checkpoints(), self.dumps()] {
            disk::create_folder(&folder)?;
        }
        Ok(())
    }

    /// Moves a file to `quarantine/`, under its own name or that and a number; returns where it is now.
    ///
    /// # Errors
    /// [`StoreError::Io`].
    pub fn quarantine(&self, file: &Path) -> Result<PathBuf, StoreError> {
        quarantine::take(&self.dir, file)
    }

    /// Jobs that have a checkpoint. A folder that cannot be read has none: what was in it is computed anew.
    pub fn unfinished(&self) -> HashSet<JobId> {
        let files = std::fs::read_dir(self.checkpoints()).into_iter().flatten().flatten();
        files.filter_map(|entry| checkpoint_file::job_of(&entry.path())).collect()
    }

    /// Removes the checkpoints of jobs whose outcomes are committed.
    pub(super) fn forget(&self, jobs: impl Iterator<Item = JobId>) {
        let folder = self.checkpoints();
        for job in jobs {
            // Most jobs have none; one that stays goes at the next opening.
            let path = checkpoint_file::path_of(&folder, job);
            if path.exists() {
                let _ = disk::remove(&path);
            }
        }
    }

    /// Removes what a crash left: half-written files, checkpoints of jobs that have ended, dumps of jobs that have not failed.
    pub(super) fn collect(&self, conn: &Connection) -> Result<(), StoreError> {
        let mut state = conn.prepare("SELECT state FROM jobs WHERE job_id = ?1").map_err(self.sql())?;
        for (folder, kept) in [(self.checkpoints(), ["pending", "running"]), (self.dumps(), ["failed"; 2])] {
            for entry in std::fs::read_dir(&folder).map_err(StoreError::io(&folder))? {
                let file = entry.map_err(StoreError::io(&folder))?.path();
                let useless = match checkpoint_file::job_of(&file) {
                    Some(job) => {
                        let row = state.query_row([job.to_string()], |row| row.get::<_, String>(0));
                        // One of a job that is not known belongs to somebody else.
                        row.optional().map_err(self.sql())?.is_some_and(|state| !kept.contains(&state.as_str()))
                    }
                    None => file.to_string_lossy().ends_with(".ckpt.tmp"),
                };
                if useless {
                    tracing::debug!(file = %file.display(), "removing what a crash left");
                    disk::remove(&file)?;
                }
            }
        }
        Ok(())
    }

    fn sql(&self) -> impl FnOnce(rusqlite::Error) -> StoreError + use<> {
        let path = database(&self.dir);
        move |source| StoreError::Sql { path, source }
    }
}

//! The store: one folder that keeps every result of a campaign, and copies as one.
//!
//! ```text
//! NAME.meniscus/
//!     store.db       SQLite, the authority: points, jobs, outcomes, clogs, the catalogue of sample files
//!     samples/       Parquet, the recorded time series; a file exists for readers once it is catalogued
//!     checkpoints/   unfinished trajectories
//!     dumps/         what failed jobs left to be replayed
//!     quarantine/    files that were of no use
//!     lock           held by the one process that writes
//! ```
//!
//! **Locking.** One process writes, under a kernel lock that dies with it; within it one thread does ([`Writer`]).
//! Readers take no lock and may come at any time.
//!
//! **Crashes.** The outcome of a job and the catalogue row of its samples commit in one transaction, after the samples
//! are safely on disk. So there is no half result; what is not catalogued is rubbish, and removed at the next opening.
//!
//! **Compatibility.** Schemas are numbered: older stores are migrated after a backup, newer ones refused.
//!
//! **Identity.** A job is known by the hash of its point, its seed and the physics version. Registering never changes
//! what is there; results of another physics version stay, as `stale_runs`.

mod catalogue;
pub mod checkpoint_file;
mod commit;
mod error;
mod fits;
mod folders;
mod format;
mod lock;
mod migrate;
mod patience;
mod query;
mod read;
mod records;
mod register;
mod samples;
mod samples_table;
mod shapes;
mod status;
mod write;

pub use error::StoreError;
pub use fits::{point_runs, save_fits};
pub use folders::Folders;
pub use format::Format;
pub use lock::Holder;
pub use patience::Hurry;
pub use query::{QueryError, query};
pub use read::{StoredJob, job, job_states, open_reading};
pub use records::{Origins, origins, records};
pub use register::{CampaignRecord, PlannedPoint, Provenance, Registered};
pub use shapes::{JobStory, find_jobs, job_path, job_story, shapes};
pub use status::{CampaignCounts, FailureCount, RunProgress, StateCounts, Status, status};
pub use write::{Message, OutcomeSender, Writer, WriterOptions, WriterStopped};

use crate::job::PHYSICS_VERSION;
use crate::trajectory::FailureClass;
use rusqlite::Connection;
use std::collections::HashSet;
use std::ffi::OsString;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// How long a connection waits for another one before it reports that the store is busy.
const BUSY_TIMEOUT: Duration = Duration::from_secs(30);

/// A store opened for writing; the lock is released when it is dropped.
#[derive(Debug)]
pub struct Store {
    dir: PathBuf,
    conn: Connection,
    /// The run that `begin_run` began: outcomes written from now on belong to it.
    run: Option<i64>,
    _lock: File,
}

impl Store {
    /// Opens the store in the folder `dir` for writing, creating it if need be.
    ///
    /// Takes the lock, migrates an older schema, sets jobs that a dead process left `running` back to `pending`, and
    /// removes sample files that were never catalogued.
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another process has the store open for writing, [`StoreError::Newer`] when a later
    /// program wrote it, [`StoreError::NetworkFileSystem`] where WAL is unsafe; else what SQLite or the system report.
    pub fn open(dir: &Path) -> Result<Self, StoreError> {
        lock::refuse_network(dir)?;
        for folder in [dir.to_owned(), samples_dir(dir)] {
            std::fs::create_dir_all(&folder).map_err(StoreError::io(&folder))?;
        }
        Folders::of(dir).create()?;
        let lock = lock::take(dir)?;
        let path = database(dir);
        let mut conn = Connection::open(&path).map_err(StoreError::sql(&path))?;
        conn.busy_timeout(BUSY_TIMEOUT).map_err(StoreError::sql(&path))?;
        migrate::migrate(&mut conn, &path)?;
        prepare(&conn).map_err(StoreError::sql(&path))?;
        let store = Self { dir: dir.to_owned(), conn, run: None, _lock: lock };
        store.remove_orphans()?;
        store.folders().collect(&store.conn)?;
        Ok(store)
    }

    /// The folder of the store.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// The connection, for the reading functions that take one.
    pub fn connection(&self) -> &Connection {
        &self.conn
    }

    /// Where unfinished trajectories and dumps go.
    pub fn folders(&self) -> Folders {
        Folders::of(&self.dir)
    }

    /// Sets failed jobs, of one class or of all, back to `pending`, and removes their dumps; returns how many.
    ///
    /// # Errors
    /// What SQLite reports.
    pub fn retry(&mut self, class: Option<FailureClass>) -> Result<usize, StoreError> {
        let path = database(&self.dir);
        let class = class.map(FailureClass::name);
        let retry = |conn: &mut Connection| {
            let transaction = conn.transaction()?;
            let reset = transaction.execute(
                "UPDATE jobs SET state = 'pending' WHERE physics_version = ?1 AND state = 'failed' AND key IN
                     (SELECT job FROM outcomes WHERE error_class IS NOT NULL AND error_class = coalesce(?2, error_class))",
                (PHYSICS_VERSION, class),
            )?;
            transaction.execute(
                "DELETE FROM outcomes WHERE error_class IS NOT NULL
                     AND job IN (SELECT key FROM jobs WHERE state = 'pending')",
                [],
            )?;
            transaction
                .execute("DELETE FROM shape_rows WHERE job IN (SELECT key FROM jobs WHERE state = 'pending')", [])?;
            transaction.commit()?;
            Ok(reset)
        };
        let reset = retry(&mut self.conn).map_err(StoreError::sql(&path))?;
        self.folders().collect(&self.conn)?;
        Ok(reset)
    }

    /// Removes half-written sample files and those a crash kept from being catalogued.
    fn remove_orphans(&self) -> Result<(), StoreError> {
        let known = self.catalogued().map_err(StoreError::sql(&database(&self.dir)))?;
        let folder = samples_dir(&self.dir);
        for entry in std::fs::read_dir(&folder).map_err(StoreError::io(&folder))? {
            let entry = entry.map_err(StoreError::io(&folder))?;
            let ours = [Some("tmp"), Some("parquet")].contains(&entry.path().extension().and_then(|e| e.to_str()));
            if ours && !known.contains(&entry.file_name()) {
                tracing::info!(file = %entry.path().display(), "removing a sample file that was never committed");
                std::fs::remove_file(entry.path()).map_err(StoreError::io(&entry.path()))?;
            }
        }
        Ok(())
    }

    fn catalogued(&self) -> rusqlite::Result<HashSet<OsString>> {
        let mut statement = self.conn.prepare("SELECT path FROM sample_files")?;
        let names = statement.query_map([], |row| {
            let path: String = row.get(0)?;
            Ok(Path::new(&path).file_name().unwrap_or_default().to_owned())
        })?;
        names.collect()
    }
}

/// Sets a writing connection up, after the migration.
fn prepare(conn: &Connection) -> rusqlite::Result<()> {
    conn.pragma_update(None, "journal_mode", "wal")?;
    conn.pragma_update(None, "synchronous", "full")?;
    conn.pragma_update(None, "foreign_keys", true)?;
    // Job ids are hashes, so their index is written all over: keep it in memory, and let the log take 64 MB before
    // the pages go home.
    conn.pragma_update(None, "cache_size", -256 * 1024)?;
    conn.pragma_update(None, "wal_autocheckpoint", 16 * 1024)?;
    conn.set_prepared_statement_cache_capacity(32);
    read::keep_plans(conn)?;
    conn.execute("INSERT OR REPLACE INTO current VALUES (1, ?1)", [PHYSICS_VERSION])?;
    give_back(conn)
}

/// Sets jobs that nobody computes any more back to `pending`.
fn give_back(conn: &Connection) -> rusqlite::Result<()> {
    let sql = "UPDATE jobs SET state = 'pending' WHERE key IN (SELECT key FROM jobs WHERE state = 'running')";
    conn.execute(sql, []).map(drop)
}

/// The database in the folder `dir`.
fn database(dir: &Path) -> PathBuf {
    dir.join("store.db")
}

/// The folder of the sample files of the store in `dir`.
fn samples_dir(dir: &Path) -> PathBuf {
    dir.join("samples")
}

/// Makes a file, or the names in a folder, survive a power loss.
fn sync(path: &Path) -> Result<(), StoreError> {
    File::open(path).and_then(|file| file.sync_all()).map_err(StoreError::io(path))
}

/// Seconds since 1970, UTC.
fn unix_now() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

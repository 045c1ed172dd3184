//! The store: one folder that keeps every result of a campaign, and copies as one.
//!
//! ```text
//! NAME.meniscus/
//!     store.db       SQLite, the authority: points, jobs, outcomes, clogs, the catalogue of sample files
//!     samples/       Parquet, the recorded time series; a file exists for readers once it is catalogued
//!     checkpoints/   unfinished trajectories
//!     dumps/         what failed jobs left to be replayed
//!     quarantine/    what was of no use, or put aside by a repair; there only then
//!     store.db.seal  hashes of the closed database; there only while nobody writes
//!     lock           held by the one process that writes
//!     readers        held, shared, by those that read samples
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
mod check;
pub mod checkpoint_file;
mod commit;
mod compact;
mod disk;
mod error;
#[cfg(test)]
mod every_fault;
mod fits;
mod folders;
mod format;
mod functions;
mod lock;
mod migrate;
mod outlines;
mod patience;
mod quarantine;
mod query;
mod read;
mod readers;
mod records;
mod register;
mod samples;
mod samples_table;
mod seal;
mod status;
mod work;
mod write;

pub use check::{CheckReport, Finding, check, repair};
pub use error::StoreError;
pub use fits::{point_runs, save_fits};
pub use folders::Folders;
pub use format::Format;
pub use lock::Holder;
pub use outlines::{JobStory, find_jobs, job_path, job_story, outlines};
pub use patience::Hurry;
pub use query::{QueryError, query};
pub use read::{StoredJob, job, job_states, open_reading};
pub use records::{Origins, origins, records};
pub use register::{CampaignRecord, PlannedPoint, Provenance, Registered};
pub use status::{CampaignCounts, FailureCount, RunProgress, StateCounts, Status, status};
pub use work::{PointWork, Work, work};
pub use write::{Message, OutcomeSender, Writer, WriterOptions, WriterStopped};

use crate::parameters::PHYSICS_VERSION;
use crate::results::trajectory::FailureClass;
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
    // Dropped in this order: connection, seal, lock.
    _seal: seal::SealsWhenDropped,
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
        disk::create_folder(dir)?;
        let lock = lock::take(dir)?;
        let is_new = database(dir).metadata().map_or(0, |file| file.len()) == 0 && !seal::log(dir).exists();
        let store = Self::connect(dir, lock)?;
        if is_new {
            // Samples without a database may be all that is left of a store: they are nobody's, but not rubbish.
            check::files::strangers(dir, &store.conn)?.iter().try_for_each(|path| {
                tracing::warn!(file = %path.display(), "there was no database; the file goes to quarantine/");
                quarantine::take(dir, path).map(drop)
            })?;
        }
        store.remove_orphans()?;
        store.folders().collect(&store.conn)?;
        Ok(store)
    }

    /// Opens the database, and migrates it, under a lock that is held.
    fn connect(dir: &Path, lock: File) -> Result<Self, StoreError> {
        let path = database(dir);
        disk::create_folder(&samples_dir(dir))?;
        Folders::of(dir).create()?;
        if path.exists() && !seal::first_page_is_sound(dir)? {
            return Err(StoreError::Damaged { path, problem: "its header is not as it was left".to_owned() });
        }
        let mut conn = Connection::open(&path).map_err(StoreError::sql(&path))?;
        conn.busy_timeout(BUSY_TIMEOUT).map_err(StoreError::sql(&path))?;
        migrate::version(&conn, &path)?;
        // From here on it is written.
        seal::lift(dir)?;
        migrate::migrate(&mut conn, &path)?;
        prepare(&mut conn, &path)?;
        let seal = seal::SealsWhenDropped(dir.to_owned());
        Ok(Self { dir: dir.to_owned(), conn, run: None, _seal: seal, _lock: lock })
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
        let transaction = self.conn.transaction().map_err(StoreError::sql(&path))?;
        let retry = || {
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
            Ok(reset)
        };
        let reset = retry().map_err(StoreError::sql(&path))?;
        disk::commit(transaction, &path)?;
        self.folders().collect(&self.conn)?;
        Ok(reset)
    }

    /// Removes half-written sample files, those a crash kept from being catalogued, and those that were merged into
    /// others; while readers may still look at the latter, it leaves all for the next time.
    fn remove_orphans(&self) -> Result<(), StoreError> {
        let Some(_alone) = readers::none(&self.dir)? else { return Ok(()) };
        let known = catalogued(&self.conn).map_err(StoreError::sql(&database(&self.dir)))?;
        let folder = samples_dir(&self.dir);
        for entry in std::fs::read_dir(&folder).map_err(StoreError::io(&folder))? {
            let entry = entry.map_err(StoreError::io(&folder))?;
            if is_ours(&entry.path()) && !known.contains(&entry.file_name()) {
                tracing::debug!(file = %entry.path().display(), "removing a sample file that no row names");
                disk::remove(&entry.path())?;
            }
        }
        Ok(())
    }
}

/// Whether a file in `samples/` is one that this program makes.
fn is_ours(path: &Path) -> bool {
    [Some("tmp"), Some("parquet")].contains(&path.extension().and_then(|extension| extension.to_str()))
}

/// The names of the catalogued sample files.
fn catalogued(conn: &Connection) -> rusqlite::Result<HashSet<OsString>> {
    let mut statement = conn.prepare("SELECT path FROM sample_files")?;
    let names = statement.query_map([], |row| {
        let path: String = row.get(0)?;
        Ok(Path::new(&path).file_name().unwrap_or_default().to_owned())
    })?;
    names.collect()
}

/// Sets a writing connection up, after the migration.
fn prepare(conn: &mut Connection, path: &Path) -> Result<(), StoreError> {
    set_up(conn).map_err(StoreError::sql(path))?;
    let transaction = conn.transaction().map_err(StoreError::sql(path))?;
    let begin = || -> rusqlite::Result<()> {
        transaction.execute("INSERT OR REPLACE INTO current VALUES (1, ?1)", [PHYSICS_VERSION])?;
        give_back(&transaction)
    };
    begin().map_err(StoreError::sql(path))?;
    disk::commit(transaction, path)
}

/// How a writing connection works.
fn set_up(conn: &Connection) -> rusqlite::Result<()> {
    conn.pragma_update(None, "journal_mode", "wal")?;
    conn.pragma_update(None, "synchronous", "full")?;
    conn.pragma_update(None, "foreign_keys", true)?;
    // Job ids are hashes, so their index is written all over: keep it in memory, and let the log take 64 MB before
    // the pages go home.
    conn.pragma_update(None, "cache_size", -256 * 1024)?;
    conn.pragma_update(None, "wal_autocheckpoint", 16 * 1024)?;
    conn.set_prepared_statement_cache_capacity(32);
    read::keep_plans(conn)
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

/// Makes the names in a folder survive a power loss.
fn sync(folder: &Path) -> Result<(), StoreError> {
    disk::sync_folder(folder)
}

/// Seconds since 1970, UTC.
fn unix_now() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

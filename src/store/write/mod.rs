//! Writing a store: one process, one thread, and every outcome exactly once.
//!
//! `commit.rs` is the heart: how a batch of outcomes gets in. `writer.rs` is the thread that collects batches,
//! `patience.rs` how long it waits for a disk that fails, `waiting.rs` how much waits for it, `compact.rs` what it does
//! with many small files. `register.rs` writes plans, `fits.rs` the answers of a fit, `orphans.rs` clears up after a
//! crash.
//!
//! **Locking.** [`Store`] holds the lock of the store for as long as it lives, and with it the only connection that
//! writes. [`Writer`](crate::store::Writer) takes the store into its thread; workers send it outcomes over a channel,
//! so no worker ever waits for SQLite, and none sees `database is locked`.
//!
//! **Compatibility.** Opening upgrades an older schema ([`schema`]). Registering adds, and changes nothing.
//!
//! **Performance.** With `synchronous = FULL` a commit costs a flush of the disk, about a millisecond. So outcomes
//! commit in groups, when enough have come or the oldest has waited a second. Small sample files are merged sixteen at
//! a time.
//!
//! **Durability.** What is said to be committed survives a power cut. A crash at any instant leaves a store that the
//! next opening makes whole: `tests/store/every_fault.rs` tries every instant there is.

pub(super) mod catalogue;
mod commit;
pub(super) mod compact;
pub(super) mod fits;
pub(super) mod orphans;
mod outlines;
pub(super) mod patience;
pub(super) mod register;
mod waiting;
pub(super) mod writer;

use crate::parameters::PHYSICS_VERSION;
use crate::results::trajectory::FailureClass;
use crate::store::error::StoreError;
use crate::store::folders::{Folders, aside_dir, database, refuse_no_folder, samples_dir};
use crate::store::read::{BUSY_TIMEOUT, plan_once};
use crate::store::schema::{self, birth};
use crate::store::{disk, entries, lock, quarantine, seal};
use rusqlite::Connection;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A store opened for writing; the lock is released when it is dropped.
#[derive(Debug)]
pub struct Store {
    pub(super) dir: PathBuf,
    pub(super) conn: Connection,
    /// The run that `begin_run` began: outcomes written from now on belong to it.
    run: Option<i64>,
    // Dropped in this order: connection, seal, lock.
    _seal: seal::SealsWhenDropped,
    _lock: File,
}

impl Store {
    /// Opens the store in the folder `dir` for writing, and creates it if need be.
    ///
    /// Takes the lock, upgrades an older schema, sets jobs that a dead process left `running` back to `pending`, and
    /// removes what a crash left.
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another process has the store open for writing, [`StoreError::Newer`] when a later
    /// program wrote it, [`StoreError::NetworkFileSystem`] where SQLite's log is unsafe; else what SQLite or the system
    /// report.
    pub fn open(dir: &Path) -> Result<Self, StoreError> {
        refuse_no_folder(dir)?;
        lock::refuse_network(dir)?;
        disk::create_folder(dir)?;
        entries::refuse_foreign(dir)?;
        let lock = lock::take(dir)?;
        birth::roll_back_alone(dir)?;
        let is_new = birth::is_empty(dir);
        let store = Self::connect(dir, lock)?;
        if is_new {
            // Samples without a database may be all that is left of a store: no row names them, but they are kept.
            for path in orphans::files(dir, &store.conn)? {
                tracing::warn!(file = %path.display(), "there was no database, so this file goes to quarantine/");
                quarantine::take(dir, &path)?;
            }
        }
        orphans::remove_half_a_copy(&store)?;
        orphans::settle_samples(&store)?;
        orphans::remove_samples(&store)?;
        orphans::remove_checkpoints(&store)?;
        Ok(store)
    }

    /// Opens a store that is there, as [`open`](Self::open) does.
    ///
    /// # Errors
    /// [`StoreError::Missing`] where there is none, and as [`open`](Self::open).
    pub fn open_existing(dir: &Path) -> Result<Self, StoreError> {
        refuse_no_folder(dir)?;
        // A link in place of the database is refused as such, also where it leads to nothing.
        if database(dir).symlink_metadata().is_ok() {
            Self::open(dir)
        } else {
            Err(StoreError::Missing(dir.to_owned()))
        }
    }

    /// Opens the database and upgrades it, under a lock that is held.
    pub(super) fn connect(dir: &Path, lock: File) -> Result<Self, StoreError> {
        let path = database(dir);
        disk::create_folder(&samples_dir(dir))?;
        disk::create_folder(&aside_dir(dir))?;
        Folders::of(dir).create()?;
        if path.exists() && !seal::first_page_is_sound(dir)? {
            return Err(StoreError::Damaged { path, problem: "its first page is not as it was left".to_owned() });
        }
        let mut conn = birth::open_or_create(dir)?;
        conn.busy_timeout(BUSY_TIMEOUT).map_err(StoreError::sql(&path))?;
        // From here on it is written.
        seal::remove(dir)?;
        schema::migrate(&mut conn, &path)?;
        prepare(&mut conn, &path)?;
        let seal = seal::SealsWhenDropped(dir.to_owned());
        Ok(Self { dir: dir.to_owned(), conn, run: None, _seal: seal, _lock: lock })
    }

    /// The connection, for the reading functions that take one.
    pub fn connection(&self) -> &Connection {
        &self.conn
    }

    /// The folder of the store.
    pub(crate) fn dir(&self) -> &Path {
        &self.dir
    }

    /// Where unfinished trajectories and dumps go.
    pub(crate) fn folders(&self) -> Folders {
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
                     (SELECT job FROM outcomes
                      WHERE error_class IS NOT NULL AND error_class = coalesce(?2, error_class))",
                (PHYSICS_VERSION, class),
            )?;
            transaction.execute_batch(
                "DELETE FROM outcomes WHERE error_class IS NOT NULL
                     AND job IN (SELECT key FROM jobs WHERE state = 'pending');
                 DELETE FROM shape_rows WHERE job IN (SELECT key FROM jobs WHERE state = 'pending');",
            )?;
            Ok(reset)
        };
        let reset = retry().map_err(StoreError::sql(&path))?;
        disk::commit(transaction, &path)?;
        orphans::remove_checkpoints(self)?;
        Ok(reset)
    }
}

/// Sets a writing connection up, after the upgrade.
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
    // Job ids are hashes, so their index is written all over: keep it in memory, and let the log grow to 64 MB before
    // its pages go into the database.
    conn.pragma_update(None, "cache_size", -256 * 1024)?;
    conn.pragma_update(None, "wal_autocheckpoint", 16 * 1024)?;
    conn.set_prepared_statement_cache_capacity(32);
    plan_once(conn)
}

/// Sets jobs that nobody computes any more back to `pending`.
fn give_back(conn: &Connection) -> rusqlite::Result<()> {
    let sql = "UPDATE jobs SET state = 'pending' WHERE key IN (SELECT key FROM jobs WHERE state = 'running')";
    conn.execute(sql, []).map(drop)
}

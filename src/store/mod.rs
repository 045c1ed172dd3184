//! The store: one folder that keeps every result of a campaign, and copies as one.
//!
//! ```text
//! NAME.meniscus/
//!     store.db       SQLite, the authority: points, jobs, outcomes, clogs, the catalogue of sample files
//!     samples/       Parquet, the recorded time series; a file counts once the catalogue lists it
//!     aside/         sample files on their way in (being written) or out (merged into others)
//!     checkpoints/   unfinished trajectories
//!     dumps/         what failed jobs left to be replayed
//!     quarantine/    files that were of no use, what a repair put aside, forgotten campaigns; made when it is needed
//!     forgetting/    a campaign while it is copied into quarantine
//!     store.db.seal  hashes of the closed database; there only while nobody writes
//!     lock           held by the one process that writes
//!     readers        held, shared, by those that read samples
//! ```
//!
//! Another program reads a store with one call:
//!
//! ```
//! use meniscus::store::{Format, query};
//! # let folder = tempfile::tempdir()?;
//! # let dir = folder.path().join("quickstart.meniscus");
//! # drop(meniscus::store::Store::open(&dir)?);
//! let mut csv = Vec::new();
//! query(&dir, "SELECT outcome, count(*) AS jobs, avg(r_end) AS r FROM runs GROUP BY 1", Format::Csv, &mut csv)?;
//! assert!(csv.starts_with(b"outcome,jobs,r\n"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Locking
//!
//! One process writes, under a kernel lock that dies with it ([`lock`]); within it one thread does ([`Writer`]).
//! Readers take no lock on the database and may come at any time. Those that read samples hold the file `readers`, so
//! that no sample file is removed under them.
//!
//! # Compatibility
//!
//! Schemas are numbered ([`schema`]). An older store is upgraded when it is opened for writing, after a backup; a
//! newer one is refused. People query views, and views keep their names. A job is known by the hash of its point, its
//! seed and the physics version: registering a campaign again never changes a finished job, and results of another
//! physics version stay, as `stale_runs`.
//!
//! # Performance
//!
//! Outcomes commit in groups, so a million tiny jobs do not cost a million disk flushes. The indices cover what the
//! planner and `status` ask, so both answer in about a second with a million jobs. Series are read by column and by
//! job.
//!
//! # Durability
//!
//! The outcome of a job and the catalogue row of its samples commit in one transaction, after the samples are safely
//! on disk ([`write`]). So there is no half result; a file that no row names is left over from a crash and goes at the
//! next opening. Everything has a checksum: sample files and checkpoints always, the database whenever it is closed
//! ([`seal`]). [`check`](mod@check) compares all of them and repairs.
//!
//! # What to read first
//!
//! `write/commit.rs` is the heart. Then `schema/` and `migrations/` for the tables, `read/query.rs` for the way out.
//! Each folder may import those above it: the files here, then `schema`, `read`, `write`, `check`, `forget`.

mod aside;
pub mod checkpoint_file;
mod connection;
mod deadline;
mod disk;
mod end_state;
mod entries;
mod error;
mod folders;
mod holder;
mod lock;
mod quarantine;
mod quiet;
mod sample_file;
mod seal;
mod typed;

mod schema;

mod read;

mod write;

mod check;

mod forget;

// Unit tests, because they need the seam in `disk`; they stand with the other tests of the store.
#[cfg(test)]
#[path = "../../tests/store/every_fault.rs"]
mod every_fault;
#[cfg(test)]
#[path = "../../tests/store/full_disk.rs"]
mod full_disk;
#[cfg(test)]
#[path = "../../tests/store/paths.rs"]
mod paths;

pub use check::{CheckReport, Finding, check, repair};
pub use deadline::Deadline;
pub use end_state::EndState;
pub use error::StoreError;
pub(crate) use folders::{Folders, around, is_there};
pub use forget::{Forgotten, forget, forgettable};
pub use holder::Holder;
pub use read::campaign_texts::holds_campaign;
pub(crate) use read::end_states::{FoundEnd, end_state, ended_courses};
pub use read::export::{ExportedFile, export};
pub use read::fits::point_runs;
pub use read::format::{Format, MOST_TABLE_ROWS};
pub(crate) use read::jobs::find_jobs;
pub use read::jobs::{StoredJob, job, job_states};
pub use read::last_run::{LastRun, PointWork, last_run};
pub use read::open_reading;
pub use read::outlines::{JobStory, outlines};
pub(crate) use read::outlines::{job_path, job_story};
pub(crate) use read::query::example_jobs;
pub use read::query::{Answer, QueryError, query};
pub(crate) use read::records::{Origins, origins, records};
pub(crate) use read::rows::{write_fits, write_rows};
pub use read::status::{CampaignCounts, FailureCount, RunProgress, StateCounts, Status, status};
pub use read::twins::{Twin, twins};
pub(crate) use schema::columns::Kind as ColumnKind;
pub(crate) use typed::typed;
pub use write::Store;
pub use write::fits::save_fits;
pub use write::patience::Hurry;
pub use write::register::{CampaignRecord, PlannedPoint, Provenance, Registered};
pub use write::writer::{Message, OutcomeSender, Writer, WriterOptions, WriterStopped};

/// A value of a row that is written by [`write_rows`].
pub(crate) use rusqlite::types::Value;

use std::time::SystemTime;

/// Seconds since 1970, UTC.
fn unix_now() -> f64 {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

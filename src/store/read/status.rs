//! Where a store stands: counts of jobs, failures by class, and the rate of the last run.

use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::holder::Holder;
use crate::store::read::open_reading;
use crate::store::{lock, unix_now};
use rusqlite::{Connection, OptionalExtension};
use serde::Serialize;
use std::path::Path;

/// Seconds over which the present rate is taken.
const RATE_WINDOW_S: f64 = 60.0;

/// The state of a store.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Status {
    /// All jobs of the current physics version.
    pub total: StateCounts,
    /// The same by campaign, in order of first use.
    pub campaigns: Vec<CampaignCounts>,
    /// Jobs of other physics versions.
    pub stale: u64,
    /// Clogs of the current physics version.
    pub clogs: u64,
    /// Failed jobs by class, most frequent first.
    pub failures: Vec<FailureCount>,
    /// The last run, which is the present one while there is a holder.
    pub run: Option<RunProgress>,
    /// The process that writes now.
    pub holder: Option<Holder>,
}

/// Numbers of jobs by state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StateCounts {
    /// Not begun.
    pub pending: u64,
    /// Being computed (or, without a holder, left by a process that died).
    pub running: u64,
    /// Finished with a result.
    pub done: u64,
    /// Finished without one.
    pub failed: u64,
}

impl StateCounts {
    /// All jobs.
    pub fn jobs(&self) -> u64 {
        self.pending + self.running + self.done + self.failed
    }

    pub(in crate::store) fn add(&mut self, state: &str, jobs: u64) {
        match state {
            "running" => self.running += jobs,
            "done" => self.done += jobs,
            "failed" => self.failed += jobs,
            _ => self.pending += jobs,
        }
    }
}

/// The jobs that a campaign brought.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CampaignCounts {
    /// Name of the campaign.
    pub campaign: String,
    /// Its jobs.
    pub counts: StateCounts,
}

/// Failures of one class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailureCount {
    /// The class, as in the column `error_class`.
    pub class: String,
    /// How many.
    pub jobs: u64,
    /// One of them.
    pub example_job: String,
    /// What happened to it.
    pub example: String,
}

/// Progress of a run: its rate is `finished_in_window/window_s`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunProgress {
    /// When it began, in unix seconds.
    pub started: f64,
    /// When it ended; `None` while it goes on, or if it was killed.
    pub ended: Option<f64>,
    /// Outcomes it has committed.
    pub finished: u64,
    /// The time up to now, or to its end, over which the next field counts: at most a minute, in seconds.
    pub window_s: f64,
    /// Outcomes in that time.
    pub finished_in_window: u64,
}

/// The state of the store in `dir`; a store that does not exist is an empty one.
///
/// # Errors
/// As [`open_reading`].
pub fn status(dir: &Path) -> Result<Status, StoreError> {
    let Some(conn) = open_reading(dir)? else { return Ok(Status::default()) };
    let read = || -> rusqlite::Result<Status> {
        // One transaction, so that all numbers are of one moment.
        let conn = conn.unchecked_transaction()?;
        let campaigns = campaigns(&conn)?;
        let mut total = StateCounts::default();
        for CampaignCounts { counts, .. } in &campaigns {
            total.pending += counts.pending;
            total.running += counts.running;
            total.done += counts.done;
            total.failed += counts.failed;
        }
        Ok(Status {
            total,
            campaigns,
            stale: count(&conn, &format!("SELECT count(*) FROM jobs WHERE {STALE}"))?,
            clogs: count(&conn, "SELECT count(*) FROM clogs")?
                - count(&conn, &format!("SELECT count(*) FROM jobs JOIN clogs ON clogs.job = jobs.key WHERE {STALE}"))?,
            failures: failures(&conn)?,
            run: progress(&conn, unix_now())?,
            holder: lock::holder(dir),
        })
    };
    read().map_err(StoreError::sql(&database(dir)))
}

/// Two ranges and not `<>`, for which SQLite would use no index.
const STALE: &str = "(physics_version < (SELECT physics_version FROM current)
                      OR physics_version > (SELECT physics_version FROM current))";

fn count(conn: &Connection, sql: &str) -> rusqlite::Result<u64> {
    conn.query_row(sql, [], |row| row.get::<_, i64>(0)).map(|count| count as u64)
}

fn campaigns(conn: &Connection) -> rusqlite::Result<Vec<CampaignCounts>> {
    let mut statement = conn.prepare(
        "SELECT campaigns.name, counts.state, counts.jobs FROM
             (SELECT campaign, state, count(*) AS jobs FROM jobs
              WHERE physics_version = (SELECT physics_version FROM current) GROUP BY campaign, state) AS counts
         JOIN campaigns ON campaigns.key = counts.campaign ORDER BY campaigns.key",
    )?;
    let mut rows = statement.query([])?;
    let mut campaigns: Vec<CampaignCounts> = Vec::new();
    while let Some(row) = rows.next()? {
        let (name, state, jobs): (String, String, i64) = (row.get(0)?, row.get(1)?, row.get(2)?);
        // A campaign whose text changed has several rows of one name.
        let index = campaigns.iter().position(|campaign| campaign.campaign == name).unwrap_or_else(|| {
            campaigns.push(CampaignCounts { campaign: name, counts: StateCounts::default() });
            campaigns.len() - 1
        });
        campaigns[index].counts.add(&state, jobs as u64);
    }
    Ok(campaigns)
}

fn failures(conn: &Connection) -> rusqlite::Result<Vec<FailureCount>> {
    // Beside max(), SQLite takes the other columns from the row of the maximum.
    let mut statement = conn.prepare(
        "SELECT error_class, count(*), jobs.job_id, error, max(outcomes.job)
         FROM outcomes JOIN jobs ON jobs.key = outcomes.job
         WHERE error_class IS NOT NULL AND physics_version = (SELECT physics_version FROM current)
         GROUP BY error_class ORDER BY count(*) DESC, error_class",
    )?;
    let failures = statement.query_map([], |row| {
        Ok(FailureCount {
            class: row.get(0)?,
            jobs: row.get::<_, i64>(1)? as u64,
            example_job: row.get(2)?,
            example: row.get(3)?,
        })
    });
    failures?.collect()
}

/// Key of the last run, when it began, and when it ended.
pub(super) fn last_provenance(conn: &Connection) -> rusqlite::Result<Option<(i64, f64, Option<f64>)>> {
    let sql = "SELECT key, started, ended FROM provenance ORDER BY key DESC LIMIT 1";
    conn.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).optional()
}

fn progress(conn: &Connection, now: f64) -> rusqlite::Result<Option<RunProgress>> {
    let Some((key, started, ended)) = last_provenance(conn)? else { return Ok(None) };
    let until = ended.unwrap_or(now);
    let window_s = (until - started).clamp(0.0, RATE_WINDOW_S);
    let since = |from: f64| {
        let sql = "SELECT count(*) FROM outcomes WHERE provenance = ?1 AND finished >= ?2";
        conn.query_row(sql, (key, from), |row| row.get::<_, i64>(0)).map(|count| count as u64)
    };
    let (finished, finished_in_window) = (since(0.0)?, since(until - window_s)?);
    Ok(Some(RunProgress { started, ended, finished, window_s, finished_in_window }))
}

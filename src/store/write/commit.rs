//! How a batch of outcomes gets in: first its samples as one file, safely on disk; then everything else in one
//! transaction.
//!
//! A crash between the two leaves a file that no row names, which the next opening removes. Committing a batch twice is
//! harmless: only jobs that are `pending` or `running` take an outcome, so each outcome counts exactly once.

use crate::parameters::JobId;
use crate::results::trajectory::{Arrest, Clog, Failure, Pinch, Samples, Trajectory};
use crate::store::disk;
use crate::store::end_state::{EndState, sealed};
use crate::store::error::StoreError;
use crate::store::folders::{database, dump_path};
use crate::store::sample_file::{self, SampleFile};
use crate::store::write::outlines::save_outlines;
use crate::store::write::{Store, catalogue};
use rusqlite::{Connection, OptionalExtension, params};
use std::collections::HashSet;
use std::path::Path;

/// Outcomes, and marks of jobs that started, that commit together.
#[derive(Debug, Default)]
pub(super) struct Batch {
    /// Jobs that workers took up.
    pub started: Vec<JobId>,
    /// States in which jobs ended.
    pub ends: Vec<(JobId, EndState)>,
    /// Jobs that ended.
    pub finished: Vec<FinishedJob>,
}

/// A job that ended.
#[derive(Debug)]
pub(super) struct FinishedJob {
    pub job: JobId,
    pub result: Result<Trajectory, Failure>,
    pub wall_s: f64,
    /// When the writer heard of it, in unix seconds.
    pub at: f64,
}

/// An outcome that the store does not have yet, and its job's key.
struct NewOutcome<'a> {
    key: i64,
    finished: &'a FinishedJob,
}

impl NewOutcome<'_> {
    /// The recorded series, if there is one.
    fn samples(&self) -> Option<(JobId, &Samples)> {
        let trajectory = self.finished.result.as_ref().ok()?;
        Some((self.finished.job, &trajectory.samples)).filter(|(_, samples)| !samples.is_empty())
    }
}

/// Commits a batch; returns the jobs that the store does not know and whose outcomes it therefore cannot keep.
///
/// # Errors
/// What the system, Parquet or SQLite report. Then nothing is committed, and the batch can be committed again.
pub(super) fn commit(store: &mut Store, batch: &Batch) -> Result<Vec<JobId>, StoreError> {
    let path = database(&store.dir);
    let (outcomes, unknown) = new_outcomes(&store.conn, &batch.finished).map_err(StoreError::sql(&path))?;
    let series: Vec<_> = outcomes.iter().filter_map(NewOutcome::samples).collect();
    let file = if series.is_empty() { None } else { Some(sample_file::write(&store.dir, &series)?) };
    let (run, dir) = (store.run, store.dir.clone());
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let save = || {
        if let Some(file) = &file {
            list_samples(&transaction, file, &outcomes)?;
        }
        outcomes.iter().try_for_each(|outcome| save_outcome(&transaction, outcome, run, &dir))?;
        batch.ends.iter().try_for_each(|(job, end)| save_end(&transaction, *job, end))?;
        mark_started(&transaction, &batch.started)
    };
    save().map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)?;
    Ok(unknown)
}

/// The outcomes whose jobs wait for one, the first of each job; and the jobs that are not in the store.
fn new_outcomes<'a>(
    conn: &Connection,
    finished: &'a [FinishedJob],
) -> rusqlite::Result<(Vec<NewOutcome<'a>>, Vec<JobId>)> {
    let mut find = conn.prepare_cached("SELECT key, state IN ('pending', 'running') FROM jobs WHERE job_id = ?1")?;
    let (mut outcomes, mut unknown, mut seen) = (Vec::with_capacity(finished.len()), Vec::new(), HashSet::new());
    for finished in finished {
        let found = find.query_row([finished.job.to_string()], |row| Ok((row.get(0)?, row.get(1)?))).optional()?;
        match found {
            None => unknown.push(finished.job),
            Some((key, true)) if seen.insert(key) => outcomes.push(NewOutcome { key, finished }),
            Some(_) => tracing::debug!(job = %finished.job, "this job has an outcome already, a second one is dropped"),
        }
    }
    Ok((outcomes, unknown))
}

/// Lists a new file in the catalogue, and where in it the rows of each job are.
fn list_samples(conn: &Connection, file: &SampleFile, outcomes: &[NewOutcome<'_>]) -> rusqlite::Result<()> {
    let file_key = catalogue::add(conn, file)?;
    let mut add_rows = conn.prepare_cached("INSERT OR REPLACE INTO sample_index VALUES (?1, ?2, ?3, ?4)")?;
    let mut first_row = 0;
    for outcome in outcomes {
        let Some((_, samples)) = outcome.samples() else { continue };
        let row_count = samples.len() as i64;
        add_rows.execute((outcome.key, file_key, first_row, row_count))?;
        first_row += row_count;
    }
    Ok(())
}

fn save_outcome(conn: &Connection, outcome: &NewOutcome<'_>, run: Option<i64>, dir: &Path) -> rusqlite::Result<()> {
    let NewOutcome { key, finished: FinishedJob { job, result, wall_s, at } } = outcome;
    // A job whose mark of having started got lost is still `pending`: that was an attempt too.
    let mut set_state =
        conn.prepare_cached("UPDATE jobs SET attempts = attempts + (state = 'pending'), state = ?2 WHERE key = ?1")?;
    match result {
        Ok(run_result) => {
            set_state.execute((key, "done"))?;
            save_trajectory(conn, *key, run_result, *wall_s, *at, run)?;
            save_outlines(conn, *key, &run_result.outlines)?;
            run_result.clog.iter().try_for_each(|clog| save_clog(conn, *key, clog))?;
            run_result.arrest.iter().try_for_each(|arrest| save_arrest(conn, *key, arrest))?;
            run_result.pinch.iter().try_for_each(|pinch| save_pinch(conn, *key, pinch))
        }
        Err(failure) => {
            set_state.execute((key, "failed"))?;
            save_outlines(conn, *key, failure.outline.as_deref())?;
            let mut insert = conn.prepare_cached(
                "INSERT OR REPLACE INTO outcomes
                     (job, wall_s, error_class, error, error_step, provenance, finished, dump)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            )?;
            let (class, step) = (failure.class.name(), integer(failure.step));
            // The worker wrote it before it told the failure; it is not there if the disk was full.
            let dump = Some(dump_path(*job)).filter(|dump| dir.join(dump).exists());
            insert.execute(params![key, wall_s, class, failure.reason, step, run, at, dump]).map(drop)
        }
    }
}

fn save_trajectory(
    conn: &Connection,
    key: i64,
    trajectory: &Trajectory,
    wall_s: f64,
    at: f64,
    run: Option<i64>,
) -> rusqlite::Result<()> {
    let mut insert = conn.prepare_cached(
        "INSERT OR REPLACE INTO outcomes (job, outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max,
             area_error_max, overlap_max, energy_rise_max, ek_ratio_min, engulfed_t, refused, delta_s, steps, wall_s,
             provenance, finished)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18)",
    )?;
    insert.execute(params![
        key,
        trajectory.outcome.name(),
        trajectory.r_end,
        trajectory.t_end,
        trajectory.v_g_mean,
        trajectory.ek_ratio_end,
        trajectory.shape_max,
        trajectory.area_error_max,
        trajectory.overlap_max,
        trajectory.energy_rise_max,
        trajectory.ek_ratio_min,
        trajectory.engulfed_t,
        integer(trajectory.refused),
        trajectory.delta_s,
        integer(trajectory.steps),
        wall_s,
        run,
        at,
    ])?;
    Ok(())
}

fn save_clog(conn: &Connection, key: i64, clog: &Clog) -> rusqlite::Result<()> {
    let mut insert = conn.prepare_cached("INSERT OR REPLACE INTO clogs VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)")?;
    let Clog { t, r, x, y, ek_ratio, shape, contacts, mechanism } = clog;
    insert.execute(params![key, t, r, x, y, ek_ratio, shape, contacts, mechanism.map(|mechanism| mechanism.name())])?;
    Ok(())
}

fn save_arrest(conn: &Connection, key: i64, arrest: &Arrest) -> rusqlite::Result<()> {
    let mut insert = conn.prepare_cached("INSERT OR REPLACE INTO arrests VALUES (?1, ?2, ?3, ?4, ?5, ?6)")?;
    let Arrest { r, x, y, way_left, energy_left } = arrest;
    insert.execute(params![key, r, x, y, way_left, energy_left]).map(drop)
}

fn save_pinch(conn: &Connection, key: i64, pinch: &Pinch) -> rusqlite::Result<()> {
    let mut insert = conn.prepare_cached("INSERT OR REPLACE INTO pinches VALUES (?1, ?2, ?3)")?;
    let Pinch { x, y } = pinch;
    insert.execute(params![key, x, y]).map(drop)
}

fn save_end(conn: &Connection, job: JobId, end: &EndState) -> rusqlite::Result<()> {
    let mut insert = conn
        .prepare_cached("INSERT OR REPLACE INTO end_states SELECT key, ?2, ?3, ?4, ?5 FROM jobs WHERE job_id = ?1")?;
    let EndState { course, step, distance, state } = end;
    insert.execute(params![job.to_string(), course.to_string(), integer(*step), distance, sealed(state)]).map(drop)
}

fn mark_started(conn: &Connection, started: &[JobId]) -> rusqlite::Result<()> {
    let mut mark = conn.prepare_cached(
        "UPDATE jobs SET state = 'running', attempts = attempts + 1 WHERE job_id = ?1 AND state = 'pending'",
    )?;
    started.iter().try_for_each(|job| mark.execute([job.to_string()]).map(drop))
}

/// A count of steps for SQLite, whose integers end at 2^63.
fn integer(steps: u64) -> i64 {
    i64::try_from(steps).unwrap_or(i64::MAX)
}

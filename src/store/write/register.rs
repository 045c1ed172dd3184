//! What a run writes before it computes: the campaign, its grid points and pending jobs, and which program runs them.

use crate::campaign::file::Campaign;
use crate::parameters::{JobId, PHYSICS_VERSION, Point, PointId};
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::holder::Holder;
use crate::store::schema::points;
use crate::store::write::{Store, give_back};
use crate::store::{disk, unix_now};
use rusqlite::{Connection, params, params_from_iter};
use std::ops::Range;

/// A campaign as it is kept: its name and the text of its file.
#[derive(Clone, Copy, Debug)]
pub struct CampaignRecord<'a> {
    /// Name of the campaign, the column `campaign` of `runs`.
    pub name: &'a str,
    /// The whole campaign file.
    pub text: &'a str,
}

/// One grid point of a plan and the seeds it shall have.
#[derive(Clone, Debug)]
pub struct PlannedPoint<'a> {
    /// The parameters.
    pub point: &'a Point,
    /// Their identity, `point.id()`.
    pub point_id: PointId,
    /// Seeds of its runs, all below 2^63.
    pub seeds: Range<u64>,
    /// The name of its block, the column `block` of `runs`.
    pub block: &'a str,
}

impl PlannedPoint<'_> {
    /// The planned points of all blocks of a campaign, in their order.
    pub(crate) fn all(campaign: &Campaign) -> impl Iterator<Item = PlannedPoint<'_>> {
        campaign.blocks.iter().flat_map(|block| {
            let points = block.points.iter().zip(&block.point_ids);
            points.map(|(point, &point_id)| PlannedPoint {
                point,
                point_id,
                seeds: block.seeds.clone(),
                block: &block.name,
            })
        })
    }
}

/// What [`Store::register`] found and added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Registered {
    /// Key of the campaign in the store, for [`Provenance::campaign`].
    pub campaign: i64,
    /// Grid points that were new.
    pub new_points: usize,
    /// Jobs that were new.
    pub new_jobs: usize,
}

/// What computes a run. The caller tells these; the store adds host and process.
#[derive(Clone, Copy, Debug)]
pub struct Provenance<'a> {
    /// Version of the program.
    pub program_version: &'a str,
    /// Commit it was built from.
    pub git_commit: &'a str,
    /// Compiler that built it.
    pub rustc: &'a str,
    /// Instruction sets in use.
    pub cpu_features: &'a str,
    /// Key of the campaign ([`Registered::campaign`]).
    pub campaign: i64,
}

impl Store {
    /// Adds a campaign, its points and one pending job a seed, where they are not there yet, in one transaction.
    ///
    /// Nothing that is there changes: a job that another campaign or block brought stays with that one, and keeps its
    /// state and result.
    ///
    /// # Errors
    /// [`StoreError::SeedTooLarge`]; else what SQLite reports, and then nothing was added.
    pub fn register(
        &mut self,
        campaign: &CampaignRecord<'_>,
        points: &[PlannedPoint<'_>],
    ) -> Result<Registered, StoreError> {
        if let Some(planned) = points.iter().find(|planned| i64::try_from(planned.seeds.end).is_err()) {
            return Err(StoreError::SeedTooLarge(planned.seeds.end));
        }
        let path = database(&self.dir);
        let transaction = self.conn.transaction().map_err(StoreError::sql(&path))?;
        let registered = register(&transaction, campaign, points).map_err(StoreError::sql(&path))?;
        disk::commit(transaction, &path)?;
        Ok(registered)
    }

    /// Notes that a run begins; outcomes written from now on belong to it. Returns its key in `provenance`.
    ///
    /// # Errors
    /// What SQLite reports, for example for an unknown campaign key.
    pub fn begin_run(&mut self, provenance: &Provenance<'_>) -> Result<i64, StoreError> {
        let Holder { pid, host } = Holder::this_process();
        let Provenance { program_version, git_commit, rustc, cpu_features, campaign } = *provenance;
        let path = database(&self.dir);
        let transaction = self.conn.transaction().map_err(StoreError::sql(&path))?;
        let inserted = transaction.execute(
            "INSERT INTO provenance
                 (program_version, git_commit, rustc, cpu_features, host, pid, campaign, started)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            params![program_version, git_commit, rustc, cpu_features, host, pid, campaign, unix_now()],
        );
        inserted.map_err(StoreError::sql(&path))?;
        let key = transaction.last_insert_rowid();
        disk::commit(transaction, &path)?;
        self.run = Some(key);
        Ok(key)
    }

    /// Notes that the run that [`Store::begin_run`] began has ended, and sets jobs under way back to `pending`.
    /// Without such a run it does nothing.
    ///
    /// # Errors
    /// What SQLite reports.
    pub(crate) fn end_run(&mut self) -> Result<(), StoreError> {
        let Some(run) = self.run.take() else { return Ok(()) };
        let path = database(&self.dir);
        let transaction = self.conn.transaction().map_err(StoreError::sql(&path))?;
        let end = || {
            transaction.execute("UPDATE provenance SET ended = ?1 WHERE key = ?2", (unix_now(), run))?;
            give_back(&transaction)
        };
        end().map_err(StoreError::sql(&path))?;
        disk::commit(transaction, &path)
    }
}

fn register(
    transaction: &Connection,
    campaign: &CampaignRecord<'_>,
    points: &[PlannedPoint<'_>],
) -> rusqlite::Result<Registered> {
    let mut registered = Registered { campaign: add_campaign(transaction, campaign)?, new_points: 0, new_jobs: 0 };
    let mut add_job = transaction.prepare(
        "INSERT INTO jobs (job_id, point, campaign, block, seed, physics_version) VALUES (?1, ?2, ?3, ?4, ?5, ?6)
         ON CONFLICT (job_id) DO NOTHING",
    )?;
    let mut point_key = transaction.prepare("SELECT key FROM points WHERE point_id = ?1")?;
    for planned in points {
        registered.new_points += add_point(transaction, planned)?;
        let point: i64 = point_key.query_row([planned.point_id.to_string()], |row| row.get(0))?;
        for seed in planned.seeds.clone() {
            let job_id = JobId::new(planned.point_id, seed).to_string();
            registered.new_jobs +=
                add_job.execute((job_id, point, registered.campaign, planned.block, seed as i64, PHYSICS_VERSION))?;
        }
    }
    Ok(registered)
}

fn add_campaign(conn: &Connection, campaign: &CampaignRecord<'_>) -> rusqlite::Result<i64> {
    let hash = blake3::hash(campaign.text.as_bytes()).to_hex();
    conn.query_row(
        "INSERT INTO campaigns (name, text, text_hash, first_used, last_used) VALUES (?1, ?2, ?3, ?4, ?4)
         ON CONFLICT (name, text_hash) DO UPDATE SET last_used = excluded.last_used RETURNING key",
        params![campaign.name, campaign.text, hash.as_str(), unix_now()],
        |row| row.get(0),
    )
}

/// Adds a grid point with its parameters as columns; returns 1, or 0 if it was there.
fn add_point(conn: &Connection, planned: &PlannedPoint<'_>) -> rusqlite::Result<usize> {
    let values = points::values(planned.point);
    let mut add = conn.prepare_cached(&format!(
        "INSERT INTO points (point_id, spec, {}) VALUES (?, ?{}) ON CONFLICT (point_id) DO NOTHING",
        points::names(),
        ", ?".repeat(values.len())
    ))?;
    let identity = [planned.point_id.to_string().into(), planned.point.canonical().into()];
    add.execute(params_from_iter(identity.into_iter().chain(values)))
}

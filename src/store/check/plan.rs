//! The plans of the stored campaigns against the jobs: every job that a plan names is in the store.
//!
//! A program whose defaults changed makes other points of the same text; a plan of which the store knows no point is
//! such a one, and not judged.

use crate::campaign::file::Campaign;
use crate::parameters::{JobId, PHYSICS_VERSION};
use crate::store::check::Examination;
use crate::store::register::{CampaignRecord, PlannedPoint};
use crate::store::{Store, StoreError, database};
use rusqlite::Connection;
use std::collections::HashSet;

/// A campaign some of whose jobs are missing.
struct Short {
    campaign: Campaign,
    missing: u64,
}

/// Reports jobs that a plan names and the store does not know.
pub(super) fn check(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    for Short { campaign, missing } in short(conn).map_err(StoreError::sql(&database(work.dir)))? {
        let problem = format!("{missing} jobs of the plan of `{}` are not in it", campaign.name);
        work.find(database(work.dir), problem, "a repair or the next `run` adds them");
    }
    Ok(())
}

/// Adds the missing jobs.
pub(super) fn repair(work: &mut Examination<'_>, store: &mut Store) -> Result<(), StoreError> {
    for Short { campaign, missing } in short(&store.conn).map_err(StoreError::sql(&database(work.dir)))? {
        let points: Vec<_> = PlannedPoint::all(&campaign).collect();
        store.register(&CampaignRecord { name: &campaign.name, text: &campaign.text }, &points)?;
        let problem = format!("{missing} jobs of the plan of `{}` were not in it", campaign.name);
        work.find(database(work.dir), problem, "added, as pending");
    }
    Ok(())
}

fn short(conn: &Connection) -> rusqlite::Result<Vec<Short>> {
    // A campaign that brought none of the present jobs was planned by a program of another physics.
    let texts: Vec<(String, String, String)> = conn
        .prepare(
            "SELECT name, text, text_hash FROM campaigns WHERE EXISTS
                 (SELECT 1 FROM jobs WHERE campaign = campaigns.key AND physics_version = ?1)",
        )?
        .query_map([PHYSICS_VERSION], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?
        .collect::<rusqlite::Result<_>>()?;
    let known_points: HashSet<String> = conn
        .prepare("SELECT point_id FROM points")?
        .query_map([], |row| row.get(0))?
        .collect::<rusqlite::Result<_>>()?;
    let known_jobs: HashSet<JobId> = {
        let mut statement = conn.prepare("SELECT job_id FROM jobs")?;
        let ids = statement.query_map([], |row| Ok(row.get_ref(0)?.as_str().ok().and_then(|id| id.parse().ok())))?;
        ids.filter_map(Result::transpose).collect::<rusqlite::Result<_>>()?
    };
    let mut short = Vec::new();
    for (name, text, hash) in texts {
        // A text that this program does not read, or that is not what was written, plans nothing.
        let whole = blake3::hash(text.as_bytes()).to_hex().as_str() == hash;
        let Some(campaign) = Campaign::parse(&name, &text).ok().filter(|_| whole) else { continue };
        if !PlannedPoint::all(&campaign).any(|planned| known_points.contains(&planned.point_id.to_string())) {
            continue;
        }
        let ids = PlannedPoint::all(&campaign)
            .flat_map(|planned| planned.seeds.map(move |seed| JobId::new(planned.point_id, seed)));
        let missing = ids.filter(|id| !known_jobs.contains(id)).collect::<HashSet<_>>().len() as u64;
        if missing > 0 {
            short.push(Short { campaign, missing });
        }
    }
    Ok(short)
}

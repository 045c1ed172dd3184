//! What goes from a store with some of its campaigns, and what stays because others plan it too.
//!
//! A job belongs to the campaign that brought it first. If that one goes, the job goes over to the first of the others
//! whose text plans it, or it goes too. A text plans its points with its seeds; with `until`, with as many seeds as its
//! rounds may reach.

use crate::campaign::file::{Block, Campaign};
use crate::store::write::catalogue::JobSpan;
use rusqlite::Connection;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::rc::Rc;

/// What goes, by keys in the database.
#[derive(Debug)]
pub(super) struct Division {
    /// The campaigns.
    pub campaigns: Vec<i64>,
    /// The jobs, ascending.
    pub jobs: Vec<i64>,
    /// Jobs of these campaigns that stay.
    pub handed_over: Vec<Heritage>,
    /// The names of the other campaigns whose texts cannot be read.
    pub unread: Vec<String>,
}

/// A job, and to which campaign and block it goes over.
#[derive(Debug)]
pub(super) struct Heritage {
    pub job: i64,
    pub campaign: i64,
    pub block: Rc<str>,
}

/// Points that lose something, by keys in the database.
#[derive(Debug)]
pub(super) struct Points {
    /// Those that no job is left of.
    pub gone: Vec<i64>,
    /// Those that lose a result, or all: their fits were made with what goes.
    pub fitted: Vec<i64>,
}

/// How much of a sample file belongs to jobs that go.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Share {
    Nothing,
    Part,
    All,
}

/// The seeds that a block of a campaign plans at a point.
struct PlannedSeeds {
    seeds: Range<u64>,
    campaign: i64,
    block: Rc<str>,
}

impl Division {
    /// What goes with the campaigns that `goes` picks by their keys.
    pub(super) fn of(conn: &Connection, goes: impl Fn(i64) -> bool) -> rusqlite::Result<Self> {
        let mut division =
            Self { campaigns: Vec::new(), jobs: Vec::new(), handed_over: Vec::new(), unread: Vec::new() };
        let mut planned = HashMap::new();
        let mut texts = conn.prepare("SELECT key, name, text FROM campaigns ORDER BY key")?;
        let mut rows = texts.query([])?;
        while let Some(row) = rows.next()? {
            let (key, name, text): (i64, String, String) = (row.get(0)?, row.get(1)?, row.get(2)?);
            if goes(key) {
                division.campaigns.push(key);
                continue;
            }
            let readings = Campaign::readings(&text);
            readings.iter().flat_map(|read| &read.blocks).for_each(|block| plan(&mut planned, key, block));
            if readings.is_empty() && !division.unread.contains(&name) {
                division.unread.push(name);
            }
        }
        division.divide(conn, &planned)?;
        Ok(division)
    }

    /// Finds an heir for each job of the campaigns that go.
    fn divide(&mut self, conn: &Connection, planned: &HashMap<String, Vec<PlannedSeeds>>) -> rusqlite::Result<()> {
        let mut jobs = conn.prepare(
            "SELECT jobs.key, points.point_id, jobs.seed FROM jobs JOIN points ON points.key = jobs.point
             WHERE jobs.campaign = ?1 ORDER BY jobs.key",
        )?;
        for &campaign in &self.campaigns {
            let mut rows = jobs.query([campaign])?;
            while let Some(row) = rows.next()? {
                let (job, point, seed) = (row.get(0)?, row.get_ref(1)?.as_str()?, row.get::<_, i64>(2)? as u64);
                let heir = planned.get(point).into_iter().flatten().find(|planned| planned.seeds.contains(&seed));
                match heir {
                    None => self.jobs.push(job),
                    Some(PlannedSeeds { campaign, block, .. }) => {
                        self.handed_over.push(Heritage { job, campaign: *campaign, block: block.clone() });
                    }
                }
            }
        }
        self.jobs.sort_unstable();
        Ok(())
    }

    /// Whether a job goes.
    pub(super) fn takes(&self, job: i64) -> bool {
        self.jobs.binary_search(&job).is_ok()
    }

    /// How much of a sample file goes that holds rows of these jobs.
    pub(super) fn share(&self, jobs: &[JobSpan]) -> Share {
        match jobs.iter().filter(|job| self.takes(job.key)).count() {
            0 => Share::Nothing,
            gone if gone == jobs.len() => Share::All,
            _ => Share::Part,
        }
    }

    /// The points that lose something.
    pub(super) fn points(&self, conn: &Connection) -> rusqlite::Result<Points> {
        let mut find = conn.prepare("SELECT point, state = 'done' FROM jobs WHERE key = ?1")?;
        let mut lost: BTreeMap<i64, i64> = BTreeMap::new();
        let mut fitted = BTreeSet::new();
        for job in &self.jobs {
            let (point, has_result) = find.query_row([job], |row| Ok((row.get(0)?, row.get(1)?)))?;
            *lost.entry(point).or_default() += 1;
            if has_result {
                fitted.insert(point);
            }
        }
        let mut count = conn.prepare("SELECT count(*) FROM jobs WHERE point = ?1")?;
        let mut gone = Vec::new();
        for (point, lost) in lost {
            if count.query_row([point], |row| row.get::<_, i64>(0))? == lost {
                gone.push(point);
            }
        }
        fitted.extend(&gone);
        Ok(Points { gone, fitted: fitted.into_iter().collect() })
    }
}

/// Notes what a block plans.
fn plan(planned: &mut HashMap<String, Vec<PlannedSeeds>>, campaign: i64, block: &Block) {
    let Range { start, end } = block.seeds;
    let most = block.until.map_or(end, |until| end.max(start.saturating_add(until.max_runs)));
    let name: Rc<str> = block.name.as_str().into();
    for point in &block.point_ids {
        let seeds = PlannedSeeds { seeds: start..most, campaign, block: name.clone() };
        planned.entry(point.to_string()).or_default().push(seeds);
    }
}

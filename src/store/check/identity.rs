//! Points and jobs against the hashes that name them: a parameter or a seed that changed on the disk has another id.

use crate::parameters::{JobId, PointId};
use crate::store::read::parse_point;
use crate::store::register::{column_names, columns};
use rusqlite::types::Value;
use rusqlite::{Connection, Transaction};
use std::collections::HashMap;

/// Rows that are not what their id says.
#[derive(Debug, Default)]
pub(super) struct Wrong {
    points: Vec<i64>,
    jobs: Vec<i64>,
}

/// Finds the points whose text or columns do not belong to their id, and the jobs whose seed does not.
pub(super) fn wrong(conn: &Connection) -> rusqlite::Result<Wrong> {
    let mut wrong = Wrong::default();
    let mut points: HashMap<i64, PointId> = HashMap::new();
    let mut statement = conn.prepare(&format!("SELECT key, point_id, spec, {} FROM points", column_names()))?;
    let columns_end = statement.column_count();
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let key: i64 = row.get(0)?;
        let stored: Vec<Value> = (3..columns_end).map(|column| row.get(column)).collect::<rusqlite::Result<_>>()?;
        let id = row.get::<_, String>(1).ok().and_then(|id| id.parse::<PointId>().ok());
        let spec: String = row.get(2).unwrap_or_default();
        let sound = id.filter(|&id| PointId::of_canonical(&spec) == id);
        match sound.filter(|_| parse_point(&spec, key).is_ok_and(|point| columns(&point) == stored)) {
            Some(id) => drop(points.insert(key, id)),
            None => wrong.points.push(key),
        }
    }
    let mut statement = conn.prepare("SELECT key, job_id, point, seed, physics_version FROM jobs")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (key, point): (i64, i64) = (row.get(0)?, row.get(2)?);
        // Those of a wrong point go with it.
        let Some(&point) = points.get(&point) else { continue };
        let id = row.get_ref(1)?.as_str().ok().and_then(|id| id.parse::<JobId>().ok());
        let version = row.get::<_, u32>(4).ok();
        if version.map(|version| JobId::of_version(point, row.get::<_, i64>(3).unwrap_or(-1) as u64, version)) != id {
            wrong.jobs.push(key);
        }
    }
    Ok(wrong)
}

impl Wrong {
    /// What was found, in words.
    pub(super) fn told(&self) -> Vec<String> {
        let kinds = [(self.points.len(), "grid points"), (self.jobs.len(), "jobs")];
        let some = kinds.into_iter().filter(|(count, _)| *count > 0);
        some.map(|(count, kind)| format!("{count} {kind} that are not what their id, a hash, says")).collect()
    }

    /// Drops these rows; what refers to them is dropped by the rules that follow.
    pub(super) fn drop_all(&self, transaction: &Transaction<'_>) -> rusqlite::Result<()> {
        for (keys, sql) in
            [(&self.points, "DELETE FROM points WHERE key = ?1"), (&self.jobs, "DELETE FROM jobs WHERE key = ?1")]
        {
            let mut drop = transaction.prepare(sql)?;
            keys.iter().try_for_each(|key| drop.execute([key]).map(|_| ()))?;
        }
        Ok(())
    }
}

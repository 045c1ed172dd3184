//! Rows against each other, by three kinds of rule: ids are hashes of what they name, rows refer to rows that exist,
//! and the end of a job has all that belongs to it.
//!
//! A job whose end breaks a rule is computed again: what is stored of its end goes, and its state is `pending`. Jobs
//! of another physics version cannot be computed again, so the rule about what a result must have beside it leaves
//! them alone.

use crate::store::check::{Examination, count, identity};
use crate::store::disk;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::schema::{self, points};
use crate::store::write::Store;
use rusqlite::Connection;
use std::collections::BTreeMap;

/// A query for the keys of rows that break a law.
struct Rule {
    /// What the rows are, after their number.
    what: &'static str,
    find: &'static str,
}

const fn rule(what: &'static str, find: &'static str) -> Rule {
    Rule { what, find }
}

const POINTS: Rule = rule(
    "grid points that are not what their id, a hash, says",
    "SELECT key FROM points WHERE NOT is_point(point_id, spec{parameters})",
);

const JOBS: Rule = rule(
    "jobs that are not what their id, a hash, says",
    "SELECT jobs.key FROM jobs JOIN points ON points.key = jobs.point
     WHERE NOT is_job(job_id, point_id, seed, physics_version)",
);

/// Each gives jobs that are to be computed again.
const ENDS: [Rule; 8] = [
    rule(
        "jobs that are done, without a result",
        "SELECT jobs.key FROM jobs LEFT JOIN outcomes ON outcomes.job = jobs.key
         WHERE state = 'done' AND outcome IS NULL",
    ),
    rule(
        "jobs that failed, without a reason",
        "SELECT jobs.key FROM jobs LEFT JOIN outcomes ON outcomes.job = jobs.key
         WHERE state = 'failed' AND error_class IS NULL",
    ),
    rule(
        "jobs that have not ended, with a result",
        "SELECT key FROM jobs WHERE state IN ('pending', 'running')
         AND (key IN (SELECT job FROM outcomes) OR key IN (SELECT job FROM clogs)
              OR key IN (SELECT job FROM sample_index))",
    ),
    rule(
        "jobs whose result and clog contradict each other",
        "SELECT jobs.key FROM jobs JOIN outcomes ON outcomes.job = jobs.key LEFT JOIN clogs ON clogs.job = jobs.key
         WHERE (outcome IS NOT NULL AND outcome = 'clogged') <> (clogs.job IS NOT NULL)",
    ),
    rule(
        "jobs whose result and arrest contradict each other",
        "SELECT jobs.key FROM jobs JOIN {arrests} AS arrests ON arrests.job = jobs.key
         LEFT JOIN outcomes ON outcomes.job = jobs.key WHERE outcome IS NOT 'time_limit'",
    ),
    rule(
        "jobs whose result and closed film contradict each other",
        "SELECT jobs.key FROM jobs JOIN {pinches} AS pinches ON pinches.job = jobs.key
         LEFT JOIN outcomes ON outcomes.job = jobs.key WHERE outcome IS NOT 'pinched'",
    ),
    rule(
        "jobs that failed, with samples",
        "SELECT key FROM jobs WHERE state = 'failed' AND key IN (SELECT job FROM sample_index)",
    ),
    rule(
        "jobs that are done, without samples or without their last shape",
        "SELECT key FROM jobs WHERE state = 'done' AND physics_version = (SELECT physics_version FROM current)
         AND (key NOT IN (SELECT job FROM sample_index) OR key NOT IN (SELECT job FROM shape_rows))",
    ),
];

/// Reports rows that break a rule.
pub(super) fn check(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    let path = database(work.dir);
    let judge = || -> rusqlite::Result<(u64, Vec<String>)> {
        identity::add_to(conn)?;
        let mut problems = Vec::new();
        for rule in [&POINTS, &JOBS].into_iter().chain(&ENDS) {
            problems.extend(described(rule, &keys(conn, rule)?, conn));
        }
        for ((table, missing), rows) in dangling(conn)? {
            problems.push(format!("{} rows of `{table}` that refer to no row of `{missing}`", rows.len()));
        }
        Ok((count(conn, "SELECT count(*) FROM jobs")?, problems))
    };
    let (jobs, problems) = judge().map_err(StoreError::sql(&path))?;
    work.report.jobs = jobs;
    for problem in problems {
        work.find(&path, problem, "a repair puts it right, and `run` computes again what is lost by it");
    }
    Ok(())
}

/// Puts rows that break a rule right, in one transaction.
pub(super) fn repair(work: &mut Examination<'_>, store: &mut Store) -> Result<(), StoreError> {
    let path = database(work.dir);
    let before = work.report.findings.len();
    check(work, &store.conn)?;
    if work.report.findings.len() == before {
        return Ok(());
    }
    let copy = work.copy_database(store)?;
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    let again = put_right(&transaction).map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)?;
    for finding in &mut work.report.findings[before..] {
        finding.cure = format!("put right, {again} jobs are pending again; the database as it was is {copy}");
    }
    Ok(())
}

/// Puts right what each kind of rule finds after the one before it; returns how many jobs are to be computed again.
fn put_right(conn: &Connection) -> rusqlite::Result<usize> {
    conn.pragma_update(None, "defer_foreign_keys", true)?;
    for (rule, sql) in [(&POINTS, "DELETE FROM points WHERE key = ?1"), (&JOBS, "DELETE FROM jobs WHERE key = ?1")] {
        keys(conn, rule)?.iter().try_for_each(|key| conn.prepare_cached(sql)?.execute([key]).map(drop))?;
    }
    // Three times: jobs refer to points, outcomes and series to jobs, and what is dropped may have been referred to.
    for _ in 0..3 {
        for ((table, missing), rows) in dangling(conn)? {
            rows.iter().try_for_each(|row| settle(conn, &table, &missing, *row))?;
        }
    }
    let mut again = 0;
    for rule in &ENDS {
        let keys = keys(conn, rule)?;
        keys.iter().try_for_each(|key| compute_again(conn, *key))?;
        again += keys.len();
    }
    Ok(again)
}

/// Rows that refer to a row that is not there, by their table and that in which it is missing.
fn dangling(conn: &Connection) -> rusqlite::Result<BTreeMap<(String, String), Vec<i64>>> {
    let mut statement = conn.prepare("SELECT \"table\", parent, rowid FROM pragma_foreign_key_check")?;
    let mut rows = statement.query([])?;
    let mut found: BTreeMap<_, Vec<i64>> = BTreeMap::new();
    while let Some(row) = rows.next()? {
        found.entry((row.get(0)?, row.get(1)?)).or_default().push(row.get(2)?);
    }
    Ok(found)
}

/// Drops a row that refers to nothing. But results outlive the campaign that brought them and the run that computed
/// them.
fn settle(conn: &Connection, table: &str, missing: &str, row: i64) -> rusqlite::Result<()> {
    let sql = match missing {
        "campaigns" => format!(
            "INSERT OR IGNORE INTO campaigns (key, name, text, text_hash, first_used, last_used)
             SELECT campaign, 'rescued', '', 'of campaign ' || campaign, 0, 0 FROM {table} WHERE rowid = ?1"
        ),
        "provenance" => format!("UPDATE {table} SET provenance = NULL WHERE rowid = ?1"),
        _ => format!("DELETE FROM {table} WHERE rowid = ?1"),
    };
    conn.prepare_cached(&sql)?.execute([row]).map(drop)
}

/// Removes all that is stored of a job's end, so that it is computed again.
pub(super) fn compute_again(conn: &Connection, job: i64) -> rusqlite::Result<()> {
    let ends = ["outcomes", "clogs", "arrests", "pinches", "end_states", "shape_rows", "sample_index"]
        .map(|table| format!("DELETE FROM {table} WHERE job = ?1"));
    for sql in ends.iter().map(String::as_str).chain(["UPDATE jobs SET state = 'pending' WHERE key = ?1"]) {
        conn.prepare_cached(sql)?.execute([job])?;
    }
    Ok(())
}

fn keys(conn: &Connection, rule: &Rule) -> rusqlite::Result<Vec<i64>> {
    let version: i64 = conn.pragma_query_value(None, "user_version", |row| row.get(0))?;
    let is_latest = usize::try_from(version) == Ok(schema::LATEST);
    let parameters = if is_latest { format!(", {}", points::names()) } else { String::new() };
    // Earlier schemas have no tables of arrests and of pinches.
    let [arrests, pinches] =
        ["arrests", "pinches"].map(|name| if is_latest { name } else { "(SELECT NULL AS job WHERE 0)" });
    let sql =
        rule.find.replace("{parameters}", &parameters).replace("{arrests}", arrests).replace("{pinches}", pinches);
    conn.prepare(&sql)?.query_map([], |row| row.get(0))?.collect()
}

/// How many rows break a rule, with a job among them; `None` if there are none.
fn described(rule: &Rule, keys: &[i64], conn: &Connection) -> Option<String> {
    let sql = "SELECT job_id FROM jobs WHERE key = ?1";
    let of_jobs = rule.what.starts_with("jobs");
    let example = conn.query_row(sql, [keys.first()?], |row| row.get::<_, String>(0)).ok().filter(|_| of_jobs);
    let example = example.map(|id| format!(", such as {id}")).unwrap_or_default();
    Some(format!("{} {}{example}", keys.len(), rule.what))
}

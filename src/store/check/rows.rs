//! Rows against each other: every rule is a query for the jobs, or the rows, that break it.
//!
//! A job that breaks a rule is computed again: what is stored of it goes, and its state is `pending`. Rows that refer to
//! nothing go too. Jobs of another physics version cannot be computed again; they lose their outcome only where it
//! contradicts itself.

use crate::store::check::{Examination, identity, keep_a_copy};
use crate::store::{Store, StoreError, database, disk};
use rusqlite::{Connection, Transaction};
use std::path::PathBuf;

/// What is done about the rows that a query finds.
#[derive(Clone, Copy)]
enum Cure {
    /// The query gives keys of jobs, which are computed again.
    Again,
    /// The query gives keys of this table, column `.1`, which go.
    Drop(&'static str, &'static str),
}

struct Rule {
    /// What the rows are, after their number.
    what: &'static str,
    keys: &'static str,
    cure: Cure,
}

const RULES: [Rule; 14] = [
    Rule {
        what: "jobs without a grid point or a campaign",
        keys: "SELECT key FROM jobs WHERE point NOT IN (SELECT key FROM points)
               OR campaign NOT IN (SELECT key FROM campaigns)",
        cure: Cure::Drop("jobs", "key"),
    },
    Rule {
        what: "outcomes without a job",
        keys: "SELECT job FROM outcomes WHERE job NOT IN (SELECT key FROM jobs)",
        cure: Cure::Drop("outcomes", "job"),
    },
    Rule {
        what: "clogs without a job",
        keys: "SELECT job FROM clogs WHERE job NOT IN (SELECT key FROM jobs)",
        cure: Cure::Drop("clogs", "job"),
    },
    Rule {
        what: "shapes without a job",
        keys: "SELECT DISTINCT job FROM shape_rows WHERE job NOT IN (SELECT key FROM jobs)",
        cure: Cure::Drop("shape_rows", "job"),
    },
    Rule {
        what: "series of samples without a job or a file",
        keys: "SELECT job FROM sample_index WHERE job NOT IN (SELECT key FROM jobs)
               OR file NOT IN (SELECT key FROM sample_files)",
        cure: Cure::Drop("sample_index", "job"),
    },
    Rule {
        what: "fits without a grid point",
        keys: "SELECT point FROM lambda_rows WHERE point NOT IN (SELECT key FROM points)",
        cure: Cure::Drop("lambda_rows", "point"),
    },
    Rule {
        what: "mean speeds without a grid point",
        keys: "SELECT point FROM speed_rows WHERE point NOT IN (SELECT key FROM points)",
        cure: Cure::Drop("speed_rows", "point"),
    },
    Rule {
        what: "jobs that are done, without a result",
        keys: "SELECT jobs.key FROM jobs LEFT JOIN outcomes ON outcomes.job = jobs.key
               WHERE state = 'done' AND outcome IS NULL",
        cure: Cure::Again,
    },
    Rule {
        what: "jobs that failed, without a reason",
        keys: "SELECT jobs.key FROM jobs LEFT JOIN outcomes ON outcomes.job = jobs.key
               WHERE state = 'failed' AND error_class IS NULL",
        cure: Cure::Again,
    },
    Rule {
        what: "jobs that have not ended, with a result",
        keys: "SELECT key FROM jobs WHERE state IN ('pending', 'running')
               AND (key IN (SELECT job FROM outcomes) OR key IN (SELECT job FROM clogs)
                    OR key IN (SELECT job FROM sample_index))",
        cure: Cure::Again,
    },
    Rule {
        what: "jobs whose result and clog contradict each other",
        keys: "SELECT jobs.key FROM jobs JOIN outcomes ON outcomes.job = jobs.key
               LEFT JOIN clogs ON clogs.job = jobs.key
               WHERE (outcome IS NOT NULL AND outcome = 'clogged') <> (clogs.job IS NOT NULL)",
        cure: Cure::Again,
    },
    Rule {
        what: "jobs that failed, with samples",
        keys: "SELECT key FROM jobs WHERE state = 'failed' AND key IN (SELECT job FROM sample_index)",
        cure: Cure::Again,
    },
    Rule {
        what: "jobs that are done, without samples",
        keys: "SELECT key FROM jobs WHERE state = 'done' AND physics_version = (SELECT physics_version FROM current)
               AND key NOT IN (SELECT job FROM sample_index)",
        cure: Cure::Again,
    },
    Rule {
        what: "jobs that are done, without their last shape",
        keys: "SELECT key FROM jobs WHERE state = 'done' AND physics_version = (SELECT physics_version FROM current)
               AND key NOT IN (SELECT job FROM shape_rows)",
        cure: Cure::Again,
    },
];

fn keys(conn: &Connection, sql: &str) -> rusqlite::Result<Vec<i64>> {
    conn.prepare(sql)?.query_map([], |row| row.get(0))?.collect()
}

/// Removes all that is stored of a job's end, so that it is computed again.
pub(super) fn forget(conn: &Connection, job: i64) -> rusqlite::Result<()> {
    for sql in [
        "DELETE FROM outcomes WHERE job = ?1",
        "DELETE FROM clogs WHERE job = ?1",
        "DELETE FROM shape_rows WHERE job = ?1",
        "DELETE FROM sample_index WHERE job = ?1",
        "UPDATE jobs SET state = 'pending' WHERE key = ?1",
    ] {
        conn.prepare_cached(sql)?.execute([job])?;
    }
    Ok(())
}

/// Reports rows that break a rule.
pub(super) fn check(work: &mut Examination<'_>, conn: &Connection) -> Result<(), StoreError> {
    let path = database(work.dir);
    work.report.jobs = crate::store::check::count(conn, "SELECT count(*) FROM jobs").map_err(StoreError::sql(&path))?;
    for wrong in identity::wrong(conn).map_err(StoreError::sql(&path))?.told() {
        work.find(&path, wrong, "a repair drops them, `run` adds and computes them again");
    }
    for rule in &RULES {
        let found = keys(conn, rule.keys).map_err(StoreError::sql(&path))?;
        if found.is_empty() {
            continue;
        }
        let cure = match rule.cure {
            Cure::Again => "a repair sets them back to pending, `run` computes them again",
            Cure::Drop(..) => "a repair drops them, keeping a copy of the database in quarantine/",
        };
        work.find(&path, told(conn, rule, &found), cure);
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
    let mut kept: Option<PathBuf> = None;
    keep_a_copy(store, &mut kept)?;
    let again = {
        let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
        let again = apply(&transaction).map_err(StoreError::sql(&path))?;
        disk::commit(transaction, &path)?;
        again
    };
    let place = kept.map(|place| crate::store::check::within(work.dir, &place)).unwrap_or_default();
    for finding in &mut work.report.findings[before..] {
        finding.cure = format!("put right, {again} jobs are pending again; the database as it was is {place}");
    }
    Ok(())
}

/// Cures in the order of the rules, each seeing what those before it left; returns how many jobs are pending again.
fn apply(transaction: &Transaction<'_>) -> rusqlite::Result<usize> {
    transaction.pragma_update(None, "defer_foreign_keys", true)?;
    identity::wrong(transaction)?.drop_all(transaction)?;
    let mut again = 0;
    for rule in &RULES {
        for key in keys(transaction, rule.keys)? {
            match rule.cure {
                Cure::Again => {
                    forget(transaction, key)?;
                    again += 1;
                }
                Cure::Drop(table, column) => {
                    transaction.prepare_cached(&format!("DELETE FROM {table} WHERE {column} = ?1"))?.execute([key])?;
                }
            }
        }
    }
    Ok(again)
}

fn told(conn: &Connection, rule: &Rule, found: &[i64]) -> String {
    let sql = "SELECT job_id FROM jobs WHERE key = ?1";
    let example: Option<String> = match rule.cure {
        Cure::Again => found.first().and_then(|key| conn.query_row(sql, [key], |row| row.get(0)).ok()),
        Cure::Drop(..) => None,
    };
    let example = example.map(|id| format!(", such as {id}")).unwrap_or_default();
    format!("{} {}{example}", found.len(), rule.what)
}

//! Campaigns leave a store: one transaction takes their rows out, and their files follow.

use crate::store::disk;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::forget::division::{Division, Share};
use crate::store::schema::references;
use crate::store::write::catalogue;
use crate::store::write::compact::Rewritten;
use crate::store::write::{Store, orphans};
use rusqlite::Connection;

/// Takes out of a store what goes from it.
///
/// Sample files that hold other rows too are written anew first, aside. A crash before the transaction leaves them to
/// the next opening, a crash after it leaves the old ones to it.
pub(super) fn take_out(store: &mut Store, division: &Division) -> Result<(), StoreError> {
    let path = database(&store.dir);
    let files = catalogue::list(&store.conn).map_err(StoreError::sql(&path))?;
    let mut rewritten = Vec::new();
    for listed in &files {
        let jobs = listed.jobs(&store.conn).map_err(StoreError::sql(&path))?;
        if division.share(&jobs) != Share::Nothing {
            rewritten.push(Rewritten::of(store, std::iter::once(listed), |job| !division.takes(job))?);
        }
    }
    let transaction = store.conn.transaction().map_err(StoreError::sql(&path))?;
    remove(&transaction, division, &rewritten).map_err(StoreError::sql(&path))?;
    disk::commit(transaction, &path)?;
    orphans::settle_samples(store)?;
    orphans::remove_samples(store)?;
    orphans::remove_checkpoints(store)
}

/// Removes the rows. SQLite would refuse to remove a row that another one still refers to.
fn remove(conn: &Connection, division: &Division, rewritten: &[Rewritten<'_>]) -> rusqlite::Result<()> {
    let points = division.points(conn)?;
    let mut hand_over = conn.prepare("UPDATE jobs SET campaign = ?2, block = ?3 WHERE key = ?1")?;
    for heritage in &division.handed_over {
        hand_over.execute((heritage.job, heritage.campaign, &heritage.block))?;
    }
    for (table, column) in references(conn, "jobs")? {
        delete(conn, &table, &column, division.jobs.iter())?;
    }
    delete(conn, "jobs", "key", division.jobs.iter())?;
    // These fits were made with runs that go; the next `fit` makes them from those that are left.
    for (table, column) in references(conn, "points")?.iter().filter(|(table, _)| table != "jobs") {
        delete(conn, table, column, points.fitted.iter())?;
    }
    delete(conn, "points", "key", points.gone.iter())?;
    rewritten.iter().try_for_each(|file| file.swap(conn))?;
    division.campaigns.iter().try_for_each(|campaign| settle_runs(conn, *campaign))?;
    delete(conn, "campaigns", "key", division.campaigns.iter())
}

/// Runs of a campaign that goes: those that computed an outcome that stays are told as runs of the campaign that has
/// the outcome now, so that it is still known which program computed it.
fn settle_runs(conn: &Connection, campaign: i64) -> rusqlite::Result<()> {
    conn.execute(
        "UPDATE provenance SET campaign = (
             SELECT min(jobs.campaign) FROM outcomes JOIN jobs ON jobs.key = outcomes.job
             WHERE outcomes.provenance = provenance.key
         ) WHERE campaign = ?1 AND EXISTS (SELECT 1 FROM outcomes WHERE outcomes.provenance = provenance.key)",
        [campaign],
    )?;
    conn.execute("DELETE FROM provenance WHERE campaign = ?1", [campaign]).map(drop)
}

/// Deletes the rows of a table whose column holds one of these keys.
fn delete<'a>(
    conn: &Connection,
    table: &str,
    column: &str,
    keys: impl Iterator<Item = &'a i64>,
) -> rusqlite::Result<()> {
    let mut delete = conn.prepare(&format!("DELETE FROM {table} WHERE {column} = ?1"))?;
    for key in keys {
        delete.execute([key])?;
    }
    Ok(())
}

//! `meniscus forget`: a campaign leaves a store, and lies in `quarantine/` as a store of its own.
//!
//! `division.rs` says what goes: the jobs that a campaign brought and that no other stored campaign plans. Jobs that
//! another one plans too go over to it. `copy.rs` makes the store in quarantine, and `removal.rs` takes the rest out of
//! this one. Both do the same thing to different halves: the copy is the store without all other campaigns.
//!
//! **Durability.** The copy is made in `forgetting/` and renamed into `quarantine/` when it is whole and on disk. Only
//! then one transaction removes the rows. Files follow it. If a crash comes before the rename, the next opening removes
//! `forgetting/`, and nothing has gone. If it comes between the rename and the transaction, the campaign is in both
//! places, and forgetting it again makes another copy. If it comes after the transaction, the next opening removes the
//! files that are left over. So the campaign is there whole or not at all.
//!
//! **Locking.** It holds the lock of the store, so no run goes on meanwhile. Queries that read samples keep the old
//! files until they end, as with compaction.
//!
//! **Compatibility.** Tables that refer to jobs or points are found by their foreign keys, so a later migration need
//! not be told here. What a campaign plans is read from its stored text, by this program.
//!
//! **Performance.** Sample files are linked, not copied, where the file system can do that. Only files that hold rows
//! of both halves are written anew.

mod copy;
mod division;
mod removal;

use crate::parameters::plain;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::forget::division::Division;
use crate::store::read;
use crate::store::read::status::StateCounts;
use crate::store::schema;
use crate::store::write::{Store, catalogue};
use rusqlite::Connection;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What goes from a store with a campaign, or has gone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Forgotten {
    /// The name of the campaign.
    pub campaign: String,
    /// How many texts of it go.
    pub texts: usize,
    /// The jobs that go, of any physics version.
    pub jobs: StateCounts,
    /// Jobs that stay because another campaign plans them too, by the name of the one that has them from now on.
    pub handed_over: BTreeMap<String, u64>,
    /// Grid points that no run is left of.
    pub points: u64,
    /// Fits and averages that go, because they were made with runs that go.
    pub fits: u64,
    /// Sample files of these jobs alone.
    pub files: u64,
    /// Sample files that are written anew without the rows of these jobs.
    pub files_rewritten: u64,
    /// Other campaigns whose texts this program cannot read, so that it does not know which jobs they plan.
    pub unread: Vec<String>,
}

/// What would go from the store in `dir` with the campaign of this name or id; changes nothing.
///
/// # Errors
/// [`StoreError::Missing`] without a store, [`StoreError::NoCampaign`], [`StoreError::Older`]; what SQLite reports.
pub fn forgettable(dir: &Path, campaign: &str) -> Result<Forgotten, StoreError> {
    let conn = read::open_reading(dir)?.ok_or_else(|| StoreError::Missing(dir.to_owned()))?;
    // One transaction, so that all numbers are of one moment.
    let conn = conn.unchecked_transaction().map_err(StoreError::sql(&database(dir)))?;
    let division = division_of(&conn, dir, campaign)?;
    describe(&conn, &division).map_err(StoreError::sql(&database(dir)))
}

/// Takes the campaign of this name or id out of the store in `dir`, after it was copied into `quarantine/`; returns
/// what has gone, and the folder of the copy, which is a store.
///
/// Jobs that another campaign of the store plans too stay, and belong to that one. A name stands for all texts that the
/// campaign has had, an id for one of them.
///
/// # Errors
/// [`StoreError::Missing`] without a store, [`StoreError::NoCampaign`], [`StoreError::Locked`] while another process
/// writes the store, [`StoreError::Damaged`] for a sample file that would have to be written anew; what SQLite or the
/// system report. The campaign is then in the store as it was, or, after an error of the last cleaning up, gone.
pub fn forget(dir: &Path, campaign: &str) -> Result<(Forgotten, PathBuf), StoreError> {
    let mut store = Store::open_existing(dir)?;
    let path = database(dir);
    let division = division_of(&store.conn, dir, campaign)?;
    let forgotten = describe(&store.conn, &division).map_err(StoreError::sql(&path))?;
    let place = copy::keep(&store, &division, &forgotten.campaign)?;
    removal::take_out(&mut store, &division)?;
    Ok((forgotten, place))
}

/// A stored text of a campaign.
struct StoredText {
    key: i64,
    name: String,
    id: String,
}

/// How much of an id is shown, and how much of it names a text at least.
const ID: usize = 10;
const LEAST_ID: usize = 6;

/// What goes with the campaign of this name or id.
fn division_of(conn: &Connection, dir: &Path, asked: &str) -> Result<Division, StoreError> {
    let path = database(dir);
    let list = || -> rusqlite::Result<Vec<StoredText>> {
        let mut statement = conn.prepare("SELECT key, name, text_hash FROM campaigns ORDER BY key")?;
        let texts =
            statement.query_map([], |row| Ok(StoredText { key: row.get(0)?, name: row.get(1)?, id: row.get(2)? }));
        texts?.collect()
    };
    let texts = list().map_err(StoreError::sql(&path))?;
    let mut found: Vec<i64> = texts.iter().filter(|text| text.name == asked).map(|text| text.key).collect();
    if found.is_empty() && asked.len() >= LEAST_ID {
        found = texts.iter().filter(|text| text.id.starts_with(asked)).map(|text| text.key).collect();
    }
    if found.is_empty() {
        return Err(StoreError::NoCampaign { dir: dir.to_owned(), asked: asked.to_owned(), known: known(&texts) });
    }
    Division::of(conn, |key| found.contains(&key)).map_err(StoreError::sql(&path))
}

/// The campaigns of a store, in words, each with the beginnings of its ids.
fn known(texts: &[StoredText]) -> String {
    let mut ids: Vec<(&str, Vec<&str>)> = Vec::new();
    for StoredText { name, id, .. } in texts {
        let id = id.get(..ID).unwrap_or(id);
        match ids.iter_mut().find(|(known, _)| known == name) {
            Some((_, ids)) => ids.push(id),
            None => ids.push((name, vec![id])),
        }
    }
    let named: Vec<String> =
        ids.iter().map(|(name, ids)| format!("`{}` (id {})", plain(name), plain(&ids.join(", ")))).collect();
    if named.is_empty() { "none".to_owned() } else { named.join(", ") }
}

fn describe(conn: &Connection, division: &Division) -> rusqlite::Result<Forgotten> {
    let name = "SELECT name FROM campaigns WHERE key = ?1";
    let name_of = |key: i64| conn.query_row(name, [key], |row| row.get::<_, String>(0));
    let mut forgotten = Forgotten {
        campaign: division.campaigns.first().map_or_else(|| Ok(String::new()), |&key| name_of(key))?,
        texts: division.campaigns.len(),
        unread: division.unread.clone(),
        ..Forgotten::default()
    };
    for heir in &division.handed_over {
        *forgotten.handed_over.entry(name_of(heir.campaign)?).or_default() += 1;
    }
    let mut state = conn.prepare("SELECT state FROM jobs WHERE key = ?1")?;
    for job in &division.jobs {
        forgotten.jobs.add(state.query_row([job], |row| row.get::<_, String>(0))?.as_str(), 1);
    }
    let points = division.points(conn)?;
    forgotten.points = points.gone.len() as u64;
    for (table, column) in schema::references(conn, "points")?.iter().filter(|(table, _)| table != "jobs") {
        let mut fits = conn.prepare(&format!("SELECT count(*) FROM {table} WHERE {column} = ?1"))?;
        for point in &points.fitted {
            forgotten.fits += fits.query_row([point], |row| row.get::<_, i64>(0))? as u64;
        }
    }
    for listed in catalogue::list(conn)? {
        match division.share(&listed.jobs(conn)?) {
            division::Share::Nothing => {}
            division::Share::Part => forgotten.files_rewritten += 1,
            division::Share::All => forgotten.files += 1,
        }
    }
    Ok(forgotten)
}

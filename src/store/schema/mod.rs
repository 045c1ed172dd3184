//! The tables of a store, and how a database of an earlier program becomes one of this program.
//!
//! The texts in `migrations/` are a flat list, and SQLite's `user_version` counts how many of them a database has had.
//! To change a table, append a text; a released text never changes. Columns that follow from what is stored are filled
//! afterwards (`derived.rs`). `application_id` says that a database is a store at all.
//!
//! **Compatibility.** Every schema so far is upgraded, and a test opens a store of each (`tests/store/fixtures`). A
//! newer one is refused before anything is touched, with both numbers. People query the views. A view that is given up
//! stays under its old name.
//!
//! **Durability.** A new database appears all at once (`birth.rs`). An older database is copied to `store.db.schema-N`
//! first. Then all that it lacks is one transaction, so a crash leaves it as it was or as it shall be.
//!
//! **Locking.** Only the holder of the store's lock upgrades. A reader that meets an older schema says so and changes
//! nothing.

pub(super) mod birth;
pub(super) mod columns;
pub(super) mod derived;
pub(super) mod points;

use crate::parameters::plain;
use crate::store::error::StoreError;
use crate::store::{connection, disk, entries};
use rusqlite::{Connection, TransactionBehavior};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const MIGRATIONS: &[&str] = &[
    include_str!("../../../migrations/0001_initial.sql"),
    include_str!("../../../migrations/0002_stability.sql"),
    include_str!("../../../migrations/0003_dumps.sql"),
    include_str!("../../../migrations/0004_files.sql"),
    include_str!("../../../migrations/0005_columns.sql"),
    include_str!("../../../migrations/0006_dynamics.sql"),
    include_str!("../../../migrations/0007_arrests.sql"),
    include_str!("../../../migrations/0008_end_states.sql"),
    include_str!("../../../migrations/0009_pinches.sql"),
    include_str!("../../../migrations/0010_survival.sql"),
];

/// The blake3 of the declarations that all of them make. With it, a database is compared in a fraction of the time that
/// making a model of it takes; a test says what it has to be.
const LATEST_HASH: &str = "8f02c6a6591701cfea28398445178a6e6bc010f17bde1020fbab33af20b01daa";

/// The latest schema of this program.
pub(super) const LATEST: usize = MIGRATIONS.len();

/// `Mnsc`, in the header of every store.
pub(super) const APPLICATION_ID: u32 = 0x4D6E_7363;

/// What a database holds, as its header says.
#[derive(Debug, PartialEq)]
enum Contents {
    /// Nothing was ever written to it.
    Nothing,
    /// A store that has had so many migrations.
    Store(usize),
    /// The tables of another program.
    Foreign,
}

fn contents(conn: &Connection) -> rusqlite::Result<Contents> {
    let pragma = |name| conn.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
    let objects: i64 = conn.query_row("SELECT count(*) FROM sqlite_master", [], |row| row.get(0))?;
    Ok(match (pragma("application_id")?, usize::try_from(pragma("user_version")?)) {
        (0, Ok(0)) if objects == 0 => Contents::Nothing,
        (id, Ok(version)) if id as u32 == APPLICATION_ID && version > 0 => Contents::Store(version),
        _ => Contents::Foreign,
    })
}

/// The schema of the database at `path`; `None` if nothing was ever written to it.
///
/// # Errors
/// [`StoreError::Newer`], [`StoreError::Foreign`].
pub(super) fn version(conn: &Connection, path: &Path) -> Result<Option<usize>, StoreError> {
    known_version(conn, path, LATEST)
}

fn known_version(conn: &Connection, path: &Path, known: usize) -> Result<Option<usize>, StoreError> {
    match contents(conn).map_err(StoreError::sql(path))? {
        Contents::Nothing => Ok(None),
        Contents::Store(found) if found <= known => Ok(Some(found)),
        Contents::Store(found) => Err(StoreError::Newer { path: path.to_owned(), found, known }),
        Contents::Foreign => Err(StoreError::Foreign(path.to_owned())),
    }
}

/// Whether the database at `path` can be read as a store: `false` if nothing was written to it yet.
///
/// # Errors
/// [`StoreError::Newer`], [`StoreError::Older`], [`StoreError::Foreign`] or [`StoreError::ForeignSchema`].
pub(super) fn is_readable(conn: &Connection, path: &Path) -> Result<bool, StoreError> {
    match version(conn, path)? {
        None => Ok(false),
        Some(LATEST) => refuse_foreign(conn, path, LATEST).map(|()| true),
        Some(found) => Err(StoreError::Older { path: path.to_owned(), found }),
    }
}

/// Brings the database at `path` to the latest schema, after a backup of an older store.
///
/// # Errors
/// [`StoreError::Newer`], [`StoreError::Foreign`] and [`StoreError::ForeignSchema`] before anything is touched; else
/// what SQLite reports.
pub(super) fn migrate(conn: &mut Connection, path: &Path) -> Result<(), StoreError> {
    if let Some(version) = version(conn, path)? {
        refuse_foreign(conn, path, version)?;
    }
    migrate_through(conn, path, MIGRATIONS, derived::fill)
}

/// What fills the columns that migrations have added.
type Fill = fn(&Connection) -> rusqlite::Result<()>;

fn migrate_through(conn: &mut Connection, path: &Path, migrations: &[&str], fill: Fill) -> Result<(), StoreError> {
    let version = known_version(conn, path, migrations.len())?.unwrap_or(0);
    if (1..migrations.len()).contains(&version) {
        let backup = back_up(conn, path, version)?;
        tracing::info!(backup = %backup.display(), from = version, to = migrations.len(), "upgrading the store");
    }
    if version < migrations.len() {
        let transaction =
            conn.transaction_with_behavior(TransactionBehavior::Immediate).map_err(StoreError::sql(path))?;
        apply(&transaction, &migrations[version..], migrations.len()).map_err(StoreError::sql(path))?;
        fill(&transaction).map_err(StoreError::sql(path))?;
        disk::commit(transaction, path)?;
    }
    Ok(())
}

/// Applies the texts that a database lacks, and counts them.
fn apply(transaction: &Connection, migrations: &[&str], number: usize) -> rusqlite::Result<()> {
    migrations.iter().try_for_each(|sql| transaction.execute_batch(sql))?;
    transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
    transaction.pragma_update(None, "user_version", number as i64)
}

/// Copies the database to `store.db.schema-N`; the name appears only once the copy is complete and on disk.
fn back_up(conn: &Connection, path: &Path, version: usize) -> Result<PathBuf, StoreError> {
    let backup = path.with_extension(format!("db.schema-{version}"));
    let half = path.with_extension("db.backup.tmp");
    disk::remove(&half)?;
    copy_to(conn, path, &half)?;
    disk::rename(&half, &backup)?;
    disk::sync_folder(path.parent().unwrap_or(path))?;
    Ok(backup)
}

/// Copies a sound database to a new file, which is safely on disk when this returns; `path` is where the database is.
pub(super) fn copy_to(conn: &Connection, path: &Path, copy: &Path) -> Result<(), StoreError> {
    // VACUUM takes an empty file for a new one.
    disk::create(copy)?;
    let name = connection::name(copy);
    let name = name.to_str().ok_or_else(|| StoreError::io(copy)(std::io::Error::other("its name is not UTF-8")))?;
    conn.execute("VACUUM INTO ?1", [name]).map_err(StoreError::sql(path))?;
    let file = entries::open(copy).map_err(StoreError::io(copy))?;
    disk::sync(&file, copy)
}

/// The tables and columns that refer to rows of the table `parent`.
pub(super) fn references(conn: &Connection, parent: &str) -> rusqlite::Result<Vec<(String, String)>> {
    let mut statement = conn.prepare(
        "SELECT tables.name, keys.\"from\" FROM sqlite_master AS tables JOIN pragma_foreign_key_list(tables.name) AS keys
         WHERE tables.type = 'table' AND keys.\"table\" = ?1 ORDER BY tables.name",
    )?;
    statement.query_map([parent], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
}

/// Refuses a database that is not declared exactly as a store of this schema: what a stranger puts into a schema runs
/// when the database is used.
///
/// # Errors
/// [`StoreError::ForeignSchema`]; what SQLite reports.
fn refuse_foreign(conn: &Connection, path: &Path, version: usize) -> Result<(), StoreError> {
    let found = declarations(conn).map_err(StoreError::sql(path))?;
    if version == LATEST && hash(&found) == LATEST_HASH {
        return Ok(());
    }
    match differences(conn, version).map_err(StoreError::sql(path))?.into_iter().next() {
        Some(problem) => Err(StoreError::ForeignSchema { path: path.to_owned(), problem }),
        None => Ok(()),
    }
}

/// What is not declared in a database as in a store of this schema, in words.
pub(super) fn differences(conn: &Connection, version: usize) -> rusqlite::Result<Vec<String>> {
    let model = Connection::open_in_memory()?;
    MIGRATIONS.iter().take(version).try_for_each(|sql| model.execute_batch(sql))?;
    let (found, expected) = (declarations(conn)?, declarations(&model)?);
    let other = expected.iter().filter(|(name, sql)| found.get(*name) != Some(*sql));
    let other =
        other.map(|((kind, name), _)| format!("the {kind} `{name}` is not declared as schema {version} has it"));
    let foreign = found.keys().filter(|key| !expected.contains_key(*key));
    let foreign =
        foreign.map(|(kind, name)| format!("the {} `{}` is none of schema {version}", plain(kind), plain(name)));
    Ok(foreign.chain(other).collect())
}

/// Declarations by kind and name.
type Declarations = BTreeMap<(String, String), String>;

/// The declarations of a database. Tables that SQLite itself makes are left out: one that counts keys, and those of
/// `ANALYZE`, which other programs may have called.
fn declarations(conn: &Connection) -> rusqlite::Result<Declarations> {
    let mut statement = conn.prepare(
        "SELECT type, name, sql FROM sqlite_master WHERE sql IS NOT NULL
         AND NOT (type = 'table' AND name IN ('sqlite_sequence', 'sqlite_stat1', 'sqlite_stat4'))",
    )?;
    statement.query_map([], |row| Ok(((row.get(0)?, row.get(1)?), row.get(2)?)))?.collect()
}

/// The blake3 of declarations.
fn hash(declarations: &Declarations) -> String {
    let mut hasher = blake3::Hasher::new();
    for ((kind, name), sql) in declarations {
        for text in [kind, name, sql] {
            hasher.update(text.as_bytes()).update(&[0]);
        }
    }
    hasher.finalize().to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: &str = "CREATE TABLE a (x); INSERT INTO a VALUES (7);";
    const SECOND: &str = "ALTER TABLE a RENAME COLUMN x TO y;";
    const BROKEN: &str = "CREATE TABLE b (x); CREATE TABLE b (x);";

    fn nothing(_: &Connection) -> rusqlite::Result<()> {
        Ok(())
    }

    fn count(path: &Path, sql: &str) -> i64 {
        Connection::open(path).unwrap().query_row(sql, [], |row| row.get(0)).unwrap()
    }

    #[test]
    fn the_hash_of_the_latest_schema_is_that_of_its_declarations() {
        let model = Connection::open_in_memory().unwrap();
        MIGRATIONS.iter().for_each(|sql| model.execute_batch(sql).unwrap());
        assert_eq!(hash(&declarations(&model).unwrap()), LATEST_HASH);
    }

    #[test]
    fn a_database_with_anything_more_or_anything_else_in_its_schema_is_refused() {
        for foreign in [
            "CREATE TRIGGER t AFTER INSERT ON outcomes BEGIN UPDATE outcomes SET r_end = 1; END",
            "CREATE VIEW mine AS SELECT 1",
            "CREATE TABLE samples (job_id)",
            "CREATE INDEX i ON jobs (seed)",
            "DROP VIEW runs; CREATE VIEW runs AS SELECT 1",
            "DROP VIEW stability",
        ] {
            let mut conn = Connection::open_in_memory().unwrap();
            migrate(&mut conn, Path::new(":memory:")).unwrap();
            conn.execute_batch("ANALYZE").unwrap();
            assert!(is_readable(&conn, Path::new("")).unwrap());
            conn.execute_batch(foreign).unwrap();
            for refusal in
                [is_readable(&conn, Path::new("")).unwrap_err(), migrate(&mut conn, Path::new("")).unwrap_err()]
            {
                assert!(matches!(refusal, StoreError::ForeignSchema { .. }), "{foreign}: {refusal}");
            }
        }
    }

    #[test]
    fn an_older_store_is_backed_up_and_then_migrated() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("store.db");
        let mut conn = Connection::open(&path).unwrap();
        migrate_through(&mut conn, &path, &[FIRST], nothing).unwrap();
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "an empty store needs no backup");
        migrate_through(&mut conn, &path, &[FIRST, SECOND], nothing).unwrap();
        assert_eq!(count(&path, "SELECT y FROM a"), 7);
        assert_eq!(count(&dir.path().join("store.db.schema-1"), "SELECT x FROM a"), 7);
        assert_eq!(contents(&conn).unwrap(), Contents::Store(2));
    }

    #[test]
    fn a_migration_that_fails_leaves_the_store_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("store.db");
        let mut conn = Connection::open(&path).unwrap();
        migrate_through(&mut conn, &path, &[FIRST], nothing).unwrap();
        assert!(migrate_through(&mut conn, &path, &[FIRST, BROKEN], nothing).is_err());
        assert_eq!(contents(&conn).unwrap(), Contents::Store(1));
        assert_eq!(count(&path, "SELECT count(*) FROM sqlite_master WHERE name = 'b'"), 0);
    }

    #[test]
    fn newer_stores_and_other_databases_are_refused_untouched() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("store.db");
        let mut conn = Connection::open(&path).unwrap();
        migrate_through(&mut conn, &path, &[FIRST, SECOND], nothing).unwrap();
        let refusal = migrate_through(&mut conn, &path, &[FIRST], nothing).unwrap_err();
        assert!(matches!(refusal, StoreError::Newer { found: 2, known: 1, .. }), "{refusal}");

        let foreign = dir.path().join("foreign.db");
        let mut conn = Connection::open(&foreign).unwrap();
        conn.execute_batch("CREATE TABLE theirs (x)").unwrap();
        assert!(matches!(migrate(&mut conn, &foreign), Err(StoreError::Foreign(_))));
    }
}

//! The whole migration engine: a flat list of SQL texts, and `user_version` counting how many of them a store has had.
//!
//! `application_id` says that a database is a store at all. All that a store lacks is one transaction, so a crash
//! leaves it before or after. Append to the list; a released text never changes.

use super::StoreError;
use rusqlite::{Connection, TransactionBehavior};
use std::path::{Path, PathBuf};

const MIGRATIONS: &[&str] = &[
    include_str!("../../migrations/0001_initial.sql"),
    include_str!("../../migrations/0002_stability.sql"),
    include_str!("../../migrations/0003_dumps.sql"),
];

/// `Mnsc`, in the header of every store.
const APPLICATION_ID: i32 = 0x4D6E_7363;

/// What a database is to this program.
#[derive(Debug, PartialEq)]
enum Kind {
    /// Nothing was ever written to it.
    Empty,
    /// A store that has had so many migrations.
    Store(usize),
    /// Something else.
    Foreign,
}

fn kind(conn: &Connection) -> rusqlite::Result<Kind> {
    let pragma = |name| conn.pragma_query_value(None, name, |row| row.get::<_, i32>(0));
    let objects: i64 = conn.query_row("SELECT count(*) FROM sqlite_master", [], |row| row.get(0))?;
    Ok(match (pragma("application_id")?, usize::try_from(pragma("user_version")?)) {
        (0, Ok(0)) if objects == 0 => Kind::Empty,
        (APPLICATION_ID, Ok(version)) if version > 0 => Kind::Store(version),
        _ => Kind::Foreign,
    })
}

/// Brings the database at `path` to the latest schema, after a backup of an older store.
///
/// # Errors
/// [`StoreError::Newer`] and [`StoreError::Foreign`] before anything is touched; else what SQLite reports.
pub(super) fn migrate(conn: &mut Connection, path: &Path) -> Result<(), StoreError> {
    migrate_through(conn, path, MIGRATIONS)
}

fn migrate_through(conn: &mut Connection, path: &Path, migrations: &[&str]) -> Result<(), StoreError> {
    let version = match kind(conn).map_err(StoreError::sql(path))? {
        Kind::Empty => 0,
        Kind::Store(version) => version,
        Kind::Foreign => return Err(StoreError::Foreign(path.to_owned())),
    };
    if version > migrations.len() {
        return Err(StoreError::Newer { path: path.to_owned(), found: version, known: migrations.len() });
    }
    if (1..migrations.len()).contains(&version) {
        let backup = back_up(conn, path, version)?;
        tracing::info!(backup = %backup.display(), from = version, to = migrations.len(), "migrating the store");
    }
    if version < migrations.len() {
        apply(conn, &migrations[version..], migrations.len()).map_err(StoreError::sql(path))?;
    }
    Ok(())
}

/// All in one transaction: a reader sees the schema before or the schema after, and none between.
fn apply(conn: &mut Connection, migrations: &[&str], number: usize) -> rusqlite::Result<()> {
    let transaction = conn.transaction_with_behavior(TransactionBehavior::Immediate)?;
    migrations.iter().try_for_each(|sql| transaction.execute_batch(sql))?;
    transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
    transaction.pragma_update(None, "user_version", number as i64)?;
    transaction.commit()
}

/// Copies the database to `store.db.schema-N`; the name appears only once the copy is complete and on disk.
fn back_up(conn: &Connection, path: &Path, version: usize) -> Result<PathBuf, StoreError> {
    let backup = path.with_extension(format!("db.schema-{version}"));
    let half = path.with_extension("db.backup.tmp");
    match std::fs::remove_file(&half) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(StoreError::io(&half)(error)),
        _ => {}
    }
    conn.execute("VACUUM INTO ?1", [half.to_string_lossy()]).map_err(StoreError::sql(path))?;
    super::sync(&half)?;
    std::fs::rename(&half, &backup).map_err(StoreError::io(&backup))?;
    super::sync(path.parent().unwrap_or(path))?;
    Ok(backup)
}

/// Whether the database at `path` can be read as a store: `false` if nothing was written to it yet.
///
/// # Errors
/// [`StoreError::Newer`], [`StoreError::Older`] or [`StoreError::Foreign`].
pub(super) fn check_readable(conn: &Connection, path: &Path) -> Result<bool, StoreError> {
    let path_buf = || path.to_owned();
    match kind(conn).map_err(StoreError::sql(path))? {
        Kind::Empty => Ok(false),
        Kind::Foreign => Err(StoreError::Foreign(path_buf())),
        Kind::Store(found) if found < MIGRATIONS.len() => Err(StoreError::Older { path: path_buf(), found }),
        Kind::Store(found) if found > MIGRATIONS.len() => {
            Err(StoreError::Newer { path: path_buf(), found, known: MIGRATIONS.len() })
        }
        Kind::Store(_) => Ok(true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: &str = "CREATE TABLE a (x); INSERT INTO a VALUES (7);";
    const SECOND: &str = "ALTER TABLE a RENAME COLUMN x TO y;";
    const BROKEN: &str = "CREATE TABLE b (x); CREATE TABLE b (x);";

    fn count(path: &Path, sql: &str) -> i64 {
        Connection::open(path).unwrap().query_row(sql, [], |row| row.get(0)).unwrap()
    }

    #[test]
    fn an_older_store_is_backed_up_and_then_migrated() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("store.db");
        let mut conn = Connection::open(&path).unwrap();
        migrate_through(&mut conn, &path, &[FIRST]).unwrap();
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "an empty store needs no backup");
        migrate_through(&mut conn, &path, &[FIRST, SECOND]).unwrap();
        assert_eq!(count(&path, "SELECT y FROM a"), 7);
        assert_eq!(count(&dir.path().join("store.db.schema-1"), "SELECT x FROM a"), 7);
        assert_eq!(kind(&conn).unwrap(), Kind::Store(2));
    }

    #[test]
    fn a_migration_that_fails_leaves_the_store_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("store.db");
        let mut conn = Connection::open(&path).unwrap();
        migrate_through(&mut conn, &path, &[FIRST]).unwrap();
        assert!(migrate_through(&mut conn, &path, &[FIRST, BROKEN]).is_err());
        assert_eq!(kind(&conn).unwrap(), Kind::Store(1));
        assert_eq!(count(&path, "SELECT count(*) FROM sqlite_master WHERE name = 'b'"), 0);
    }

    #[test]
    fn newer_stores_and_other_databases_are_refused_untouched() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("store.db");
        let mut conn = Connection::open(&path).unwrap();
        migrate_through(&mut conn, &path, &[FIRST, SECOND]).unwrap();
        let refusal = migrate_through(&mut conn, &path, &[FIRST]).unwrap_err();
        assert!(matches!(refusal, StoreError::Newer { found: 2, known: 1, .. }), "{refusal}");

        let foreign = dir.path().join("foreign.db");
        let mut conn = Connection::open(&foreign).unwrap();
        conn.execute_batch("CREATE TABLE theirs (x)").unwrap();
        assert!(matches!(migrate(&mut conn, &foreign), Err(StoreError::Foreign(_))));
    }
}

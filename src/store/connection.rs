//! Connections to databases that anybody may have made.
//!
//! SQLite runs what a schema holds: triggers, expressions of views and indices. So no connection fires triggers, trusts
//! functions in a schema, or lets the schema be written as a table. Whether the schema is ours at all is found out by
//! [`schema`](crate::store::schema) before anything is read or written.

use crate::store::folders::database;
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, Result};
use std::borrow::Cow;
use std::path::Path;

/// Longest value of a row, in bytes. The longest of ours is the text of a campaign.
const LONGEST_VALUE: i32 = 16 << 20;

/// Opens the database of the store in `dir` for writing; it must be there.
pub(super) fn writing(dir: &Path) -> Result<Connection> {
    open(&database(dir), OpenFlags::SQLITE_OPEN_READ_WRITE)
}

/// Opens a database as the flags say.
pub(super) fn open(path: &Path, flags: OpenFlags) -> Result<Connection> {
    harden(Connection::open_with_flags(name(path).as_ref(), flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?)
}

/// Opens a database by a URI that this program made.
pub(super) fn open_uri(uri: &str, flags: OpenFlags) -> Result<Connection> {
    harden(Connection::open_with_flags(uri, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?)
}

/// A path as SQLite takes it: one that begins with `file:` would be taken for a URI, which can say that nothing is
/// kept.
pub(super) fn name(path: &Path) -> Cow<'_, Path> {
    match path.is_absolute() {
        true => Cow::Borrowed(path),
        false => Cow::Owned(Path::new(".").join(path)),
    }
}

/// Has a connection run nothing that a schema holds.
fn harden(conn: Connection) -> Result<Connection> {
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false)?;
    conn.set_limit(Limit::SQLITE_LIMIT_LENGTH, LONGEST_VALUE)?;
    Ok(conn)
}

//! The operations that change a store, a function each.
//!
//! This is a seam for tests. The unit tests of this crate put [`faults`] behind it, which lets any one operation fail
//! or be the last before the process dies. Elsewhere each function is the system's call and nothing more.

#[cfg(test)]
#[path = "../../tests/store/faults.rs"]
pub(super) mod faults;

use crate::store::entries;
use crate::store::error::StoreError;
use rusqlite::Transaction;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// What an operation does; `faults` needs to know it, to work out what a power loss would undo.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operation<'a> {
    CreateFolder,
    RemoveFolder,
    Create,
    Link,
    Write,
    Sync,
    SyncFolder,
    RenameTo(&'a Path),
    Remove,
    Commit,
}

/// Does an operation on `path`, unless it is made to fail.
fn act<T>(operation: Operation<'_>, path: &Path, system: impl FnOnce() -> std::io::Result<T>) -> Result<T, StoreError> {
    attempt(operation, path, system).map_err(StoreError::io(path))
}

#[cfg(not(test))]
fn attempt<T>(_: Operation<'_>, _: &Path, system: impl FnOnce() -> std::io::Result<T>) -> std::io::Result<T> {
    system()
}

#[cfg(test)]
fn attempt<T>(
    operation: Operation<'_>,
    path: &Path,
    system: impl FnOnce() -> std::io::Result<T>,
) -> std::io::Result<T> {
    faults::before(operation, path)?;
    let done = system()?;
    faults::after(operation, path)?;
    Ok(done)
}

/// Creates a folder and those above it, where they are not there yet.
pub(super) fn create_folder(path: &Path) -> Result<(), StoreError> {
    if path.is_dir() {
        return Ok(());
    }
    act(Operation::CreateFolder, path, || std::fs::create_dir_all(path))
}

/// Removes a folder with all that is in it, if it is there.
pub(super) fn remove_folder(path: &Path) -> Result<(), StoreError> {
    if !path.exists() {
        return Ok(());
    }
    act(Operation::RemoveFolder, path, || std::fs::remove_dir_all(path))
}

/// Creates a file anew. A file or a link that has the name is removed first, so nothing is ever written through it.
pub(super) fn create(path: &Path) -> Result<File, StoreError> {
    act(Operation::Create, path, || match File::create_new(path) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            std::fs::remove_file(path)?;
            File::create_new(path)
        }
        created => created,
    })
}

/// Opens a file that is there to be locked, for writing too, or makes it.
pub(super) fn open_lock(path: &Path) -> std::io::Result<File> {
    let mut options = File::options();
    entries::open_with(path, options.read(true).write(true).create(true).truncate(false))
}

/// Writes a whole buffer to a file that [`create`] gave for `path`.
pub(super) fn write(mut file: &File, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    attempt(Operation::Write, path, || file.write_all(bytes))
}

/// Makes the contents of an open file survive a power loss.
pub(super) fn sync(file: &File, path: &Path) -> Result<(), StoreError> {
    act(Operation::Sync, path, || file.sync_all())
}

/// Makes the names in a folder survive a power loss.
pub(super) fn sync_folder(path: &Path) -> Result<(), StoreError> {
    act(Operation::SyncFolder, path, || File::open(path)?.sync_all())
}

/// Writes a new file. When this returns its bytes are safely on disk; its name is so only after [`sync_folder`].
pub(super) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let file = create(path)?;
    write(&file, path, bytes).map_err(StoreError::io(path))?;
    sync(&file, path)
}

/// Copies a file. When this returns the bytes are safely on disk; the name is so only after [`sync_folder`].
pub(super) fn copy(from: &Path, to: &Path) -> Result<(), StoreError> {
    let mut source = entries::open(from).map_err(StoreError::io(from))?;
    let mut file = create(to)?;
    act(Operation::Write, to, || std::io::copy(&mut source, &mut file))?;
    sync(&file, to)
}

/// Gives a file a second name, or makes a copy where the file system has no second names. When this returns the bytes
/// are safely on disk; the name is so only after [`sync_folder`].
pub(super) fn link(from: &Path, to: &Path) -> Result<(), StoreError> {
    let linked = act(Operation::Link, to, || std::fs::hard_link(from, to));
    if linked.is_ok() { linked } else { copy(from, to) }
}

/// Gives a file another name, and replaces what had that name.
pub(super) fn rename(from: &Path, to: &Path) -> Result<(), StoreError> {
    act(Operation::RenameTo(to), from, || std::fs::rename(from, to))
}

/// Removes a file, if it is there.
pub(super) fn remove(path: &Path) -> Result<(), StoreError> {
    act(Operation::Remove, path, || match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    })
}

/// Commits a transaction of the database at `path`.
pub(super) fn commit(transaction: Transaction<'_>, path: &Path) -> Result<(), StoreError> {
    let mut failed = None;
    let attempted = attempt(Operation::Commit, path, || {
        transaction.commit().map_err(|error| {
            failed = Some(error);
            std::io::Error::other("the commit failed")
        })
    });
    match (attempted, failed) {
        (Err(_), Some(error)) => Err(StoreError::sql(path)(error)),
        (attempted, _) => attempted.map_err(StoreError::io(path)),
    }
}

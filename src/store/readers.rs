//! Readers of samples, seen by who would remove files that they still need.
//!
//! A reader holds the file `readers` locked, shared, while its look at the catalogue lasts; whoever finds it free knows
//! that nobody looks at an older catalogue. The kernel releases the lock with the process.

use crate::store::StoreError;
use std::fs::{File, OpenOptions, TryLockError};
use std::path::Path;

fn open(dir: &Path) -> std::io::Result<File> {
    let path = dir.join("readers");
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).or_else(|_| File::open(&path))
}

/// Announces a reader, before it takes its look; `None` in a folder that cannot be written to, where nobody removes files.
pub(super) fn announce(dir: &Path) -> Option<File> {
    let file = open(dir).ok()?;
    file.lock_shared().ok()?;
    Some(file)
}

/// Keeps readers waiting if there are none now; `None` if there are.
pub(super) fn none(dir: &Path) -> Result<Option<File>, StoreError> {
    let path = dir.join("readers");
    let file = open(dir).map_err(StoreError::io(&path))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(source)) => Err(StoreError::Io { path, source }),
    }
}

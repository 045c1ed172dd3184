//! `quarantine/`: where a repair puts what is broken. The program never reads, replaces or removes anything in it.

use crate::store::disk;
use crate::store::error::StoreError;
use std::path::{Path, PathBuf};

fn folder(dir: &Path) -> PathBuf {
    dir.join("quarantine")
}

/// A free name in quarantine for a file called as `path` is: its own, or that and a number.
pub(super) fn place_for(dir: &Path, path: &Path) -> Result<PathBuf, StoreError> {
    let folder = folder(dir);
    disk::create_folder(&folder)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names = std::iter::once(name.clone()).chain((2..).map(|number| format!("{name}.{number}")));
    let free = names.map(|name| folder.join(name)).find(|place| !place.exists());
    free.ok_or_else(|| StoreError::io(&folder)(std::io::Error::other("no free name is left")))
}

/// Moves a file into quarantine; returns where it is now.
pub(super) fn take(dir: &Path, path: &Path) -> Result<PathBuf, StoreError> {
    let place = place_for(dir, path)?;
    disk::rename(path, &place)?;
    disk::sync_folder(&folder(dir))?;
    disk::sync_folder(path.parent().unwrap_or(dir))?;
    Ok(place)
}

/// Copies a file into quarantine and leaves the original; returns where the copy is.
pub(super) fn copy(dir: &Path, path: &Path) -> Result<PathBuf, StoreError> {
    let place = place_for(dir, path)?;
    disk::copy(path, &place)?;
    disk::sync_folder(&folder(dir))?;
    Ok(place)
}

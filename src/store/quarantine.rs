//! `quarantine/`: where a repair puts what is broken, and where forgotten campaigns lie. The program never replaces or
//! removes anything in it, and reads it only when it is named as a store.

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
    let free = names.map(|name| folder.join(name)).find(|place| place.symlink_metadata().is_err());
    free.ok_or_else(|| StoreError::io(&folder)(std::io::Error::other("no free name is left")))
}

/// What the names of forgotten campaigns begin with.
const FORGOTTEN: &str = "forgotten-";

/// A free name in quarantine for the store of a forgotten campaign: its name and a number.
pub(super) fn place_for_campaign(dir: &Path, name: &str) -> Result<PathBuf, StoreError> {
    let folder = folder(dir);
    disk::create_folder(&folder)?;
    // A database may hold names that no campaign file may have.
    let plain = |c: char| if c.is_ascii_alphanumeric() || "_-.".contains(c) { c } else { '_' };
    let name: String = name.chars().take(64).map(plain).collect();
    let free = (1..)
        .map(|number| folder.join(format!("{FORGOTTEN}{name}-{number}")))
        .find(|place| place.symlink_metadata().is_err());
    free.ok_or_else(|| StoreError::io(&folder)(std::io::Error::other("no free name is left")))
}

/// Whether the store of a forgotten campaign has a file of this name in this one of its folders.
pub(super) fn is_forgotten(dir: &Path, file: &Path) -> bool {
    let (Some(part), Some(name)) = (file.parent().and_then(Path::file_name), file.file_name()) else { return false };
    let stores = std::fs::read_dir(folder(dir)).into_iter().flatten().flatten();
    let mut forgotten = stores.filter(|store| store.file_name().to_string_lossy().starts_with(FORGOTTEN));
    forgotten.any(|store| store.path().join(part).join(name).exists())
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

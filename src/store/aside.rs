//! `aside/`: sample files that are on their way into `samples/`, or out of it.
//!
//! People read `samples/*.parquet` with other programs, which know no catalogue. So only whole and current files stand
//! there, and everything else stands in `aside/`: the file that is being written, a merged file until the catalogue
//! names it, and superseded files until the queries that may still read them have ended.
//!
//! A catalogued file is therefore in one of the two places, and moves at most once while somebody looks for it.

use crate::store::error::StoreError;
use crate::store::folders::aside_dir;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The two places of the file that the catalogue calls `path`: the one in `samples/`, then the one in `aside/`.
pub(super) fn places(dir: &Path, path: &str) -> [PathBuf; 2] {
    [dir.join(path), aside_dir(dir).join(Path::new(path).file_name().unwrap_or_default())]
}

/// Where the file is; the place in `samples/` if it is nowhere.
pub(super) fn find(dir: &Path, path: &str) -> PathBuf {
    let [home, aside] = places(dir, path);
    if !home.exists() && aside.exists() { aside } else { home }
}

/// Opens the file wherever it is.
pub(super) fn open(dir: &Path, path: &str) -> Result<File, StoreError> {
    let [home, aside] = places(dir, path);
    // A file that comes from `aside/` between the first two looks is found by the third.
    for place in [&home, &aside] {
        match File::open(place) {
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            opened => return opened.map_err(StoreError::io(place)),
        }
    }
    File::open(&home).map_err(StoreError::io(&home))
}

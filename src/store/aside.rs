//! `aside/`: sample files that are on their way into `samples/`, or out of it.
//!
//! People read `samples/*.parquet` with other programs, which know no catalogue. So only whole and current files stand
//! there, and everything else stands in `aside/`: the file that is being written, a merged file until the catalogue
//! names it, and superseded files until the queries that may still read them have ended.
//!
//! A catalogued file is therefore in one of the two places, and moves at most once while somebody looks for it.

use crate::store::entries::{self, SampleName};
use crate::store::error::StoreError;
use crate::store::folders::aside_dir;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The two places of a sample file: the one in `samples/`, then the one in `aside/`.
pub(super) fn places(dir: &Path, name: &SampleName) -> [PathBuf; 2] {
    [name.home(dir), aside_dir(dir).join(name.file_name())]
}

/// Where the file is; the place in `samples/` if it is nowhere.
pub(super) fn find(dir: &Path, name: &SampleName) -> PathBuf {
    let [home, aside] = places(dir, name);
    let is_there = |path: &Path| path.symlink_metadata().is_ok();
    if !is_there(&home) && is_there(&aside) { aside } else { home }
}

/// Opens the file wherever it is.
pub(super) fn open(dir: &Path, name: &SampleName) -> Result<File, StoreError> {
    let [home, aside] = places(dir, name);
    // A file that comes from `aside/` between the first two looks is found by the third.
    for place in [&home, &aside] {
        match entries::open(place) {
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            opened => return opened.map_err(StoreError::io(place)),
        }
    }
    entries::open(&home).map_err(StoreError::io(&home))
}

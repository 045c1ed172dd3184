//! A seal on a database that is closed: its first page and a short hash of every page.
//!
//! SQLite has no checksums of its own, so a byte that changes on the disk between two runs would go unseen, or be seen
//! too late. The file `store.db.seal` is written when a store is closed and removed before anything is written to it
//! again; so while it is there, the database must be what it says. A process that is killed leaves no seal, and the
//! database is then judged by SQLite's own `integrity_check` and by the laws of its header.
//!
//! The file itself begins with a magic word and the blake3 of the rest.

use crate::store::{StoreError, database, disk};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"MNSCSEAL";

/// Bytes of a page hash.
const SHORT: usize = 8;

/// Where the seal of the store in `dir` is.
pub(super) fn path(dir: &Path) -> PathBuf {
    dir.join("store.db.seal")
}

/// What a sealed database was.
#[derive(Debug, PartialEq)]
pub(super) struct Seal {
    /// Its first page, header included.
    pub first_page: Vec<u8>,
    /// A hash of each page.
    hashes: Vec<[u8; SHORT]>,
}

/// What a look for a seal finds.
#[derive(Debug, PartialEq)]
pub(super) enum Found {
    /// There is none: the last process was killed, or is at work.
    None,
    /// There is one.
    Whole(Seal),
    /// The seal itself is damaged.
    Broken,
}

/// The write-ahead log beside the database.
pub(super) fn log(dir: &Path) -> PathBuf {
    dir.join("store.db-wal")
}

/// The page size that a database header states; `None` if it states none that exists.
pub(super) fn page_size(header: &[u8]) -> Option<usize> {
    let [high, low] = header.get(16..18)?.try_into().ok()?;
    match u16::from_be_bytes([high, low]) {
        1 => Some(65536),
        size if size >= 512 && size.is_power_of_two() => Some(size.into()),
        _ => None,
    }
}

fn short_hash(page: &[u8]) -> [u8; SHORT] {
    let mut short = [0; SHORT];
    short.copy_from_slice(&blake3::hash(page).as_bytes()[..SHORT]);
    short
}

/// Calls `each` with every page of the file, the last one perhaps shorter.
fn pages(path: &Path, size: usize, mut each: impl FnMut(&[u8])) -> Result<(), StoreError> {
    let mut file = File::open(path).map_err(StoreError::io(path))?;
    let mut block = Vec::with_capacity(256 * size);
    loop {
        block.clear();
        let read = file.by_ref().take(256 * size as u64).read_to_end(&mut block).map_err(StoreError::io(path))?;
        if read == 0 {
            return Ok(());
        }
        block.chunks(size).for_each(&mut each);
    }
}

impl Seal {
    /// Looks at the database of the store in `dir`; `None` if it is empty or its header is none.
    fn of(dir: &Path) -> Result<Option<Self>, StoreError> {
        let path = database(dir);
        let mut header = Vec::new();
        File::open(&path).and_then(|file| file.take(100).read_to_end(&mut header)).map_err(StoreError::io(&path))?;
        let Some(size) = page_size(&header) else { return Ok(None) };
        let mut seal = Self { first_page: Vec::new(), hashes: Vec::new() };
        pages(&path, size, |page| {
            if seal.hashes.is_empty() {
                seal.first_page = page.to_vec();
            }
            seal.hashes.push(short_hash(page));
        })?;
        Ok((seal.first_page.len() == size).then_some(seal))
    }

    fn to_bytes(&self) -> Vec<u8> {
        let mut payload = (self.first_page.len() as u32).to_le_bytes().to_vec();
        payload.extend(&self.first_page);
        payload.extend(self.hashes.iter().flatten());
        [MAGIC.as_slice(), blake3::hash(&payload).as_bytes(), &payload].concat()
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (hash, payload) = bytes.strip_prefix(MAGIC)?.split_at_checked(32)?;
        if blake3::hash(payload).as_bytes() != hash {
            return None;
        }
        let (size, rest) = payload.split_first_chunk()?;
        let (first_page, rest) = rest.split_at_checked(u32::from_le_bytes(*size) as usize)?;
        let (hashes, rest) = rest.as_chunks();
        (rest.is_empty() && page_size(first_page) == Some(first_page.len()))
            .then(|| Self { first_page: first_page.to_vec(), hashes: hashes.to_vec() })
    }

    /// Whether another program of SQLite's has written the database since: it counts its changes, twice.
    fn is_void(&self, first_page: &[u8]) -> bool {
        let counters = |page: &[u8]| Some((<[u8; 4]>::try_from(page.get(24..28)?).ok()?, page.get(92..96)?.to_vec()));
        let (Some(sealed), Some(found)) = (counters(&self.first_page), counters(first_page)) else { return false };
        found.0.as_slice() == found.1 && u32::from_be_bytes(found.0) > u32::from_be_bytes(sealed.0)
    }

    /// Pages that were sealed.
    pub(super) fn n_pages(&self) -> usize {
        self.hashes.len()
    }

    /// Bytes of a page.
    pub(super) fn page_size(&self) -> usize {
        self.first_page.len()
    }

    /// The pages, counted from 0, in which the file at `path` is not what was sealed, missing and surplus ones among them.
    pub(super) fn differences(&self, path: &Path) -> Result<Vec<usize>, StoreError> {
        let (mut different, mut seen) = (Vec::new(), 0);
        pages(path, self.page_size(), |page| {
            if self.hashes.get(seen) != Some(&short_hash(page)) {
                different.push(seen);
            }
            seen += 1;
        })?;
        different.extend(seen..self.hashes.len());
        Ok(different)
    }
}

/// The first page of the database, as far as it goes.
fn first_page(dir: &Path, size: usize) -> Result<Vec<u8>, StoreError> {
    let (path, mut page) = (database(dir), Vec::new());
    let read = File::open(&path).and_then(|file| file.take(size as u64).read_to_end(&mut page));
    read.map_err(StoreError::io(&path)).map(|_| page)
}

/// Looks for the seal of the store in `dir`; one that another program made void by writing the database is none.
///
/// The database is opened and closed, which would drop the locks that SQLite holds in this process: ask before connecting.
pub(super) fn find(dir: &Path) -> Result<Found, StoreError> {
    let path = path(dir);
    match std::fs::read(&path) {
        Ok(bytes) => match Seal::from_bytes(&bytes) {
            None => Ok(Found::Broken),
            Some(seal) if database(dir).exists() && seal.is_void(&first_page(dir, seal.page_size())?) => {
                Ok(Found::None)
            }
            Some(seal) => Ok(Found::Whole(seal)),
        },
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Found::None),
        Err(error) => Err(StoreError::io(&path)(error)),
    }
}

/// Whether the first page of a sealed database is as it was left; true where there is no seal.
pub(super) fn first_page_is_sound(dir: &Path) -> Result<bool, StoreError> {
    match find(dir)? {
        Found::Whole(seal) => Ok(first_page(dir, seal.page_size())? == seal.first_page),
        Found::None | Found::Broken => Ok(true),
    }
}

/// Removes the seal of the store in `dir`, before anything is written to it.
pub(super) fn lift(dir: &Path) -> Result<(), StoreError> {
    let path = path(dir);
    if !path.exists() {
        return Ok(());
    }
    disk::remove(&path)?;
    disk::sync_folder(dir)
}

/// Seals the database of the store in `dir`, which nobody has open: while there is a log, somebody has.
fn close(dir: &Path) -> Result<(), StoreError> {
    if log(dir).exists() || !database(dir).exists() {
        return Ok(());
    }
    let Some(seal) = Seal::of(dir)? else { return Ok(()) };
    let (path, half) = (path(dir), dir.join("store.db.seal.tmp"));
    disk::write_file(&half, &seal.to_bytes())?;
    disk::rename(&half, &path)?;
    disk::sync_folder(dir)
}

/// Seals the database when it is dropped: after the connection, and before the lock.
#[derive(Debug)]
pub(super) struct SealsWhenDropped(pub PathBuf);

impl Drop for SealsWhenDropped {
    fn drop(&mut self) {
        // Without a seal a check knows less, and nothing else is wrong.
        if let Err(error) = close(&self.0) {
            tracing::debug!(%error, "the database was not sealed");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seal_reads_back_and_a_changed_byte_breaks_it() {
        let mut first_page = vec![0; 512];
        first_page[16] = 2;
        let seal = Seal { first_page, hashes: vec![[1; SHORT], [2; SHORT]] };
        let bytes = seal.to_bytes();
        assert_eq!(Seal::from_bytes(&bytes), Some(seal));
        for place in 0..bytes.len() {
            let mut bad = bytes.clone();
            bad[place] ^= 1;
            assert_eq!(Seal::from_bytes(&bad), None, "byte {place}");
        }
    }
}

//! A seal on a closed database: its first page, and a short hash of every page.
//!
//! SQLite has no checksums of its own. A byte that changes on the disk between two runs would go unseen, or be seen
//! too late. So the file `store.db.seal` is written when a store is closed, and removed before anything is written to
//! it again; while it is there, the database must be what it says. A process that is killed leaves no seal, and the
//! database is then judged by SQLite's own `integrity_check` and by what every store has in its header.
//!
//! The file is a magic word, the blake3 of the rest, the page size (u32, little-endian), the first page, and eight
//! bytes of the blake3 of each page.

use crate::store::error::StoreError;
use crate::store::folders::{database, log};
use crate::store::{disk, entries};
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"MNSCSEAL";

/// The first bytes of the blake3 of a page.
type PageHash = [u8; 8];

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
    hashes: Vec<PageHash>,
}

/// What became of the seal of a store.
#[derive(Debug, PartialEq)]
pub(super) enum SealState {
    /// There is none: the last process was killed, or is at work, or another program wrote the database.
    Absent,
    /// It can be relied on.
    Sound(Seal),
    /// It is damaged itself.
    Damaged,
}

/// The page size that a database header states; `None` if it states none that exists.
pub(super) fn page_size(header: &[u8]) -> Option<usize> {
    match u16::from_be_bytes(header.get(16..18)?.try_into().ok()?) {
        1 => Some(65536),
        size if size >= 512 && size.is_power_of_two() => Some(size.into()),
        _ => None,
    }
}

/// The first bytes of the database, at most `most`.
pub(super) fn beginning(dir: &Path, most: usize) -> Result<Vec<u8>, StoreError> {
    let path = database(dir);
    entries::read_up_to(&path, most as u64).map_err(StoreError::io(&path))
}

/// The hashes of all pages of the database, the last one perhaps shorter than `size` bytes.
fn page_hashes(dir: &Path, size: usize) -> Result<Vec<PageHash>, StoreError> {
    let path = database(dir);
    let mut file = BufReader::with_capacity(1 << 20, entries::open(&path).map_err(StoreError::io(&path))?);
    let (mut hashes, mut page) = (Vec::new(), Vec::with_capacity(size));
    loop {
        page.clear();
        file.by_ref().take(size as u64).read_to_end(&mut page).map_err(StoreError::io(&path))?;
        if page.is_empty() {
            return Ok(hashes);
        }
        let mut hash = PageHash::default();
        hash.copy_from_slice(&blake3::hash(&page).as_bytes()[..size_of::<PageHash>()]);
        hashes.push(hash);
    }
}

impl Seal {
    /// Looks at the database of the store in `dir`; `None` if it does not begin with a whole page.
    fn of(dir: &Path) -> Result<Option<Self>, StoreError> {
        let Some(size) = page_size(&beginning(dir, 100)?) else { return Ok(None) };
        let seal = Self { first_page: beginning(dir, size)?, hashes: page_hashes(dir, size)? };
        Ok((seal.page_size() == size).then_some(seal))
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

    /// Whether another program has written the database since: SQLite counts such changes at two places of the header.
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

    /// The pages of the database in `dir`, counted from 0, that are not what was sealed. Pages that are missing and
    /// pages that were not there are among them.
    pub(super) fn differences(&self, dir: &Path) -> Result<Vec<usize>, StoreError> {
        let found = page_hashes(dir, self.page_size())?;
        let all = 0..found.len().max(self.hashes.len());
        Ok(all.filter(|&page| found.get(page) != self.hashes.get(page)).collect())
    }
}

/// Looks for the seal of the store in `dir`.
///
/// This opens and closes the database, which drops the locks that SQLite holds in this process: ask before connecting.
pub(super) fn find(dir: &Path) -> Result<SealState, StoreError> {
    let path = path(dir);
    match entries::read(&path) {
        Ok(bytes) => match Seal::from_bytes(&bytes) {
            None => Ok(SealState::Damaged),
            Some(seal) if database(dir).exists() && seal.is_void(&beginning(dir, seal.page_size())?) => {
                Ok(SealState::Absent)
            }
            Some(seal) => Ok(SealState::Sound(seal)),
        },
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(SealState::Absent),
        Err(error) => Err(StoreError::io(&path)(error)),
    }
}

/// Whether the first page of a sealed database is as it was left; true where there is no seal.
pub(super) fn first_page_is_sound(dir: &Path) -> Result<bool, StoreError> {
    match find(dir)? {
        SealState::Sound(seal) => Ok(beginning(dir, seal.page_size())? == seal.first_page),
        SealState::Absent | SealState::Damaged => Ok(true),
    }
}

/// Removes the seal of the store in `dir`, before anything is written to it.
pub(super) fn remove(dir: &Path) -> Result<(), StoreError> {
    let path = path(dir);
    if !path.exists() {
        return Ok(());
    }
    disk::remove(&path)?;
    disk::sync_folder(dir)
}

/// Seals the database of the store in `dir`, unless somebody has it open: then there is a log.
pub(super) fn close(dir: &Path) -> Result<(), StoreError> {
    if log(dir).exists() || !database(dir).exists() {
        return Ok(());
    }
    let Some(seal) = Seal::of(dir)? else { return Ok(()) };
    let half = dir.join("store.db.seal.tmp");
    disk::write_file(&half, &seal.to_bytes())?;
    disk::rename(&half, &path(dir))?;
    disk::sync_folder(dir)
}

/// Seals the database when it is dropped: after the connection, and before the lock.
#[derive(Debug)]
pub(super) struct SealsWhenDropped(pub PathBuf);

impl Drop for SealsWhenDropped {
    fn drop(&mut self) {
        // Without a seal a check knows less; nothing else is wrong.
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
        let seal = Seal { first_page, hashes: vec![[1; 8], [2; 8]] };
        let bytes = seal.to_bytes();
        assert_eq!(Seal::from_bytes(&bytes), Some(seal));
        for place in 0..bytes.len() {
            let mut bad = bytes.clone();
            bad[place] ^= 1;
            assert_eq!(Seal::from_bytes(&bad), None, "byte {place}");
        }
    }
}

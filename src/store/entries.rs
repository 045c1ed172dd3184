//! What may stand in a store, and how it is opened: the one place that turns a name in a store into a file.
//!
//! Stores come by mail and stand on shared machines. Whoever made one may have put links, pipes or devices where our
//! files belong, and names like `../elsewhere` into its catalogue. So:
//!
//! - A store whose parts are something else than plain files and folders is refused before anything in it is opened
//!   ([`refuse_foreign`]).
//! - A sample file has the name that this program gives to sample files, and no other ([`SampleName`]).
//! - Files are opened without following a link, and only if they are plain files ([`open`]).
//!
//! This holds for a store as it lies there. Somebody who can change a store while it is being used is another matter
//! (`docs/security.md`).

use crate::store::error::StoreError;
use rusqlite::types::{FromSql, FromSqlError, FromSqlResult, ToSql, ToSqlOutput, ValueRef};
use std::fmt;
use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// The folders in a store.
const FOLDERS: [&str; 7] = ["samples", "aside", "checkpoints", "dumps", "quarantine", "forgetting", "rescue.tmp"];

/// The sample file that is being written.
pub(super) const HALF: &str = "aside/batch.tmp";

/// Refuses a store in which something else stands where a file or a folder of ours belongs: the database and all that
/// begins with its name, the two locks, the folders.
///
/// # Errors
/// [`StoreError::ForeignEntry`], which names the entry; what the system reports of a folder that cannot be listed.
pub(super) fn refuse_foreign(dir: &Path) -> Result<(), StoreError> {
    let entries = match std::fs::read_dir(dir) {
        // What is no folder is refused elsewhere, and what is not there yet holds nothing.
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(()),
        entries => entries.map_err(StoreError::io(dir))?,
    };
    for entry in entries {
        let entry = entry.map_err(StoreError::io(dir))?;
        let name = entry.file_name();
        let wanted = match name.to_str() {
            Some(name) if FOLDERS.contains(&name) => "a folder",
            Some("lock" | "readers") => "a file",
            _ if name.as_encoded_bytes().starts_with(b"store.db") => "a file",
            _ => continue,
        };
        let found = kind(entry.file_type().map_err(StoreError::io(dir))?);
        if found != wanted {
            return Err(StoreError::ForeignEntry { path: entry.path(), found, wanted });
        }
    }
    // What is to be replaced may be a link, which is then removed, but no folder.
    let path = dir.join(HALF);
    match path.symlink_metadata() {
        Ok(entry) if entry.is_dir() => Err(StoreError::ForeignEntry { path, found: "a folder", wanted: "a file" }),
        _ => Ok(()),
    }
}

/// What an entry of a folder is, in words.
fn kind(entry: FileType) -> &'static str {
    match () {
        () if entry.is_file() => "a file",
        () if entry.is_dir() => "a folder",
        () if entry.is_symlink() => "a symbolic link",
        () if entry.is_fifo() => "a named pipe",
        () if entry.is_socket() => "a socket",
        () => "a device",
    }
}

/// Opens a file for reading, if it is a plain file and no link.
///
/// # Errors
/// What the system reports; [`ErrorKind::InvalidInput`] for everything but a plain file.
pub(super) fn open(path: &Path) -> std::io::Result<File> {
    open_with(path, File::options().read(true))
}

/// Opens a file, if it is a plain file and no link.
///
/// # Errors
/// As [`open`].
pub(super) fn open_with(path: &Path, options: &mut OpenOptions) -> std::io::Result<File> {
    let refuse = |entry: FileType| {
        let problem = format!("it is {}, and a store holds plain files alone", kind(entry));
        Err(Error::new(ErrorKind::InvalidInput, problem))
    };
    // A pipe or a device must not even be opened, because that may wait or act.
    match path.symlink_metadata() {
        Ok(entry) if !entry.is_file() => return refuse(entry.file_type()),
        _ => {}
    }
    let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
    let file = options.custom_flags(flags.bits() as i32).open(path)?;
    let entry = file.metadata()?.file_type();
    if entry.is_file() { Ok(file) } else { refuse(entry) }
}

/// The first bytes of a file, at most `most`, if it is a plain file and no link.
///
/// # Errors
/// As [`open`].
pub(super) fn read_up_to(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// All bytes of a file, if it is a plain file and no link.
///
/// # Errors
/// As [`open`].
pub(super) fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    read_up_to(path, u64::MAX)
}

/// The name of a sample file, `samples/` and twenty hexadecimal digits and `.parquet`: the only form that this program
/// writes, so no name leads out of the store.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct SampleName(String);

/// Hexadecimal digits in the name of a sample file.
const DIGITS: usize = 20;

impl SampleName {
    /// The name of the file with this checksum, which has more than twenty digits.
    pub(super) fn of_checksum(checksum: &str) -> Self {
        Self(format!("samples/{}.parquet", &checksum[..DIGITS]))
    }

    /// A name as the catalogue gives it; `None` if this program never writes such a one.
    pub(super) fn parse(text: &str) -> Option<Self> {
        let digits = text.strip_prefix("samples/")?.strip_suffix(".parquet")?;
        let is_hash = digits.len() == DIGITS && digits.bytes().all(|byte| b"0123456789abcdef".contains(&byte));
        is_hash.then(|| Self(text.to_owned()))
    }

    /// The name without its folder.
    pub(super) fn file_name(&self) -> &str {
        &self.0["samples/".len()..]
    }

    /// Where the file stands in the store in `dir`, unless it stands aside.
    pub(super) fn home(&self, dir: &Path) -> PathBuf {
        dir.join(&self.0)
    }

    /// The name as the catalogue has it.
    pub(super) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for SampleName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The catalogue names a file that this program never wrote.
#[derive(Debug, thiserror::Error)]
#[error("its catalogue lists `{}`, which is not the name of a sample file", crate::parameters::plain(.0))]
pub(super) struct ForeignName(pub(super) String);

impl FromSql for SampleName {
    fn column_result(value: ValueRef<'_>) -> FromSqlResult<Self> {
        let text = value.as_str()?;
        Self::parse(text).ok_or_else(|| FromSqlError::Other(Box::new(ForeignName(text.to_owned()))))
    }
}

impl ToSql for SampleName {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        self.0.to_sql()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_that_this_program_writes_are_names_of_sample_files() {
        let name = SampleName::of_checksum(&"0123456789abcdef".repeat(4));
        assert_eq!(name.as_str(), "samples/0123456789abcdef0123.parquet");
        assert_eq!(SampleName::parse(name.as_str()), Some(name.clone()));
        assert_eq!(name.file_name(), "0123456789abcdef0123.parquet");
        for foreign in [
            "",
            "samples",
            "samples/../../victim.parquet",
            "samples/0123456789abcdef012/.parquet",
            "samples/0123456789ABCDEF0123.parquet",
            "samples/0123456789abcdef0123.parquet/",
            "/samples/0123456789abcdef0123.parquet",
            "../samples/0123456789abcdef0123.parquet",
            "samples/0123456789abcdef012\u{e9}.parquet",
        ] {
            assert_eq!(SampleName::parse(foreign), None, "{foreign}");
        }
    }

    #[test]
    fn links_pipes_and_folders_are_not_opened_as_files() {
        let dir = tempfile::tempdir().unwrap();
        let [file, link, pipe] = ["file", "link", "pipe"].map(|name| dir.path().join(name));
        std::fs::write(&file, "text").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, 0o600.into(), 0).unwrap();
        assert!(open(&file).is_ok());
        for foreign in [link.as_path(), &pipe, dir.path(), Path::new("/dev/zero")] {
            assert_eq!(open(foreign).unwrap_err().kind(), ErrorKind::InvalidInput, "{}", foreign.display());
        }
        assert_eq!(open(&dir.path().join("nothing")).unwrap_err().kind(), ErrorKind::NotFound);
    }
}

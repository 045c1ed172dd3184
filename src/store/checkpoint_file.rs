//! The file of an unfinished trajectory, and of a failure's dump: `checkpoints/JOB_ID.ckpt`, `dumps/JOB_ID.ckpt`.
//!
//! ```text
//! bytes 0..8     MENISCK1
//! bytes 8..40    blake3 of all that follows
//! bytes 40..     format version, physics version, job id (postcard), then the state, which is not looked into here
//! ```
//!
//! A file is written aside, flushed and renamed, and then its folder is flushed. So under its name there is always a
//! whole state: the one before or the one after. Each job has one file, which is replaced and never appended to.

use crate::parameters::{JobId, PHYSICS_VERSION, shown};
use crate::store::error::StoreError;
use crate::store::{disk, entries};
use serde::{Deserialize, Serialize};
use std::ffi::OsStr;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"MENISCK1";

/// Magic and checksum.
const PREFIX: usize = 8 + blake3::OUT_LEN;

/// Version of what stands behind the checksum; raised whenever the state is written in another way.
const FORMAT_VERSION: u32 = 1;

/// Largest file that is written or read, in bytes.
const LARGEST: u64 = 1 << 30;

/// What a sound file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Payload {
    /// Whose state it is.
    pub job: JobId,
    /// The state, as its owner encoded it.
    pub state: Vec<u8>,
}

/// What stands before the state. The version comes first, so that it can be read even if the rest has another form.
#[derive(Serialize, Deserialize)]
struct Header {
    format: u32,
    physics: u32,
    job: String,
}

/// Why a file is of no use.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// There is none.
    #[error("no checkpoint at {}", shown(.0))]
    Missing(PathBuf),
    /// Its bytes are not what was written.
    #[error("{} is damaged: {problem}", shown(path))]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A program of another version wrote it.
    #[error("{} was written as {found}, and this program reads {known}", shown(path))]
    OtherVersion {
        /// The file.
        path: PathBuf,
        /// What it was written as.
        found: String,
        /// What this program writes.
        known: String,
    },
    /// It could not be read.
    #[error("{}: {source}", shown(path))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Where the state of `job` stands in `folder`.
pub(crate) fn path_of(folder: &Path, job: JobId) -> PathBuf {
    folder.join(format!("{job}.ckpt"))
}

/// The job that a file is named after; `None` if it is not named as a checkpoint.
pub(crate) fn job_of(path: &Path) -> Option<JobId> {
    (path.extension() == Some(OsStr::new("ckpt"))).then(|| path.file_stem()?.to_str()?.parse().ok()).flatten()
}

/// Writes the state of `job` in `folder`, in place of an earlier one, and returns its path.
///
/// When this returns the file is safely on disk. When it fails, or the process dies, the earlier one is still there.
///
/// # Errors
/// [`StoreError::Io`]; a state above [`LARGEST`] is one ([`ErrorKind::FileTooLarge`]).
pub fn write(folder: &Path, job: JobId, state: &[u8]) -> Result<PathBuf, StoreError> {
    let path = path_of(folder, job);
    if state.len() as u64 > LARGEST - 1024 {
        let source = std::io::Error::new(ErrorKind::FileTooLarge, format!("a state of {} bytes", state.len()));
        return Err(StoreError::Io { path, source });
    }
    let half = path.with_extension("ckpt.tmp");
    let header = Header { format: FORMAT_VERSION, physics: PHYSICS_VERSION, job: job.to_string() };
    let header = postcard::to_stdvec(&header).expect("two numbers and a text can always be encoded");
    let checksum = blake3::Hasher::new().update(&header).update(state).finalize();
    let write_half = || {
        let file = disk::create(&half)?;
        let parts = [MAGIC, checksum.as_bytes().as_slice(), &header, state];
        parts.iter().try_for_each(|part| disk::write(&file, &half, part)).map_err(StoreError::io(&half))?;
        disk::sync(&file, &half)?;
        disk::rename(&half, &path)
    };
    if let Err(error) = write_half() {
        // Of no use to anybody, and the disk may be full.
        let _ = disk::remove(&half);
        return Err(error);
    }
    disk::sync_folder(folder)?;
    Ok(path)
}

/// Reads a file back.
///
/// # Errors
/// [`CheckpointError`]; no bytes whatever make it panic.
pub(crate) fn read(path: &Path) -> Result<Payload, CheckpointError> {
    let damaged = |problem: &str| CheckpointError::Damaged { path: path.to_owned(), problem: problem.to_owned() };
    let bytes = entries::read_up_to(path, LARGEST + 1).map_err(|source| match source.kind() {
        ErrorKind::NotFound => CheckpointError::Missing(path.to_owned()),
        _ => CheckpointError::Io { path: path.to_owned(), source },
    })?;
    let (Some(magic), Some(checksum), Some(body)) = (bytes.get(..8), bytes.get(8..PREFIX), bytes.get(PREFIX..)) else {
        return Err(damaged("it is too short"));
    };
    if magic != MAGIC {
        return Err(damaged("it does not begin as checkpoints do"));
    }
    if bytes.len() as u64 > LARGEST {
        return Err(damaged("it is larger than any checkpoint"));
    }
    if checksum != blake3::hash(body).as_bytes() {
        return Err(damaged("its bytes do not match its checksum"));
    }
    let other = |found: String, known: String| CheckpointError::OtherVersion { path: path.to_owned(), found, known };
    let (format, _) = postcard::take_from_bytes::<u32>(body).map_err(|_| damaged("it has no version"))?;
    if format != FORMAT_VERSION {
        return Err(other(format!("format {format}"), format!("format {FORMAT_VERSION}")));
    }
    let (header, state) = postcard::take_from_bytes::<Header>(body).map_err(|_| damaged("it names no job"))?;
    if header.physics != PHYSICS_VERSION {
        return Err(other(format!("physics {}", header.physics), format!("physics {PHYSICS_VERSION}")));
    }
    let job = header.job.parse().map_err(|_| damaged("it names no job"))?;
    Ok(Payload { job, state: state.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn job() -> JobId {
        "0123456789abcdef0123".parse().unwrap()
    }

    #[test]
    fn a_state_reads_back_and_a_later_one_takes_its_place() {
        let dir = tempfile::tempdir().unwrap();
        let path = write(dir.path(), job(), b"first").unwrap();
        assert_eq!((job_of(&path), path_of(dir.path(), job())), (Some(job()), path.clone()));
        write(dir.path(), job(), b"second").unwrap();
        assert_eq!(read(&path).unwrap(), Payload { job: job(), state: b"second".to_vec() });
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "nothing half-written is left");
    }

    #[test]
    fn no_file_and_one_of_another_version_are_told_apart() {
        let dir = tempfile::tempdir().unwrap();
        assert!(matches!(read(&path_of(dir.path(), job())), Err(CheckpointError::Missing(_))));
        assert!(matches!(read(dir.path()), Err(CheckpointError::Io { .. })));
        for (format, physics) in [(FORMAT_VERSION + 1, PHYSICS_VERSION), (FORMAT_VERSION, PHYSICS_VERSION + 1)] {
            let body = postcard::to_stdvec(&Header { format, physics, job: job().to_string() }).unwrap();
            let path = dir.path().join("other.ckpt");
            std::fs::write(&path, [MAGIC.as_slice(), blake3::hash(&body).as_bytes(), &body].concat()).unwrap();
            assert!(matches!(read(&path), Err(CheckpointError::OtherVersion { .. })));
        }
        for name in ["0123456789abcdef0123.ckpt.tmp", "0123456789abcdef0123", "short.ckpt", ".ckpt", "lock"] {
            assert_eq!(job_of(Path::new(name)), None, "{name}");
        }
    }

    #[test]
    fn one_flipped_bit_anywhere_is_damage() {
        let dir = tempfile::tempdir().unwrap();
        let path = write(dir.path(), job(), &[7; 40]).unwrap();
        let sound = std::fs::read(&path).unwrap();
        for bit in 0..8 * sound.len() {
            let mut bytes = sound.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, bytes).unwrap();
            assert!(matches!(read(&path), Err(CheckpointError::Damaged { .. })), "bit {bit}");
        }
        for length in 0..sound.len() {
            std::fs::write(&path, &sound[..length]).unwrap();
            assert!(matches!(read(&path), Err(CheckpointError::Damaged { .. })), "{length} bytes");
        }
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_behind_a_right_checksum_never_panic(body in proptest::collection::vec(any::<u8>(), 0..200)) {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("any.ckpt");
            std::fs::write(&path, [MAGIC.as_slice(), blake3::hash(&body).as_bytes(), &body].concat()).unwrap();
            let _ = read(&path);
        }
    }
}

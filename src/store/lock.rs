//! Who may use a store: the lock of the one process that writes, and that of those who read samples.
//!
//! Both are locks of the kernel on an open file, which it releases with the process, however that ends; so there are no
//! stale lock files. The file `lock` also holds pid and host of its holder, so that a refusal can name them. That text
//! alone means nothing.
//!
//! A reader holds the file `readers`, shared, while its look at the catalogue lasts. Whoever can take that lock alone
//! knows that nobody looks at an older catalogue, and may remove files that the present one does not list.
//!
//! SQLite's write-ahead log needs memory shared between processes, which network file systems do not give: they are
//! refused.

use crate::store::error::StoreError;
use crate::store::holder::Holder;
use crate::store::{disk, entries};
use std::fs::{File, TryLockError};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Set to 1 by those who know that a file system has coherent shared memory although it is named like a network's (FUSE
/// on a local disk).
const TRUST: &str = "MENISCUS_TRUST_FILE_SYSTEM";

fn path(dir: &Path) -> PathBuf {
    dir.join("lock")
}

/// More bytes than the name of any holder has.
const LONGEST_NAME: u64 = 4096;

/// Reads who holds the lock. An unreadable or half-written file only costs the name of the holder.
fn read_holder(file: &mut File) -> Holder {
    let mut text = String::new();
    let _ = file.rewind().and_then(|()| file.take(LONGEST_NAME).read_to_string(&mut text));
    let (pid, host) = text.trim().split_once(' ').unwrap_or_default();
    Holder { pid: pid.parse().ok(), host: host.to_owned() }
}

/// Takes the lock of the store in `dir` and writes this process's name into it; it lasts as long as the file is open.
///
/// # Errors
/// [`StoreError::Locked`], naming the holder.
pub(super) fn take(dir: &Path) -> Result<File, StoreError> {
    let path = path(dir);
    let mut file = disk::open_lock(&path).map_err(StoreError::io(&path))?;
    // `holder` below takes the lock for an instant, so after a refusal it is tried again.
    for pause_ms in [5, 20, 50, 100, 0] {
        match file.try_lock() {
            Ok(()) => {
                write_holder(&mut file).map_err(StoreError::io(&path))?;
                return Ok(file);
            }
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(pause_ms)),
            Err(TryLockError::Error(source)) => return Err(StoreError::Io { path, source }),
        }
    }
    Err(StoreError::Locked { dir: dir.to_owned(), holder: read_holder(&mut file) })
}

/// Writes this process's name into the file that it has locked. A file that has another name elsewhere, as in a backup
/// of hard links, keeps its text.
fn write_holder(file: &mut File) -> std::io::Result<()> {
    if file.metadata()?.nlink() > 1 {
        return Ok(());
    }
    let Holder { pid, host } = Holder::this_process();
    file.set_len(0)?;
    file.rewind()?;
    file.write_all(format!("{} {host}\n", pid.unwrap_or_default()).as_bytes())
}

/// Keeps writers away without writing: what a reader can do who has no right to write. `None` where a process writes,
/// or where there is no file to lock.
pub(super) fn keep_writers_away(dir: &Path) -> Option<File> {
    let file = entries::open(&path(dir)).ok()?;
    file.try_lock_shared().ok().map(|()| file)
}

/// Who holds the lock of the store in `dir` now, if anyone does.
pub(super) fn holder(dir: &Path) -> Option<Holder> {
    let mut file = entries::open(&path(dir)).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Some(read_holder(&mut file)),
        _ => None,
    }
}

/// Announces a reader, before it takes its look; `None` in a folder that cannot be written to, where nobody removes
/// files.
pub(super) fn announce_reader(dir: &Path) -> Option<File> {
    let path = dir.join("readers");
    let file = disk::open_lock(&path).or_else(|_| entries::open(&path)).ok()?;
    file.lock_shared().ok()?;
    Some(file)
}

/// Keeps readers waiting if there are none now; `None` if there are.
pub(super) fn without_readers(dir: &Path) -> Result<Option<File>, StoreError> {
    let path = dir.join("readers");
    let file = disk::open_lock(&path).map_err(StoreError::io(&path))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(source)) => Err(StoreError::Io { path, source }),
    }
}

/// Refuses a folder (or, before it exists, its nearest ancestor) on a file system where WAL is unsafe.
pub(super) fn refuse_network(dir: &Path) -> Result<(), StoreError> {
    let absolute = std::path::absolute(dir).map_err(StoreError::io(dir))?;
    let Some(existing) = absolute.ancestors().find(|path| path.exists()) else { return Ok(()) };
    match file_system_magic(existing).and_then(network_kind) {
        Some(kind) if std::env::var_os(TRUST).is_some_and(|value| value == "1") => {
            tracing::warn!(dir = %dir.display(), kind, "a store on a network file system, as {TRUST} says");
            Ok(())
        }
        Some(kind) => Err(StoreError::NetworkFileSystem { dir: dir.to_owned(), kind }),
        None => Ok(()),
    }
}

#[cfg(target_os = "linux")]
fn file_system_magic(path: &Path) -> Option<u32> {
    // The magic numbers are 32 bits wide, whatever width and sign the platform gives the field.
    rustix::fs::statfs(path).ok().map(|answer| answer.f_type as u32)
}

#[cfg(not(target_os = "linux"))]
fn file_system_magic(_: &Path) -> Option<u32> {
    None
}

/// The file systems without coherent shared memory, by the magic numbers of statfs(2).
fn network_kind(magic: u32) -> Option<&'static str> {
    Some(match magic {
        0x6969 => "NFS",
        0x517B | 0xFF53_4D42 | 0xFE53_4D42 => "SMB/CIFS",
        0x0BD0_0BD0 => "Lustre",
        0x4750_4653 => "GPFS",
        0x6573_5546 => "FUSE (sshfs and the like)",
        0x00C3_6400 => "CephFS",
        0x1983_0326 => "BeeGFS",
        0x2003_0528 => "OrangeFS",
        0x5346_414F | 0x6B41_4653 => "AFS",
        0x0102_1997 => "9P",
        0x7461_636F => "OCFS2",
        0x0116_1970 => "GFS2",
        0xAAD7_AAEA => "PanFS",
        0x564C => "NCP",
        0x7375_7245 => "Coda",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn network_file_systems_are_known_and_local_ones_are_not_taken_for_them() {
        assert_eq!(network_kind(0x6969), Some("NFS"));
        assert_eq!(network_kind(0xFF53_4D42), Some("SMB/CIFS"));
        for local in [0xEF53, 0x9123_683E, 0x5846_5342, 0x0102_1994, 0x794C_7630, 0x2FC1_2FC1] {
            assert_eq!(network_kind(local), None, "{local:#x}");
        }
    }

    #[test]
    fn a_holder_is_seen_while_it_lives_and_gone_after() {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(holder(dir.path()), None);
        let lock = take(dir.path()).unwrap();
        assert_eq!(holder(dir.path()), Some(Holder::this_process()));
        drop(lock);
        assert_eq!(holder(dir.path()), None);
    }
}

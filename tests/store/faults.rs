//! Operations that fail, or are the last before the process dies, in the stores of tests.
//!
//! A test arms a store's folder; every operation below it is then counted, and the one that was asked for goes wrong.
//! A process that died is played by a copy of the folder as it was at that instant, and by refusing every later
//! operation of the original. A power loss is played by undoing in the copy what was not yet flushed: contents are cut
//! in half, names are as before, removed files are back.

use crate::store::disk::Operation;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What goes wrong at an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) enum Fault {
    /// It fails, once.
    Error,
    /// The process dies after it.
    Death,
    /// The machine loses its power after it.
    PowerLoss,
    /// The disk is full: from then on no file is made or written, until this ends.
    Full,
}

/// What happens, and what happened, in one folder.
struct ArmedFolder {
    folder: PathBuf,
    at: usize,
    fault: Fault,
    count: usize,
    seen: Vec<String>,
    /// Where the copy is made, and whether it was.
    copy: PathBuf,
    dead: bool,
    /// Files written and not flushed.
    unflushed: Vec<PathBuf>,
    /// Names given, `(from, to)`, in folders not flushed since.
    renamed: Vec<(PathBuf, PathBuf)>,
    /// Second names of files, in folders not flushed since.
    linked: Vec<PathBuf>,
    /// Files removed, with their bytes, in folders not flushed since.
    removed: Vec<(PathBuf, Vec<u8>)>,
}

static ARMED: Mutex<Vec<ArmedFolder>> = Mutex::new(Vec::new());

fn all_armed() -> MutexGuard<'static, Vec<ArmedFolder>> {
    ARMED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets the operation number `at`, counted from 1, in `folder` go wrong; a copy of a dead store appears at `copy`.
pub(in crate::store) fn arm(folder: &Path, at: usize, fault: Fault, copy: &Path) {
    all_armed().push(ArmedFolder {
        folder: folder.to_owned(),
        at,
        fault,
        count: 0,
        seen: Vec::new(),
        copy: copy.to_owned(),
        dead: false,
        unflushed: Vec::new(),
        renamed: Vec::new(),
        linked: Vec::new(),
        removed: Vec::new(),
    });
}

/// Ends it; returns what operations there were, and whether the store died.
pub(in crate::store) fn disarm(folder: &Path) -> (Vec<String>, bool) {
    let mut all = all_armed();
    let index = all.iter().position(|armed| armed.folder == folder).expect("the folder was armed");
    let armed = all.swap_remove(index);
    (armed.seen, armed.dead)
}

fn refusal() -> std::io::Error {
    std::io::Error::other("made to fail")
}

/// Counts an operation; refuses it if it is the one to fail, or if the store has died.
pub(super) fn before(operation: Operation<'_>, path: &Path) -> std::io::Result<()> {
    let mut all = all_armed();
    let Some(armed) = all.iter_mut().find(|armed| path.starts_with(&armed.folder)) else { return Ok(()) };
    if armed.dead {
        return Err(refusal());
    }
    armed.count += 1;
    let name = path.strip_prefix(&armed.folder).unwrap_or(path).display();
    armed.seen.push(format!("{operation:?} {name}"));
    if operation == Operation::Remove
        && let Ok(bytes) = std::fs::read(path)
    {
        armed.removed.push((path.to_owned(), bytes));
    }
    match armed.fault {
        Fault::Error if armed.count == armed.at => Err(refusal()),
        Fault::Full if armed.count >= armed.at && matches!(operation, Operation::Create | Operation::Write) => {
            Err(std::io::ErrorKind::StorageFull.into())
        }
        _ => Ok(()),
    }
}

/// Notes what an operation did; the one after which the store dies makes the copy.
pub(super) fn after(operation: Operation<'_>, path: &Path) -> std::io::Result<()> {
    let mut all = all_armed();
    let Some(armed) = all.iter_mut().find(|armed| path.starts_with(&armed.folder)) else { return Ok(()) };
    match operation {
        Operation::Create | Operation::Write => {
            armed.unflushed.retain(|other| other != path);
            armed.unflushed.push(path.to_owned());
        }
        Operation::Link => armed.linked.push(path.to_owned()),
        Operation::Sync => armed.unflushed.retain(|other| other != path),
        Operation::RenameTo(to) => {
            let renamed = armed.renamed.iter_mut().flat_map(|(from, to)| [from, to]);
            armed.unflushed.iter_mut().chain(&mut armed.linked).chain(renamed).for_each(|file| follow(file, path, to));
            armed.renamed.push((path.to_owned(), to.to_owned()));
        }
        Operation::SyncFolder => {
            armed.renamed.retain(|(_, to)| to.parent() != Some(path));
            armed.linked.retain(|file| file.parent() != Some(path));
            armed.removed.retain(|(file, _)| file.parent() != Some(path));
        }
        Operation::CreateFolder | Operation::RemoveFolder | Operation::Remove | Operation::Commit => {}
    }
    if armed.count != armed.at || matches!(armed.fault, Fault::Error | Fault::Full) {
        return Ok(());
    }
    armed.dead = true;
    copy_folder(&armed.folder, &armed.copy)?;
    if armed.fault == Fault::PowerLoss {
        armed.lose_power()?;
    }
    Err(refusal())
}

/// The path of a file after it, or a folder that it is in, got another name.
fn follow(file: &mut PathBuf, from: &Path, to: &Path) {
    if let Ok(within) = file.strip_prefix(from) {
        *file = to.components().chain(within.components()).collect();
    }
}

impl ArmedFolder {
    /// Undoes in the copy what was not flushed.
    fn lose_power(&self) -> std::io::Result<()> {
        let in_copy = |path: &Path| self.copy.join(path.strip_prefix(&self.folder).unwrap_or(path));
        for path in self.unflushed.iter().map(|path| in_copy(path)).filter(|path| path.exists()) {
            let bytes = std::fs::read(&path)?;
            std::fs::write(&path, &bytes[..bytes.len() / 2])?;
        }
        for path in self.linked.iter().map(|path| in_copy(path)).filter(|path| path.exists()) {
            std::fs::remove_file(path)?;
        }
        for (from, to) in self.renamed.iter().rev() {
            if in_copy(to).exists() {
                std::fs::rename(in_copy(to), in_copy(from))?;
            }
        }
        self.removed.iter().try_for_each(|(path, bytes)| std::fs::write(in_copy(path), bytes))
    }
}

/// Copies a folder as the kernel has it now; the shared memory of SQLite dies with its process.
pub(in crate::store) fn copy_folder(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy_folder(&entry.path(), &target)?;
        } else if entry.path().extension().is_none_or(|extension| extension != "db-shm") {
            std::fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

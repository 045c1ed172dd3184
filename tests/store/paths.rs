//! Whatever stands in a store, what this program makes, writes, moves or removes lies in that store.
//!
//! A unit test of the crate, as `every_fault.rs` is: what stands behind the operations of the disk counts them.

use crate::store::disk::faults::{Fault, arm, disarm};
use crate::store::every_fault::{scratch, tiny_campaign};
use crate::store::folders::database;
use crate::store::*;
use rusqlite::Connection;
use std::os::unix::fs::symlink;
use std::path::Path;

/// Changes that a stranger may make, to the rows of a store and to its files.
const HOSTILE: [(&str, &[(&str, &str)]); 5] = [
    ("", &[]),
    ("UPDATE sample_files SET path = '../victim/file' || key", &[]),
    ("UPDATE sample_files SET checksum = 'x'", &[("samples/0123456789abcdef0123.parquet", "file")]),
    (
        "UPDATE outcomes SET dump = '../victim/file'",
        &[("aside/batch.tmp", "file"), ("dumps/0123456789abcdef0123.ckpt", "file")],
    ),
    (
        "UPDATE campaigns SET name = '../../victim'; DELETE FROM sample_files",
        &[("checkpoints/0123456789abcdef0123.ckpt.tmp", "file")],
    ),
];

#[test]
fn every_path_that_is_written_moved_or_removed_lies_in_the_store() {
    let tiny = tiny_campaign();
    for (sql, links) in HOSTILE {
        let sandbox = scratch();
        let dir = sandbox.path().join("store");
        std::fs::create_dir(sandbox.path().join("victim")).unwrap();
        std::fs::write(sandbox.path().join("victim/file"), "precious").unwrap();
        tiny.run(&dir, 3).unwrap();
        let conn = Connection::open(database(&dir)).unwrap();
        conn.execute_batch(&format!("PRAGMA foreign_keys = off; {sql}")).unwrap();
        drop(conn);
        for (name, victim) in links {
            symlink(sandbox.path().join("victim").join(victim), dir.join(name)).unwrap();
        }

        arm(sandbox.path(), usize::MAX, Fault::Error, Path::new(""));
        let _ = check(&dir);
        let _ = tiny.run(&dir, 1);
        repair(&dir).unwrap();
        tiny.run(&dir, usize::MAX).unwrap();
        let _ = forget(&dir, "tiny").or_else(|_| forget(&dir, "../../victim"));
        let (seen, _) = disarm(sandbox.path());

        assert!(seen.len() > 100, "{sql}: {} operations", seen.len());
        let root = format!("RenameTo(\"{}/", sandbox.path().display());
        for operation in &seen {
            let (what, path) = operation.rsplit_once(' ').unwrap();
            assert!(path == "store" || path.starts_with("store/"), "{sql}: {operation}");
            assert!(!what.starts_with("RenameTo") || what.starts_with(&format!("{root}store/")), "{sql}: {operation}");
            let follows = std::fs::canonicalize(sandbox.path().join(path));
            assert!(
                !path.contains("..") && follows.is_ok_and(|path| path.starts_with(&dir))
                    || !sandbox.path().join(path).exists(),
                "{operation}"
            );
        }
        assert_eq!(std::fs::read(sandbox.path().join("victim/file")).unwrap(), b"precious");
        assert_eq!(std::fs::read_dir(sandbox.path().join("victim")).unwrap().count(), 1);
    }
}

//! A folder with a store, and beside it files that no command on the store may touch.

use super::common::{expect, meniscus};
use rusqlite::Connection;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::{Duration, Instant};

/// A small campaign: both models, some clogs, one shape a job.
pub const CAMPAIGN: &str = r#"
name = "letter"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.7
box_size = 20.0
runs_per_point = 2
sample_every = 2.0
limits = { t_max = 60.0, distance = 2.0 }

[[block]]
name = "soft"
model = "SP"
grid = { e_w = [1.0, 30.0] }

[[block]]
name = "deformable"
model = "DP"
dynamics = "vertex"
n_vertices = 32
gamma = 1.0
"#;

/// Longest time that a command may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// A folder with a store in it, and sentinels.
pub struct Sandbox {
    folder: tempfile::TempDir,
    before: Tree,
}

/// Every entry below a folder: what it is, when it changed, what it holds.
type Tree = BTreeMap<PathBuf, (u32, i64, i64, Vec<u8>)>;

fn tree(folder: &Path) -> Tree {
    let mut tree = Tree::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let entry = path.symlink_metadata().unwrap();
        let bytes = if entry.is_file() { std::fs::read(&path).unwrap() } else { Vec::new() };
        if entry.is_dir() {
            tree.extend(self::tree(&path));
        }
        tree.insert(path, (entry.mode(), entry.mtime(), entry.mtime_nsec(), bytes));
    }
    tree
}

impl Sandbox {
    /// A sandbox whose store holds the finished campaign.
    pub fn new() -> Self {
        let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap();
        std::fs::write(folder.path().join("letter.toml"), CAMPAIGN).unwrap();
        expect(0, folder.path(), &["-q", "run", "letter.toml", "--store", "store"]);
        let victim = folder.path().join("victim");
        std::fs::create_dir_all(victim.join("folder")).unwrap();
        for name in
            ["bashrc", "authorized_keys", "notes.parquet", "half.tmp", "0123456789abcdef0123.ckpt.tmp", "folder/x"]
        {
            std::fs::write(victim.join(name), format!("precious: {name}")).unwrap();
        }
        let before = tree(&victim);
        Self { folder, before }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn store(&self) -> PathBuf {
        self.folder.path().join("store")
    }

    /// Something beside the store.
    pub fn victim(&self, name: &str) -> PathBuf {
        self.folder.path().join("victim").join(name)
    }

    /// Changes rows of the store, as somebody else's program would, and takes away the seal that would tell.
    pub fn sql(&self, sql: &str) {
        let conn = Connection::open(self.store().join("store.db")).unwrap();
        conn.execute_batch(sql).unwrap();
        drop(conn);
        let _ = std::fs::remove_file(self.store().join("store.db.seal"));
    }

    /// The number of the schema of the store.
    pub fn schema(&self) -> u32 {
        let conn = Connection::open(self.store().join("store.db")).unwrap();
        conn.pragma_query_value(None, "user_version", |row| row.get(0)).unwrap()
    }

    /// The id of a job of the store.
    pub fn a_job(&self) -> String {
        let conn = Connection::open(self.store().join("store.db")).unwrap();
        conn.query_row("SELECT job_id FROM jobs ORDER BY key LIMIT 1", [], |row| row.get(0)).unwrap()
    }

    /// Every command on this store.
    pub fn commands(&self) -> Vec<Vec<String>> {
        commands(&self.a_job(), &self.folder.path().join("out"))
    }

    /// Runs a command, which must end by itself, in time, and leave what lies beside the store alone.
    pub fn run(&self, arguments: &[&str]) -> Output {
        std::fs::create_dir_all(self.folder.path().join("out")).unwrap();
        let begin = Instant::now();
        let mut command = std::process::Command::new("timeout");
        command.args(["-k", "1", &PATIENCE.as_secs().to_string()]).arg(meniscus(self.path(), &[]).get_program());
        let output = command.args(arguments).current_dir(self.path()).env("RUST_BACKTRACE", "0").output().unwrap();
        let text = text(&output);
        assert!(begin.elapsed() < PATIENCE, "meniscus {arguments:?} did not end");
        assert!(
            matches!(output.status.code(), Some(0..=3)),
            "meniscus {arguments:?} ended with {}:\n{text}",
            output.status
        );
        self.assert_untouched(&format!("meniscus {arguments:?}"));
        output
    }

    /// Runs every command.
    pub fn run_all(&self) {
        for command in self.commands() {
            let _ = std::fs::remove_dir_all(self.folder.path().join("out"));
            self.run(&command.iter().map(String::as_str).collect::<Vec<_>>());
        }
    }

    pub fn assert_untouched(&self, who: &str) {
        let after = tree(&self.folder.path().join("victim"));
        assert!(after == self.before, "{who} touched what lies beside the store: {:?}", after.keys());
    }
}

/// Every command that takes a store, `store` in the current folder, with arguments that make it do all it can; pictures
/// and tables go to `out`. Those that write come last.
pub fn commands(job: &str, out: &Path) -> Vec<Vec<String>> {
    let out = |name: &str| out.join(name).display().to_string();
    let list = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    let dump = format!("store/dumps/{job}.ckpt");
    vec![
        list(&["status", "store"]),
        list(&["status", "store", "--json"]),
        list(&["query", "store", "select * from runs"]),
        list(&["query", "store", "select count(*), max(t), min(shape) from samples", "--format", "csv"]),
        list(&["query", "store", "select seed, max(t) from runs join samples using (job_id) group by 1"]),
        list(&["query", "store", "select count(*) from outline join obstacles using (job_id)"]),
        list(&["render", "store"]),
        list(&["render", "store", job, "-o", &out("clog.png")]),
        list(&["render", "store", job, "--path", "-o", &out("path.svg")]),
        list(&["compare", "store", "--over", "e_w"]),
        list(&["plan", "letter.toml", "--store", "store"]),
        list(&["replay", &dump]),
        list(&["forget", "store", "letter"]),
        list(&["check", "store"]),
        list(&["export", "store", &out("tables")]),
        list(&["fit", "store"]),
        list(&["run", "letter.toml", "--store", "store", "--threads", "2"]),
        list(&["check", "store", "--repair"]),
        list(&["run", "letter.toml", "--store", "store", "--threads", "2"]),
        list(&["forget", "store", "letter", "--yes"]),
    ]
}

/// All that a command said.
pub fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// Makes a link.
pub fn link(target: &Path, name: &Path) {
    let _ = std::fs::remove_file(name);
    let _ = std::fs::remove_dir_all(name);
    std::os::unix::fs::symlink(target, name).unwrap();
}

/// Makes a named pipe, in the place of a file.
pub fn pipe(name: &Path) {
    let _ = std::fs::remove_file(name);
    let made = std::process::Command::new("mkfifo").arg(name).status().unwrap();
    assert!(made.success());
}

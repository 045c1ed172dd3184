//! Hostile stores by the thousand: rows, links, types, triggers, special files, lies in Parquet files and dumps. Every
//! command runs on each of them, with a gigabyte of memory, and must end by itself and touch nothing else.
//!
//! Each store is made from its number alone. A few run with the other tests; these lines run many, or one of them:
//!
//! ```text
//! MENISCUS_FUZZ_INPUTS=100000 cargo test --release --test hostile -- --nocapture hostile_stores
//! MENISCUS_FUZZ_KEEP=1 MENISCUS_FUZZ_FROM=4711 MENISCUS_FUZZ_INPUTS=1 cargo test --release --test hostile -- --nocapture hostile_stores
//! ```

use super::dump::Dump;
use super::mutate::{Random, mutate};
use super::parquet_files::{Odd, odd_file};
use super::sandbox::{CAMPAIGN, Sandbox, commands, link, pipe};
use super::worker::Worker;
use rusqlite::Connection;
use rusqlite::config::DbConfig;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A process runs the commands on so many stores. Each run leaves a thread that waits for signals.
const STORES_A_PROCESS: usize = 50;

/// Values that no row of ours holds, as SQL.
const VALUES: [&str; 24] = [
    "NULL",
    "''",
    "-1",
    "9223372036854775807",
    "-9223372036854775808",
    "1e308",
    "-1e308",
    "9e999",
    "-0.0",
    "1e-310",
    "'../victim/bashrc'",
    "'/etc/passwd'",
    "'samples/0123456789abcdef0123.parquet'",
    "'/dev/zero'",
    "char(27) || ']52;c;eA==' || char(7) || char(10) || 'nothing is wrong'",
    "x'00ff00ff'",
    "zeroblob(100000)",
    "hex(randomblob(5000))",
    "'{\"model\":{}}'",
    "'done'",
    "'running'",
    "'failed'",
    "'file:x?mode=memory'",
    "'=cmd()'",
];

/// Numbers that a point cannot have.
const NUMBERS: [&str; 8] = ["0.0", "-1.0", "1e300", "1e-300", "1e9", "1000000000", "null", "20000.0"];

/// What a stranger may plant in a schema.
const PLANTED: [&str; 10] = [
    "CREATE TRIGGER t AFTER UPDATE ON jobs BEGIN UPDATE outcomes SET r_end = 99; END",
    "CREATE TRIGGER t AFTER INSERT ON provenance BEGIN DELETE FROM outcomes; END",
    "CREATE TRIGGER t AFTER UPDATE ON jobs BEGIN INSERT INTO current WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT 2, count(*) FROM n; END",
    "DROP VIEW runs; CREATE VIEW runs AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS job_id FROM n",
    "CREATE VIEW samples AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) AS t FROM n",
    "CREATE TABLE obstacles (x)",
    "CREATE INDEX planted ON outcomes (length(hex(zeroblob(1000000))))",
    "CREATE VIRTUAL TABLE planted USING fts5(x)",
    "DROP TABLE campaigns",
    "PRAGMA user_version = 99",
];

/// Names of entries of a store.
const ENTRIES: [&str; 20] = [
    "lock",
    "readers",
    "store.db",
    "store.db-wal",
    "store.db-shm",
    "store.db-journal",
    "store.db.seal",
    "store.db.seal.tmp",
    "store.db.new.tmp",
    "store.db.backup.tmp",
    "store.db.schema-6",
    "samples",
    "aside",
    "checkpoints",
    "dumps",
    "quarantine",
    "forgetting",
    "rescue.tmp",
    "aside/batch.tmp",
    "samples/0123456789abcdef0123.parquet",
];

/// What a hostile store is made from.
struct Corpus {
    sandbox: Sandbox,
    /// The sound store.
    store: PathBuf,
    job: String,
    odd: Vec<Vec<u8>>,
    dump: Vec<u8>,
}

impl Corpus {
    fn new() -> Self {
        let sandbox = Sandbox::new();
        sandbox.sql(
            "UPDATE jobs SET state = 'pending' WHERE key = 2; DELETE FROM outcomes WHERE job = 2;
             DELETE FROM clogs WHERE job = 2; DELETE FROM sample_index WHERE job = 2; DELETE FROM shape_rows WHERE job = 2",
        );
        let (store, job) = (sandbox.path().join("sound"), sandbox.a_job());
        std::fs::rename(sandbox.store(), &store).unwrap();
        let sample = std::fs::read_dir(store.join("samples")).unwrap().next().unwrap().unwrap().path();
        let sound = std::fs::read(sample).unwrap();
        let cheap = Odd::ALL.into_iter().filter(|odd| !matches!(odd, Odd::AlternatingIds | Odd::LargePage));
        let odd = cheap.map(|odd| odd_file(odd, &sound)).collect();
        let dump = Dump::new().failed_with("unstable");
        Self { store, job, odd, dump: std::fs::read(dump.path()).unwrap(), sandbox }
    }
}

/// A folder of one worker, with a store and sentinels.
struct Place<'a> {
    corpus: &'a Corpus,
    folder: PathBuf,
}

impl Place<'_> {
    fn store(&self) -> PathBuf {
        self.folder.join("store")
    }

    fn victim(&self, random: &mut Random) -> PathBuf {
        let names = ["victim/bashrc", "victim", "victim/folder", "victim/notes.parquet", "victim/nothing"];
        self.folder.join(names[random.below(names.len())])
    }

    /// Makes a sound store and untouched sentinels.
    fn make(&self) {
        let _ = std::fs::remove_dir_all(&self.folder);
        std::fs::create_dir_all(self.folder.join("out")).unwrap();
        copy(&self.corpus.store, &self.store());
        copy(&self.corpus.sandbox.victim(""), &self.folder.join("victim"));
        std::fs::write(self.folder.join("letter.toml"), CAMPAIGN).unwrap();
    }

    /// Changes one thing.
    fn spoil(&self, random: &mut Random) {
        let store = self.store();
        let kind = random.below(9);
        if is_kept() {
            println!("change of kind {kind}");
        }
        match kind {
            0 | 1 => self.spoil_rows(random),
            2 => self.sql(PLANTED[random.below(PLANTED.len())]),
            3 => {
                let entry = store.join(ENTRIES[random.below(ENTRIES.len())]);
                if !entry.parent().is_some_and(|folder| folder.symlink_metadata().is_ok_and(|entry| entry.is_dir())) {
                    return;
                }
                remove(&entry);
                match random.below(4) {
                    0 => pipe(&entry),
                    1 => drop(std::fs::create_dir(&entry)),
                    2 => link(Path::new("/dev/zero"), &entry),
                    _ => link(&self.victim(random), &entry),
                }
            }
            4 => self.spoil_point(random),
            5 => self.spoil_sample(random),
            6 => self.spoil_dump(random),
            7 => {
                let names = ["store.db", "store.db.seal", "lock", "store.db-journal", "store.db-wal"];
                let path = store.join(names[random.below(names.len())]);
                let mut bytes = std::fs::read(&path).unwrap_or_else(|_| random.noise(600));
                mutate(&mut bytes, random);
                // Not through a link.
                remove(&path);
                let _ = std::fs::write(&path, bytes);
            }
            _ => {
                let name = self.victim(random).display().to_string();
                let mut bytes = vec![0; 512];
                bytes[..8].copy_from_slice(&[0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7]);
                bytes.extend(name.as_bytes());
                bytes.extend((name.len() as u32).to_be_bytes());
                bytes.extend(name.bytes().map(u32::from).sum::<u32>().to_be_bytes());
                bytes.extend([0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7]);
                remove(&store.join("store.db-journal"));
                let _ = std::fs::write(store.join("store.db-journal"), bytes);
            }
        }
    }

    /// Whether SQLite, which opens anything, opens this database without waiting for a pipe that was put there before.
    fn can_be_opened(&self) -> bool {
        let is_file = |name: &str| self.store().join(name).symlink_metadata().map(|entry| entry.is_file());
        matches!(is_file("store.db"), Ok(true))
            && ["store.db-wal", "store.db-shm", "store.db-journal"].iter().all(|name| is_file(name).unwrap_or(true))
    }

    /// Runs SQL as somebody else's program would; what the database refuses is not done.
    fn sql(&self, sql: &str) {
        if is_kept() {
            println!("{sql}");
        }
        if self.can_be_opened()
            && let Ok(conn) = Connection::open(self.store().join("store.db"))
        {
            // What was planted before may be an endless trigger.
            let _ = conn.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false);
            let _ = conn.execute_batch("PRAGMA foreign_keys = off; PRAGMA ignore_check_constraints = on");
            let _ = conn.execute_batch(sql);
        }
        remove(&self.store().join("store.db.seal"));
    }

    fn spoil_rows(&self, random: &mut Random) {
        let path = self.store().join("store.db");
        let columns = || -> rusqlite::Result<Vec<(String, String)>> {
            let conn = Connection::open(&path)?;
            let mut statement = conn.prepare(
                "SELECT m.name, c.name FROM sqlite_master AS m JOIN pragma_table_info(m.name) AS c WHERE m.type = 'table'",
            )?;
            statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
        };
        let columns = if self.can_be_opened() { columns().unwrap_or_default() } else { Vec::new() };
        if !columns.is_empty() {
            let (table, column) = &columns[random.below(columns.len())];
            let value = VALUES[random.below(VALUES.len())];
            self.sql(&format!(
                "UPDATE OR REPLACE {table} SET {column} = {value} WHERE rowid % {} = 0",
                1 + random.below(3)
            ));
        }
    }

    /// Puts a number that no campaign can ask for into the points, and sometimes the ids that belong to it.
    fn spoil_point(&self, random: &mut Random) {
        let key = ["box_size", "sigma_ob", "w_ob", "dt", "t_max", "n_vertices", "v_t", "sample_every", "e_w", "gamma"];
        let (key, number) = (key[random.below(key.len())], NUMBERS[random.below(NUMBERS.len())]);
        // From the key to the next comma or brace.
        self.sql(&format!(
            "UPDATE points SET spec = substr(spec, 1, instr(spec, '\"{key}\":') + {skip}) || '{number}' ||
                 ltrim(substr(spec, instr(spec, '\"{key}\":') + {skip} + 1), '0123456789.e-')
             WHERE instr(spec, '\"{key}\":') > 0",
            skip = key.len() + 2
        ));
    }

    fn spoil_sample(&self, random: &mut Random) {
        let folder = self.store().join("samples");
        if !folder.symlink_metadata().is_ok_and(|entry| entry.is_dir()) {
            return;
        }
        let Some(Ok(file)) = std::fs::read_dir(folder).ok().and_then(|mut files| files.next()) else { return };
        let path = file.path();
        if !path.symlink_metadata().is_ok_and(|entry| entry.is_file()) {
            return;
        }
        let Ok(mut bytes) = std::fs::read(&path) else { return };
        match random.below(3) {
            0 => bytes = self.corpus.odd[random.below(self.corpus.odd.len())].clone(),
            _ => mutate(&mut bytes, random),
        }
        let _ = std::fs::write(&path, &bytes);
        let checksum = blake3::hash(&bytes).to_hex();
        self.sql(&format!("UPDATE sample_files SET checksum = '{checksum}', bytes = {}", bytes.len()));
    }

    /// Puts a dump or a checkpoint with a right checksum, but with other bytes, where the job has its own.
    fn spoil_dump(&self, random: &mut Random) {
        let mut body = self.corpus.dump[40..].to_vec();
        mutate(&mut body, random);
        let bytes = [&self.corpus.dump[..8], blake3::hash(&body).as_bytes().as_slice(), &body].concat();
        let folder = ["dumps", "checkpoints"][random.below(2)];
        let path = self.store().join(format!("{folder}/{}.ckpt", self.corpus.job));
        remove(&path);
        if path.parent().is_some_and(|folder| folder.symlink_metadata().is_ok_and(|entry| entry.is_dir())) {
            let _ = std::fs::write(path, bytes);
        }
        if random.below(2) == 0 {
            self.sql("UPDATE jobs SET state = 'pending'; DELETE FROM outcomes");
        }
    }

    /// Runs every command, and says what went wrong.
    fn attack(&self, worker: &mut Worker) -> Result<(), String> {
        worker.hush();
        for command in commands(&self.corpus.job, &self.folder.join("out")) {
            worker.run(&self.folder, &command)?;
        }
        let said = worker.said();
        if said.contains("panicked at") || said.chars().any(|c| c.is_control() && c != '\n' && c != '\t') {
            return Err(format!("a panic, or characters that a terminal obeys:\n{said}"));
        }
        match same(&self.corpus.sandbox.victim(""), &self.folder.join("victim")) {
            true => Ok(()),
            false => Err("a sentinel was touched".to_owned()),
        }
    }
}

/// Whether somebody looks into one store: what is done to it is told, and it stays.
fn is_kept() -> bool {
    std::env::var_os("MENISCUS_FUZZ_KEEP").is_some()
}

fn remove(path: &Path) {
    let _ = std::fs::remove_file(path);
    if path.symlink_metadata().is_ok_and(|entry| entry.is_dir()) {
        let _ = std::fs::remove_dir_all(path);
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target)
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Whether two folders hold the same.
fn same(a: &Path, b: &Path) -> bool {
    let names = |folder: &Path| {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut names: Vec<_> = entries.map(|entry| (entry.file_name(), entry.file_type().ok())).collect();
        names.sort_by(|a, b| a.0.cmp(&b.0));
        names
    };
    let all = names(a);
    all == names(b)
        && all.iter().all(|(name, kind)| match kind {
            Some(kind) if kind.is_dir() => same(&a.join(name), &b.join(name)),
            _ => std::fs::read(a.join(name)).ok() == std::fs::read(b.join(name)).ok(),
        })
}

/// What one thread found.
#[derive(Default)]
struct Found {
    slowest: (Duration, u64),
    /// The most memory of a process, in MB.
    memory: u64,
    wrong: Vec<u64>,
}

#[test]
fn hostile_stores_touch_nothing_outside_and_end_in_words() {
    let number = |name| std::env::var(name).ok().map(|text| text.parse::<u64>().unwrap());
    let (from, inputs) = (number("MENISCUS_FUZZ_FROM").unwrap_or(0), number("MENISCUS_FUZZ_INPUTS").unwrap_or(60));
    let corpus = Corpus::new();
    let (next, begin) = (AtomicU64::new(from), Instant::now());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let work = |number: usize| {
        let folder = corpus.sandbox.path().join(format!("place-{number}"));
        let (place, said) = (Place { corpus: &corpus, folder }, corpus.sandbox.path().join(format!("said-{number}")));
        let (mut found, mut worker) = (Found::default(), Worker::start(&said));
        for tried in 1.. {
            let input = next.fetch_add(1, Ordering::Relaxed);
            if input >= from + inputs {
                break;
            }
            let (mut random, start) = (Random::new(input), Instant::now());
            place.make();
            (0..=random.below(3)).for_each(|_| place.spoil(&mut random));
            let attacked = place.attack(&mut worker);
            found.memory = found.memory.max(worker.peak_memory());
            if let Err(problem) = &attacked {
                println!("store {input}: {problem}");
                found.wrong.push(input);
            }
            if attacked.is_err() || tried % STORES_A_PROCESS == 0 {
                worker = Worker::start(&said);
            }
            found.slowest = found.slowest.max((start.elapsed(), input));
        }
        found
    };
    let found: Vec<Found> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|number| scope.spawn(move || work(number))).collect();
        workers.into_iter().map(|worker| worker.join().unwrap()).collect()
    });
    let slowest = found.iter().map(|found| found.slowest).max();
    let memory = found.iter().map(|found| found.memory).max().unwrap_or_default();
    println!(
        "{inputs} hostile stores in {:.1?} on {threads} threads, slowest {slowest:?}, at most {memory} MB",
        begin.elapsed()
    );
    if is_kept() {
        println!("kept: {}", corpus.sandbox.path().display());
        std::mem::forget(corpus);
    }
    let wrong: Vec<u64> = found.into_iter().flat_map(|found| found.wrong).collect();
    assert!(wrong.is_empty(), "stores {wrong:?}; run one alone with MENISCUS_FUZZ_FROM and MENISCUS_FUZZ_INPUTS=1");
}

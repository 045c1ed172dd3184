//! Every operation that changes a store goes wrong once, in every way, and nothing is lost or done twice.
//!
//! An undisturbed run counts the operations. Then each of them fails; or is the last before the process dies; or is
//! the last before the machine loses its power. What is left is checked, opened and run on, and must equal the
//! undisturbed store.
//!
//! This is a unit test of the crate (`src/store/mod.rs` includes it), because it puts [`crate::store::disk::faults`]
//! behind the operations of the disk.

use crate::campaign::file::Campaign;
use crate::parameters::{Job, JobId};
use crate::physics::simd::best_instruction_set;
use crate::physics::simulate::{Context, simulate};
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::results::trajectory::FailureClass;
use crate::results::trajectory::{Failure, Trajectory};
use crate::store::disk::faults::{Fault, arm, copy_folder, disarm};
use crate::store::folders::{database, samples_dir};
use crate::store::*;
use rusqlite::Connection;
use std::collections::HashSet;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

const CAMPAIGN: &str = r#"
name = "tiny"
model = "SP"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 0.5
box_size = 20.0
runs_per_point = 3
sample_every = 5.0
limits = { t_max = 60.0, distance = 1.0 }
grid = { e_w = [1.0, 30.0] }
"#;

/// The campaign, and what its jobs come to. That is computed once, because simulating again gives the same bits.
pub(in crate::store) struct TinyCampaign {
    pub campaign: Campaign,
    pub results: Vec<(JobId, Result<Trajectory, Failure>)>,
}

pub(in crate::store) fn tiny_campaign() -> TinyCampaign {
    let mut tiny = computed(CAMPAIGN);
    // One of them fails.
    let outline = tiny.results[4].1.as_ref().unwrap().outlines.last().cloned().map(Box::new);
    tiny.results[4].1 = Err(Failure { class: FailureClass::Unstable, reason: "made to".to_owned(), step: 7, outline });
    tiny
}

fn computed(text: &str) -> TinyCampaign {
    let campaign = Campaign::parse("tiny.toml", text).unwrap();
    let (arrays, stop) = (ArrayLibrary::default(), AtomicBool::new(false));
    let block = &campaign.blocks[0];
    let mut results = Vec::new();
    for (point, &point_id) in block.points.iter().zip(&block.point_ids) {
        for seed in block.seeds.clone() {
            let job = Job { point: point.clone(), point_id, seed };
            let result =
                simulate(&job, Context { arrays: &arrays, instruction_set: best_instruction_set(), stop: &stop });
            results.push((job.id(), result.map(|trajectory| trajectory.expect("nobody stopped it"))));
        }
    }
    TinyCampaign { campaign, results }
}

impl TinyCampaign {
    /// A run: opens, registers, sends what is still to do (at most `most`), closes.
    pub(in crate::store) fn run(&self, dir: &Path, most: usize) -> Result<(), StoreError> {
        let mut store = Store::open(dir)?;
        let points: Vec<_> = PlannedPoint::all(&self.campaign).collect();
        let record = CampaignRecord { name: &self.campaign.name, text: &self.campaign.text };
        let campaign = store.register(&record, &points)?.campaign;
        let who = Provenance { program_version: "", git_commit: "", rustc: "", cpu_features: "", campaign };
        store.begin_run(&who)?;
        let pending: HashSet<_> = job_states(dir)?
            .into_iter()
            .filter_map(|(id, state)| (state == crate::parameters::JobState::Pending).then_some(id))
            .collect();
        // A commit an outcome, so that what happens does not depend on the clock.
        let options = WriterOptions {
            outcomes: 1,
            age: Duration::from_secs(3600),
            merge: 3,
            pauses: vec![Duration::ZERO],
            ..WriterOptions::default()
        };
        let (folder, last) = (store.folders().checkpoints(), self.results.last().expect("there are jobs").0);
        if pending.contains(&last) {
            // Twice, for the second takes the place of the first.
            checkpoint_file::write(&folder, last, b"an early state")?;
            checkpoint_file::write(&folder, last, b"a later state")?;
        }
        let writer = Writer::spawn(store, options)?;
        for (job, result) in self.results.iter().filter(|(job, _)| pending.contains(job)).take(most) {
            let _ = writer.sender().send(Message::Started(*job));
            let finished = Message::Finished { job: *job, result: result.clone(), wall_s: 0.5 };
            if writer.sender().send(finished).is_err() {
                break;
            }
        }
        writer.finish().map(drop)
    }

    /// Two runs, the first of which is stopped half-way.
    fn two_runs(&self, dir: &Path) -> Result<(), StoreError> {
        self.run(dir, 3)?;
        self.run(dir, usize::MAX)
    }
}

/// A folder, in memory where that is possible: flushes are what costs.
pub(in crate::store) fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

pub(in crate::store) fn answer(dir: &Path, sql: &str) -> String {
    let mut text = Vec::new();
    query(dir, sql, Format::Csv, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// All that a store holds of physics.
fn contents(dir: &Path) -> [String; 4] {
    [
        "SELECT job_id, e_w, seed, state, outcome, r_end, t_end, v_g_mean, ek_ratio_end, overlap_max, steps, error
         FROM runs ORDER BY job_id",
        "SELECT * FROM clog_events ORDER BY job_id",
        "SELECT job_id, t, hex(vertices), loads FROM shapes ORDER BY job_id, t",
        "SELECT * FROM samples ORDER BY job_id, t",
    ]
    .map(|sql| answer(dir, sql))
}

/// Jobs that have ended, and when: an outcome that is written again has another time.
fn ended(dir: &Path) -> Vec<String> {
    let sql = "SELECT job_id, finished FROM outcomes JOIN jobs ON jobs.key = outcomes.job ORDER BY finished, job_id";
    match open_reading(dir) {
        Ok(Some(_)) => answer(dir, sql).lines().skip(1).map(str::to_owned).collect(),
        _ => Vec::new(),
    }
}

/// Lets every operation of `act` go wrong in every way; `judge` gets what was left. Returns the number of operations.
fn at_every_operation(
    prepare: impl Fn(&Path),
    act: impl Fn(&Path) -> Result<(), StoreError>,
    judge: impl Fn(&Path, Fault, &str),
) -> usize {
    let run = |at: usize, fault: Fault| {
        let folder = scratch();
        let (store, copy) = (folder.path().join("store"), folder.path().join("copy"));
        std::fs::create_dir(&store).unwrap();
        prepare(&store);
        arm(&store, at, fault, &copy);
        let acted = act(&store);
        let (seen, dead) = disarm(&store);
        if at == 0 {
            acted.unwrap();
            return seen;
        }
        let place = format!("{fault:?} at operation {at}, {}", seen[at - 1]);
        assert_eq!(dead, fault != Fault::Error, "{place}");
        judge(if dead { &copy } else { &store }, fault, &place);
        seen
    };
    let all = run(0, Fault::Error);
    for fault in [Fault::Error, Fault::Death, Fault::PowerLoss] {
        (1..=all.len()).for_each(|at| drop(run(at, fault)));
    }
    all.len()
}

/// What a crash may leave: files that no row names, and nothing else.
fn only_leftovers(dir: &Path, place: &str) {
    match check(dir) {
        Ok(report) => {
            let wrong: Vec<_> =
                report.findings.iter().filter(|found| !found.problem.contains("a crash left it")).collect();
            assert!(wrong.is_empty(), "{place}: {wrong:?}");
        }
        Err(StoreError::Missing(_)) => {}
        Err(error) => panic!("{place}: {error}"),
    }
}

#[test]
fn a_run_survives_a_fault_at_every_operation() {
    let tiny = tiny_campaign();
    let whole = scratch();
    tiny.two_runs(whole.path()).unwrap();
    let expected = contents(whole.path());
    assert!(expected[0].contains("failed") && expected[0].contains("distance"));
    let most = std::sync::Mutex::new((None, 0));
    let points = at_every_operation(
        |_| {},
        |dir| tiny.two_runs(dir),
        |dir, fault, place| {
            only_leftovers(dir, place);
            let before = ended(dir);
            if fault != Fault::Error {
                // What was committed before an operation is still there at the next.
                let mut most = most.lock().unwrap();
                let least = if most.0 == Some(fault) { most.1 } else { 0 };
                assert!(before.len() >= least, "{place}: an outcome was lost");
                *most = (Some(fault), before.len());
            }
            tiny.run(dir, usize::MAX).unwrap();
            assert_eq!(check(dir).unwrap().findings, [], "{place}");
            assert!(contents(dir) == expected, "{place}: the results differ");
            let after = ended(dir);
            assert!(before.iter().all(|row| after.contains(row)), "{place}: an outcome was computed twice");
            let files = std::fs::read_dir(samples_dir(dir)).unwrap().count();
            assert_eq!(answer(dir, "SELECT count(*) FROM sample_files"), format!("count(*)\n{files}\n"), "{place}");
        },
    );
    println!("{points} operations of a run, each wrong in 3 ways");
    assert!(points > 60, "{points}");
}

#[test]
fn the_making_of_a_store_survives_a_fault_at_every_operation_whoever_opens_what_is_left() {
    let open = |dir: &Path| Store::open(dir).map(drop);
    type Opener = fn(&Path) -> Result<(), StoreError>;
    let firsts: [Opener; 5] = [
        |dir| Store::open(dir).map(drop),
        |dir| status(dir).map(drop),
        |dir| open_reading(dir).map(drop),
        |dir| check(dir).map(drop),
        |dir| repair(dir).map(drop),
    ];
    let points = at_every_operation(
        |_| {},
        open,
        |dir, _, place| {
            only_leftovers(dir, place);
            for (number, first) in firsts.iter().enumerate() {
                let copy = scratch();
                copy_folder(dir, copy.path()).unwrap();
                match first(copy.path()) {
                    Ok(()) | Err(StoreError::Missing(_)) => {}
                    Err(error) => panic!("{place}, opener {number}: {error}"),
                }
                open(copy.path()).unwrap_or_else(|error| panic!("{place}, opener {number}: {error}"));
                assert_eq!(check(copy.path()).unwrap().findings, [], "{place}, opener {number}");
                assert_eq!(answer(copy.path(), "SELECT count(*) FROM runs"), "count(*)\n0\n", "{place}");
            }
        },
    );
    println!("{points} operations of the making of a store, each wrong in 3 ways, opened by {} others", firsts.len());
    assert!(points > 10, "{points}");
}

#[test]
fn a_repair_survives_a_fault_at_every_operation() {
    let tiny = tiny_campaign();
    let whole = scratch();
    tiny.two_runs(whole.path()).unwrap();
    let expected = contents(whole.path());
    // Three kinds of damage at once: the header, a sample file, and rows.
    let broken = |dir: &Path| {
        tiny.two_runs(dir).unwrap();
        let conn = Connection::open(database(dir)).unwrap();
        conn.execute_batch(
            "DELETE FROM outcomes WHERE job = (SELECT max(job) FROM outcomes WHERE outcome IS NOT NULL)",
        )
        .unwrap();
        let path: String = conn.query_row("SELECT path FROM sample_files", [], |row| row.get(0)).unwrap();
        drop(conn);
        std::fs::remove_file(seal::path(dir)).unwrap();
        for (path, place) in [(dir.join(path), 99), (database(dir), 20)] {
            let mut bytes = std::fs::read(&path).unwrap();
            bytes[place] ^= 4;
            std::fs::write(&path, bytes).unwrap();
        }
    };
    let points = at_every_operation(
        broken,
        |dir| repair(dir).map(drop),
        |dir, _, place| {
            repair(dir).unwrap_or_else(|error| panic!("{place}: {error}"));
            assert_eq!(check(dir).unwrap().findings, [], "{place}");
            tiny.run(dir, usize::MAX).unwrap();
            assert!(contents(dir) == expected, "{place}: the results differ");
            assert_eq!(check(dir).unwrap().findings, [], "{place}");
        },
    );
    println!("{points} operations of a repair, each wrong in 3 ways");
    assert!(points > 15, "{points}");
}

#[test]
fn an_upgrade_survives_a_fault_at_every_operation() {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/store/fixtures/schema-1/store");
    let old = |dir: &Path| {
        std::fs::create_dir(samples_dir(dir)).unwrap();
        std::fs::copy(database(&fixture), database(dir)).unwrap();
        for file in std::fs::read_dir(samples_dir(&fixture)).unwrap() {
            let file = file.unwrap();
            std::fs::copy(file.path(), samples_dir(dir).join(file.file_name())).unwrap();
        }
    };
    let open = |dir: &Path| Store::open(dir).map(drop);
    let runs = "SELECT * FROM all_runs ORDER BY job_id";
    let whole = scratch();
    old(whole.path());
    open(whole.path()).unwrap();
    let points = at_every_operation(old, open, |dir, _, place| {
        only_leftovers(dir, place);
        open(dir).unwrap();
        assert_eq!(answer(dir, runs), answer(whole.path(), runs), "{place}");
        let backup = Connection::open(dir.join("store.db.schema-1")).unwrap();
        let schema: i64 = backup.pragma_query_value(None, "user_version", |row| row.get(0)).unwrap();
        assert_eq!(schema, 1, "{place}: the backup is of the old schema");
    });
    println!("{points} operations of an upgrade, each wrong in 3 ways");
    assert!(points > 8, "{points}");
}

/// Another campaign, which plans two of the jobs of the first, and two of its own.
fn other_campaign() -> TinyCampaign {
    let text = CAMPAIGN.replace("\"tiny\"", "\"other\"").replace("runs_per_point = 3", "runs_per_point = 2");
    computed(&text.replace("e_w = [1.0, 30.0]", "e_w = [1.0, 10.0]"))
}

/// The stores of forgotten campaigns.
fn forgotten(dir: &Path) -> Vec<std::path::PathBuf> {
    let stores = std::fs::read_dir(dir.join("quarantine")).into_iter().flatten();
    stores.map(|store| store.unwrap().path()).collect()
}

#[test]
fn forgetting_a_campaign_survives_a_fault_at_every_operation() {
    let (tiny, other) = (tiny_campaign(), other_campaign());
    // Sample files of one campaign alone and of both, a failed job with its dump, an unfinished one with its
    // checkpoint.
    let both = |dir: &Path| {
        tiny.run(dir, 3).unwrap();
        other.run(dir, usize::MAX).unwrap();
        tiny.run(dir, 2).unwrap();
        checkpoint_file::write(&Folders::of(dir).dumps(), tiny.results[4].0, b"how it failed").unwrap();
    };
    let (whole, alone) = (scratch(), scratch());
    both(whole.path());
    other.run(alone.path(), usize::MAX).unwrap();
    let (everything, rest) = (contents(whole.path()), contents(alone.path()));
    let files_of_jobs = |dir: &Path| {
        let folders = Folders::of(dir);
        [folders.dumps(), folders.checkpoints()].map(|folder| std::fs::read_dir(folder).unwrap().count())
    };
    assert_eq!(files_of_jobs(whole.path()), [1, 1]);
    let told = forget(whole.path(), "tiny").unwrap().0;
    assert!(told.files > 0 && told.files_rewritten > 0 && told.handed_over["other"] == 2, "{told:?}");
    let kept = contents(&forgotten(whole.path())[0]);
    assert!(contents(whole.path()) == rest && kept[0].contains("failed"));
    let points = at_every_operation(
        both,
        |dir| forget(dir, "tiny").map(drop),
        |dir, _, place| {
            drop(Store::open(dir).unwrap_or_else(|error| panic!("{place}: {error}")));
            assert_eq!(check(dir).unwrap().findings, [], "{place}");
            let (left, files) = (contents(dir), files_of_jobs(dir));
            let is_whole = (left == everything, files == [1, 1]);
            let is_rest = (left == rest, files == [0, 0]);
            assert!(is_whole == (true, true) || is_rest == (true, true), "{place}: {is_whole:?} {is_rest:?}");
            assert!(!dir.join("forgetting").exists(), "{place}");
            if left == everything {
                forget(dir, "tiny").unwrap_or_else(|error| panic!("{place}: {error}"));
            }
            assert!(matches!(forget(dir, "tiny"), Err(StoreError::NoCampaign { .. })), "{place}");
            assert!(contents(dir) == rest, "{place}: another campaign lost something");
            assert_eq!(check(dir).unwrap().findings, [], "{place}");
            for store in forgotten(dir) {
                assert_eq!(check(&store).unwrap().findings, [], "{place}");
                assert!(contents(&store) == kept && files_of_jobs(&store) == [1, 1], "{place}: {}", store.display());
            }
            tiny.run(dir, 3).unwrap();
            assert!(contents(dir) == everything, "{place}: what was forgotten is not computed as before");
        },
    );
    println!("{points} operations of forgetting a campaign, each wrong in 3 ways");
    assert!(points > 30, "{points}");
}

//! Stores whose files hold anything: asked, checked, opened, repaired.

use super::mutate::{Random, mutate};
use meniscus::parameters::{Density, JobId, Model, ObstacleField, Point, Scene, Soft};
use meniscus::results::outline::Outline;
use meniscus::results::trajectory::{Outcome, Samples, Trajectory};
use meniscus::store::{
    CampaignRecord, Format, Message, PlannedPoint, Store, Writer, WriterOptions, check, checkpoint_file, job_states,
    query, repair, status,
};
use std::path::Path;

/// A valid store as its files: names within the folder, and bytes.
pub type Files = Vec<(String, Vec<u8>)>;

/// A folder in memory, where there is one: a million stores are no work for a disk.
pub fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

fn read(dir: &Path) -> Files {
    let mut files = Vec::new();
    for folder in ["", "samples", "checkpoints"] {
        for entry in std::fs::read_dir(dir.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() && path.extension().is_none_or(|extension| extension != "db-shm") {
                let name = path.strip_prefix(dir).unwrap().display().to_string();
                files.push((name, std::fs::read(&path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

fn point() -> Point {
    let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.35), box_size: 50.0 };
    Point::new(Model::Soft(Soft { e_w: 1.0 }), Scene::Obstacles(field))
}

fn trajectory(seed: u64) -> Trajectory {
    let series = || (0..5).map(|row| row as f64 + seed as f64 / 3.0).collect::<Vec<f64>>();
    let samples = Samples {
        t: series(),
        r: series(),
        h: series(),
        y: series(),
        v_g: series(),
        ek_ratio: series(),
        ..Samples::default()
    };
    Trajectory {
        outcome: Outcome::Distance,
        r_end: 1.0,
        t_end: 4.0,
        v_g_mean: Some(0.7),
        ek_ratio_end: 0.5,
        shape_max: None,
        area_error_max: None,
        overlap_max: 0.0,
        energy_rise_max: 0.0,
        ek_ratio_min: 0.1,
        engulfed_t: None,
        refused: 0,
        delta_s: None,
        steps: 1000,
        clog: None,
        arrest: None,
        pinch: None,
        samples,
        outlines: vec![Outline { t: 4.0, x: vec![1.0], y: vec![2.0], loads: Vec::new() }],
    }
}

/// Valid stores: closed and sealed, killed with a log, and of an earlier schema.
pub fn corpus() -> Vec<Files> {
    let dir = tempfile::tempdir().unwrap();
    let point = point();
    let fill = |seeds: std::ops::Range<u64>| {
        let mut store = Store::open(dir.path()).unwrap();
        let planned = [PlannedPoint { point: &point, point_id: point.id(), seeds: 0..6, block: "test" }];
        store.register(&CampaignRecord { name: "any", text: "name = \"any\"" }, &planned).unwrap();
        let writer = Writer::spawn(store, WriterOptions { outcomes: 2, ..WriterOptions::default() }).unwrap();
        for seed in seeds {
            let job = JobId::new(point.id(), seed);
            writer.sender().send(Message::Finished { job, result: Ok(trajectory(seed)), wall_s: 0.1 }).unwrap();
        }
        writer.finish().unwrap()
    };
    drop(fill(0..2));
    let job = JobId::new(point.id(), 5);
    checkpoint_file::write(&dir.path().join("checkpoints"), job, b"a state").unwrap();
    let closed = read(dir.path());
    let open = fill(2..4);
    let killed = read(dir.path());
    assert!(killed.iter().any(|(name, bytes)| name == "store.db-wal" && !bytes.is_empty()));
    drop(open);
    let old = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/store/fixtures/schema-1/store");
    let mut early = vec![("store.db".to_owned(), std::fs::read(old.join("store.db")).unwrap())];
    for file in std::fs::read_dir(old.join("samples")).unwrap() {
        let path = file.unwrap().path();
        early.push((format!("samples/{}", path.file_name().unwrap().display()), std::fs::read(path).unwrap()));
    }
    vec![closed, killed, early]
}

/// One input: a store with one or two files changed, or made of noise; then all that people do with a store.
pub fn run(corpus: &[Files], scratch: &Path, random: &mut Random) {
    let dir = scratch.join("store");
    let _ = std::fs::remove_dir_all(&dir);
    ["samples", "checkpoints"].iter().for_each(|folder| std::fs::create_dir_all(dir.join(folder)).unwrap());
    let mut files = corpus[random.below(corpus.len())].clone();
    for _ in 0..=random.below(2) {
        let chosen = random.below(files.len());
        let bytes = &mut files[chosen].1;
        match random.below(20) {
            0 => {
                let length = random.below(9000);
                *bytes = random.noise(length);
            }
            1 => drop(files.remove(chosen)),
            _ => mutate(bytes, random),
        }
        if files.is_empty() {
            break;
        }
    }
    files.iter().for_each(|(name, bytes)| std::fs::write(dir.join(name), bytes).unwrap());

    // What is wrong is refused in words; the answers are of no interest here.
    let _ = status(&dir);
    let _ = job_states(&dir);
    let _ = query(&dir, "SELECT count(*), sum(r_end) FROM runs", Format::Csv, &mut std::io::sink());
    let _ = query(&dir, "SELECT count(*), sum(v_g), sum(shape) FROM samples", Format::Csv, &mut std::io::sink());
    let by_job = "SELECT seed, max(samples.t) FROM all_runs JOIN samples USING (job_id) GROUP BY 1";
    let _ = query(&dir, by_job, Format::Csv, &mut std::io::sink());
    let _ = check(&dir);
    if random.below(2) == 0 {
        let _ = Store::open(&dir);
    }
    if repair(&dir).is_ok() {
        let left = check(&dir).unwrap().findings;
        assert!(left.is_empty(), "a repair left {left:?}");
        drop(Store::open(&dir).unwrap());
    }
}

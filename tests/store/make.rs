//! Points, trajectories and stores to test with.

use meniscus::parameters::{Deformable, Density, JobId, Model, ObstacleField, Point, Scene, Soft};
use meniscus::results::outline::{LoadRecord, Outline};
use meniscus::results::trajectory::{Clog, Failure, FailureClass, Mechanism, Outcome, Samples, Trajectory};
use meniscus::store::{CampaignRecord, Format, Message, PlannedPoint, Store, Writer, WriterOptions};
use rusqlite::Connection;
use rusqlite::types::FromSql;
use std::path::Path;
use std::time::Duration;

/// A soft particle of stiffness `e_w`.
pub fn soft(e_w: f64) -> Point {
    let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.35), box_size: 500.0 };
    Point::new(Model::Soft(Soft { e_w }), Scene::Obstacles(field))
}

/// A deformable particle of line tension `gamma` in a saturated array.
pub fn ring(gamma: f64) -> Point {
    let mut point = soft(0.0);
    point.model = Model::Deformable(Deformable { delta: 0.012, ..Deformable::of_tension(gamma) });
    if let Scene::Obstacles(field) = &mut point.scene {
        field.density = Density::Saturated;
    }
    point
}

/// A trajectory of `rows` samples whose numbers depend on the job alone; every fourth seed clogs.
pub fn trajectory(point: &Point, seed: u64, rows: usize) -> Trajectory {
    let is_ring = matches!(point.model, Model::Deformable(_));
    let series = |scale: f64| (0..rows).map(|row| scale * (row as f64 + seed as f64 / 3.0)).collect::<Vec<f64>>();
    let ring_series = |scale| if is_ring { series(scale) } else { Vec::new() };
    let samples = Samples {
        t: series(10.0),
        r: series(0.1),
        h: series(0.3),
        y: series(-0.7),
        v_g: series(1.0 / 7.0),
        ek_ratio: series(f64::MIN_POSITIVE / 1e4), // subnormal
        shape: ring_series(1.1),
        area_error: ring_series(1e-17),
    };
    let clogged = seed.is_multiple_of(4);
    let r_end = 1.0 + seed as f64 / 3.0;
    Trajectory {
        outcome: if clogged { Outcome::Clogged } else { Outcome::Distance },
        r_end,
        t_end: 1000.0,
        v_g_mean: (!clogged).then_some(0.7),
        ek_ratio_end: if clogged { 1e-17 } else { 0.5 },
        shape_max: is_ring.then_some(1.3),
        area_error_max: is_ring.then_some(1e-4),
        overlap_max: 2e-3,
        energy_rise_max: 1e-12,
        ek_ratio_min: 1e-18,
        engulfed_t: None,
        refused: 0,
        delta_s: None,
        steps: 1_000_000,
        clog: clogged.then(|| Clog {
            t: 1000.0,
            r: r_end,
            x: 250.0 + r_end,
            y: -0.25,
            ek_ratio: 1e-17,
            shape: is_ring.then_some(1.2),
            contacts: 2,
            mechanism: is_ring.then_some(Mechanism::Wrap),
        }),
        arrest: None,
        pinch: None,
        samples,
        outlines: vec![outline(0.0, seed, is_ring), outline(1000.0, seed, is_ring)],
    }
}

/// A shape whose numbers depend on the seed.
pub fn outline(t: f64, seed: u64, is_ring: bool) -> Outline {
    let number = seed as f64 / 3.0;
    let column = |from: f64| (0..if is_ring { 5 } else { 1 }).map(|i| from + number + 0.1 * f64::from(i)).collect();
    let load = LoadRecord { obstacle: 3, x: number, y: -1.0 / 7.0, fx: -0.1 - number, fy: 1e-300, turn: 0.3 };
    Outline { t, x: column(250.0), y: column(-7.0), loads: vec![load; 2] }
}

/// A failure of the class `class`.
pub fn failure(class: FailureClass) -> Failure {
    Failure {
        class,
        reason: format!("made to be {}", class.name()),
        step: 17,
        outline: Some(Box::new(outline(17.0, 0, true))),
    }
}

/// The message that the run `seed` of `point` ended with `rows` samples.
pub fn finished(point: &Point, seed: u64, rows: usize) -> Message {
    let job = JobId::new(point.id(), seed);
    Message::Finished { job, result: Ok(trajectory(point, seed, rows)), wall_s: 0.5 }
}

/// The message that the run `seed` of `point` failed.
pub fn failed(point: &Point, seed: u64, class: FailureClass) -> Message {
    Message::Finished { job: JobId::new(point.id(), seed), result: Err(failure(class)), wall_s: 0.5 }
}

/// A folder, in memory where that is possible: flushes are what tests of many stores wait for.
pub fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

/// Registers `seeds` runs of each point under the campaign `test`; returns how many were new.
pub fn register(store: &mut Store, points: &[Point], seeds: u64) -> usize {
    let plan: Vec<_> = points
        .iter()
        .map(|point| PlannedPoint { point, point_id: point.id(), seeds: 0..seeds, block: "test" })
        .collect();
    store.register(&CampaignRecord { name: "test", text: "name = \"test\"" }, &plan).unwrap().new_jobs
}

/// Options for tests: commits every `outcomes` outcomes, and patience of a few milliseconds.
pub fn options(outcomes: usize) -> WriterOptions {
    let pauses = vec![Duration::from_millis(50); 3];
    WriterOptions { outcomes, age: Duration::from_millis(50), pauses, ..WriterOptions::default() }
}

/// Opens the store in `dir`, registers `seeds` runs of each point and writes all of them with `rows` samples.
pub fn filled(dir: &Path, points: &[Point], seeds: u64, rows: usize, batch: usize) -> Store {
    let mut store = Store::open(dir).unwrap();
    register(&mut store, points, seeds);
    let writer = Writer::spawn(store, options(batch)).unwrap();
    for point in points {
        (0..seeds).for_each(|seed| writer.sender().send(finished(point, seed, rows)).unwrap());
    }
    writer.finish().unwrap()
}

/// The answer to a query as CSV lines, without the line of names.
pub fn csv(dir: &Path, sql: &str) -> Vec<String> {
    let text = answer(dir, sql, Format::Csv);
    text.lines().skip(1).map(str::to_owned).collect()
}

/// The answer to a query.
pub fn answer(dir: &Path, sql: &str, format: Format) -> String {
    let mut out = Vec::new();
    meniscus::store::query(dir, sql, format, &mut out).unwrap();
    String::from_utf8(out).unwrap()
}

/// One value, straight from the database.
pub fn value<T: FromSql>(dir: &Path, sql: &str) -> T {
    let conn = Connection::open(dir.join("store.db")).unwrap();
    conn.query_row(sql, [], |row| row.get(0)).unwrap()
}

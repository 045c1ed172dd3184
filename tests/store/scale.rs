//! Large stores. The figures are printed, not asserted: `cargo test --release --test store -- --ignored --nocapture`.

use super::make::*;
use meniscus::parameters::Point;
use meniscus::store::{Format, Store, Writer, WriterOptions, job_states, last_run, point_runs, query, status};
use std::path::Path;
use std::time::Instant;

fn timed<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    println!("{what:<55} {:8.3} s", start.elapsed().as_secs_f64());
    result
}

/// Builds a store of `points x seeds` jobs, finishes the first `done` seeds of each point, and asks what users ask.
fn exercise(dir: &Path, points: u64, seeds: u64, done: u64) {
    let points: Vec<Point> = (0..points).map(|index| soft(1.0 + index as f64)).collect();
    let (jobs, finishing) = (points.len() as u64 * seeds, points.len() as u64 * done);
    let mut store = timed("open a new store", || Store::open(dir).unwrap());
    let new = timed(&format!("register {jobs} jobs"), || register(&mut store, &points, seeds));
    assert_eq!(new as u64, jobs);
    let again = timed("register them again", || register(&mut store, &points, seeds));
    assert_eq!(again, 0);
    let runs: Vec<_> = points.iter().flat_map(|p| (0..done).map(move |seed| finished(p, seed, 2))).collect();
    let store = timed(&format!("write {finishing} outcomes of 2 samples"), || {
        let writer = Writer::spawn(store, WriterOptions::default()).unwrap();
        let sender = writer.sender();
        for run in runs {
            let meniscus::store::Message::Finished { job, .. } = &run else { unreachable!() };
            sender.send(meniscus::store::Message::Started(*job)).unwrap();
            sender.send(run).unwrap();
        }
        writer.finish().unwrap()
    });
    let fits = timed("read all finished runs for fits", || point_runs(store.connection()).unwrap());
    assert_eq!(fits.iter().map(|point| point.runs.len() as u64).sum::<u64>(), finishing);
    timed("close", || drop(store));
    timed("open again", || drop(Store::open(dir).unwrap()));
    let states = timed("job_states", || job_states(dir).unwrap());
    assert!(states.is_sorted_by_key(|(id, _)| *id));
    assert_eq!(states.len() as u64, jobs);
    let status = timed("status", || status(dir).unwrap());
    timed("last_run", || last_run(dir).unwrap());
    assert_eq!((status.total.jobs(), status.total.done), (jobs, finishing));
    assert_eq!(status.clogs, points.len() as u64 * done.div_ceil(4));
    let count = timed("count the done rows of runs", || csv(dir, "SELECT count(*) FROM runs WHERE state = 'done'"));
    assert_eq!(count, [finishing.to_string()]);
    let joined = timed("runs JOIN samples, all of them", || {
        csv(dir, "SELECT count(*), sum(samples.v_g) IS NOT NULL FROM runs JOIN samples USING (job_id)")
    });
    assert_eq!(joined, [format!("{},1", 2 * finishing)]);
    timed("runs JOIN samples, one point", || {
        let sql = "SELECT * FROM runs JOIN samples USING (job_id) WHERE runs.e_w = 3";
        query(dir, sql, Format::Csv, &mut std::io::sink()).unwrap();
    });
}

#[test]
fn a_store_of_many_jobs_answers_the_same_as_a_small_one() {
    let dir = tempfile::tempdir().unwrap();
    exercise(dir.path(), 20, 100, 30);
}

#[test]
#[ignore = "a minute of work, for its figures"]
fn figures_of_a_million_jobs() {
    let dir = tempfile::tempdir().unwrap();
    exercise(dir.path(), 1000, 1000, 100);
    for entry in std::fs::read_dir(dir.path()).unwrap() {
        let entry = entry.unwrap();
        println!("{:?}: {} bytes", entry.file_name(), entry.metadata().unwrap().len());
    }
}

/// A long run of a ring that flows unevenly, with a recorded sample every 10 t0.
fn long_run(seed: u64) -> meniscus::results::trajectory::Trajectory {
    let mut run = trajectory(&ring(1.0), seed, 20_000);
    let samples = &mut run.samples;
    let mut r = 0.0;
    for row in 0..samples.t.len() {
        let t = 10.0 * row as f64;
        let wave = libm::sin(t / 170.0 + seed as f64) + 0.5 * libm::sin(t / 61.0);
        let v = 0.7 + 0.2 * wave;
        r += 0.3 * v;
        (samples.t[row], samples.r[row], samples.h[row], samples.y[row]) = (t, r, 250.0 + r, 250.0 + 0.3 * wave);
        (samples.v_g[row], samples.ek_ratio[row]) = (v, v * v);
        (samples.shape[row], samples.area_error[row]) = (1.05 + 0.02 * wave, 1e-5 * wave);
    }
    run
}

#[test]
#[ignore = "for its figures"]
fn figures_of_long_series() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[ring(1.0)], 200);
    let runs: Vec<_> = (0..200).map(long_run).collect();
    let rows: usize = runs.iter().map(|run| run.samples.len()).sum();
    timed(&format!("write 200 outcomes, {rows} samples"), || {
        let writer = Writer::spawn(store, WriterOptions::default()).unwrap();
        for (seed, run) in runs.into_iter().enumerate() {
            let job = meniscus::parameters::JobId::new(ring(1.0).id(), seed as u64);
            writer.sender().send(meniscus::store::Message::Finished { job, result: Ok(run), wall_s: 1.0 }).unwrap();
        }
        writer.finish().unwrap()
    });
    let bytes: f64 = csv(dir.path(), "SELECT sum(bytes) FROM sample_files")[0].parse().unwrap();
    println!(
        "{:.1} bytes a row of 8 numbers, in {} files",
        bytes / rows as f64,
        std::fs::read_dir(dir.path().join("samples")).unwrap().count()
    );
    timed("read one job of 20000 samples", || {
        csv(dir.path(), "SELECT max(r) FROM samples WHERE job_id IN (SELECT job_id FROM runs WHERE seed = 77)")
    });
    timed("read all, one column", || csv(dir.path(), "SELECT max(r) FROM samples"));
    timed("read all, by run", || {
        csv(dir.path(), "SELECT seed, max(samples.r), max(shape) FROM runs JOIN samples USING (job_id) GROUP BY seed")
    });
}

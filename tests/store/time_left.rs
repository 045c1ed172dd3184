//! How long the rest takes: by what jobs cost, not by their number.

use super::make::*;
use meniscus::execute::Progress;
use meniscus::parameters::{Model, Point};
use meniscus::store::{CampaignRecord, PlannedPoint, Provenance, Store, StoreError, Writer, last_run};
use std::path::Path;
use std::time::{Duration, Instant};

/// As `status` has it, with another notion of cost.
fn time_left(dir: &Path, expected_s: impl Fn(&Point) -> f64) -> Result<Option<Duration>, StoreError> {
    Ok(last_run(dir)?.and_then(|run| Progress::seen(&run.points, expected_s).time_left(run.elapsed)))
}

fn stiffness(point: &Point) -> f64 {
    match &point.model {
        Model::Soft(soft) => soft.e_w,
        Model::Deformable(_) => unreachable!("no rings here"),
    }
}

#[test]
fn the_rest_takes_as_long_compared_with_its_cost_as_what_is_done() {
    let dir = scratch();
    assert_eq!(time_left(dir.path(), stiffness).unwrap(), None, "no store");
    let (dear, cheap) = (soft(90.0), soft(1.0));
    let mut store = Store::open(dir.path()).unwrap();
    let plan = [&dear, &cheap].map(|point| PlannedPoint { point, point_id: point.id(), seeds: 0..10, block: "test" });
    let campaign = store.register(&CampaignRecord { name: "test", text: "" }, &plan).unwrap().campaign;
    let run = Provenance { program_version: "0.1", git_commit: "c", rustc: "r", cpu_features: "f", campaign };
    let begin = Instant::now();
    store.begin_run(&run).unwrap();
    assert_eq!(time_left(dir.path(), stiffness).unwrap(), None, "nothing has ended");

    let writer = Writer::spawn(store, options(10)).unwrap();
    (0..10).for_each(|seed| writer.sender().send(finished(&dear, seed, 2)).unwrap());
    let mut store = writer.finish().unwrap();
    std::thread::sleep(Duration::from_millis(20));
    let first = time_left(dir.path(), stiffness).unwrap().unwrap();
    let alike = time_left(dir.path(), |_| 1.0).unwrap().unwrap();
    assert!(
        first >= Duration::from_millis(20) / 90 && first <= begin.elapsed() / 90,
        "a ninetieth of {:?}",
        begin.elapsed()
    );
    assert!(alike >= 89 * first, "as many jobs are left as have ended");

    store.begin_run(&run).unwrap();
    assert_eq!(time_left(dir.path(), stiffness).unwrap(), None, "this run has ended none");
}

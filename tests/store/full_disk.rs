//! What a full disk does to a run: outcomes wait for room, or are computed again, and nothing is lost.
//!
//! A unit test of the crate, as `every_fault.rs` is: here too the disk is played by what stands behind its operations.

use crate::store::disk::faults::{Fault, arm, disarm};
use crate::store::every_fault::{TinyCampaign, answer, scratch, tiny_campaign};
use crate::store::*;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// A new store with the jobs of the campaign, all pending.
fn registered(tiny: &TinyCampaign, dir: &Path) -> Store {
    let mut store = Store::open(dir).unwrap();
    let points: Vec<_> = PlannedPoint::all(&tiny.campaign).collect();
    store.register(&CampaignRecord { name: "tiny", text: &tiny.campaign.text }, &points).unwrap();
    store
}

/// A writer that commits each outcome by itself.
fn options(pauses: &[u64]) -> WriterOptions {
    let pauses = pauses.iter().map(|&ms| Duration::from_millis(ms)).collect();
    WriterOptions { outcomes: 1, pauses, ..WriterOptions::default() }
}

fn send(tiny: &TinyCampaign, writer: &Writer, number: usize) {
    let (job, result) = tiny.results[number].clone();
    writer.sender().send(Message::Finished { job, result, wall_s: 0.5 }).unwrap();
}

fn done(dir: &Path) -> String {
    answer(dir, "SELECT count(*) FROM runs WHERE state = 'done'").replace("count(*)\n", "")
}

#[test]
fn outcomes_wait_for_room_on_a_full_disk_however_long_it_takes() {
    let (folder, tiny) = (scratch(), tiny_campaign());
    let dir = folder.path();
    let store = registered(&tiny, dir);
    arm(dir, 1, Fault::Full, Path::new(""));
    let writer = Writer::spawn(store, options(&[10])).unwrap();
    (0..4).for_each(|number| send(&tiny, &writer, number));
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(done(dir), "0\n");
    disarm(dir);
    writer.finish().unwrap();
    assert_eq!(done(dir), "4\n");
    assert_ne!(answer(dir, "SELECT count(*) FROM samples"), "count(*)\n0\n");
}

#[test]
fn a_run_that_is_to_end_does_not_wait_for_a_full_disk_and_keeps_what_was_committed() {
    let (folder, tiny) = (scratch(), tiny_campaign());
    let dir = folder.path();
    let store = registered(&tiny, dir);
    let options = options(&[10, 20, 30, 40]);
    let interrupted = options.hurry.interrupted.clone();
    let writer = Writer::spawn(store, options).unwrap();
    send(&tiny, &writer, 0);
    while status(dir).unwrap().total.done == 0 {
        std::thread::sleep(Duration::from_millis(5));
    }
    arm(dir, 1, Fault::Full, Path::new(""));
    send(&tiny, &writer, 1);
    interrupted.store(true, Ordering::Relaxed);
    let gave_up = writer.finish().unwrap_err();
    assert!(matches!(gave_up, StoreError::GaveUp { unsaved: 1, .. }), "{gave_up}");
    disarm(dir);
    drop(Store::open(dir).unwrap());
    assert_eq!(answer(dir, "SELECT state, count(*) FROM runs GROUP BY 1"), "state,count(*)\ndone,1\npending,5\n");
}

//! Compares growth with darts that are thrown one by one, and with growth in other orders.

use super::*;
use crate::parameters::{Density, ObstacleField};
use crate::physics::walls::arrays::board::{Stream, place};
use std::sync::atomic::AtomicBool;

/// Side of a box of two by two tiles, the last of which reach beyond it.
const BOX: f64 = 23.0;

fn board(seed: u64) -> Board {
    Board::new(&ObstacleField { w_ob: 0.5, sigma_ob: 0.5, density: Density::Saturated, box_size: BOX }, seed)
}

/// Squared distance of two places in the periodic box.
fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    let [dx, dy] = [0, 1].map(|k| (a[k] - b[k]).abs()).map(|d| d.min(BOX - d));
    dx * dx + dy * dy
}

/// Number of discs, and of pairs of them closer than 1.1 spacings.
fn count(discs: &[[f64; 2]]) -> [f64; 2] {
    let close = |i: usize| discs[..i].iter().filter(|&&other| apart(discs[i], other) < 1.21).count();
    [discs.len() as f64, (0..discs.len()).map(close).sum::<usize>() as f64]
}

/// Nobody stops these.
static NEVER: AtomicBool = AtomicBool::new(false);

fn new_discs_until(time: f64, mut growth: Growth) -> Vec<[f64; 2]> {
    growth.judge_until(time, &NEVER);
    growth.new_discs().filter(|cell| cell.time <= time).map(|cell| cell.at).collect()
}

fn grown_until(time: f64, seed: u64) -> Vec<[f64; 2]> {
    new_discs_until(time, Growth::new(board(seed)))
}

fn thrown_until(time: f64, seed: u64) -> Vec<[f64; 2]> {
    let board = board(seed);
    let (mut random, mut discs) = (board.stream(Stream::Box), Vec::new());
    for _ in 0..(time * (board.cells * board.cells) as f64) as usize {
        let at = place(&mut random, [0.0; 2], BOX);
        if discs.iter().all(|&disc| apart(disc, at) > 1.0) {
            discs.push(at);
        }
    }
    discs
}

#[test]
fn at_any_time_there_are_the_discs_that_darts_thrown_one_by_one_leave() {
    const SEEDS: u64 = 40;
    for time in [0.3, 1.0, 3.0, 30.0] {
        let [grown, thrown] = [grown_until, thrown_until]
            .map(|until| (0..SEEDS).map(|seed| count(&until(time, seed))).collect::<Vec<_>>());
        for what in 0..2 {
            let [(mean, variance), (expected, _)] = [&grown, &thrown].map(|counts| {
                let mean = counts.iter().map(|count| count[what]).sum::<f64>() / SEEDS as f64;
                (mean, counts.iter().map(|count| (count[what] - mean).powi(2)).sum::<f64>() / SEEDS as f64)
            });
            let error = (2.0 * variance / SEEDS as f64).sqrt();
            assert!((mean - expected).abs() < 3.0 * error, "time {time}, {what}: {mean}, not {expected} +- {error}");
        }
    }
}

#[test]
fn the_next_discs_stand_between_those_given_earliest_first() {
    let given = thrown_until(1.0, 1);
    let early = new_discs_until(0.1, Growth::onto(board(1), &given));
    let few = Growth::onto(board(1), &given).grow(early.len(), &NEVER).unwrap();
    let all = Growth::onto(board(1), &given).grow(usize::MAX, &NEVER).unwrap();
    assert!(early.len() > 5 && all.len() > 3 * early.len());
    assert_eq!(few, all[..early.len()]);
    assert!(early.iter().all(|disc| few.contains(disc)));
    let discs: Vec<_> = given.iter().chain(&all).copied().collect();
    for (i, &disc) in discs.iter().enumerate() {
        assert!(discs[..i].iter().all(|&other| apart(disc, other) > 1.0));
    }
    // Saturated: 0.547 of the area.
    assert!((discs.len() as f64 / (0.547 * 4.0 / std::f64::consts::PI * BOX * BOX) - 1.0).abs() < 0.03);
}

#[test]
fn a_tile_settles_alike_whatever_was_judged_before() {
    let tiles = |first: &[usize]| {
        let mut growth = Growth::new(board(4));
        growth.judge_until(0.5 * first.len() as f64, &NEVER);
        first.iter().for_each(|&tile| drop(growth.settle(tile)));
        [0, 1, 2, 3].map(|tile| format!("{:?}", growth.settle(tile)))
    };
    assert_eq!(tiles(&[]), tiles(&[3]));
    assert_eq!(tiles(&[]), tiles(&[2, 0, 1]));
}

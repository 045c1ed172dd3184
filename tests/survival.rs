//! What ends a run, where it begins, and what the box repeats: decay lengths of droplets whose truth is known.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are tests too")]

#[path = "common/draws.rs"]
mod draws;

use draws::Draws;
use meniscus::parameters::{Density, Model, ObstacleField, Point, Scene, Soft};
use meniscus::report::tables::decay_lengths;
use meniscus::results::fits::{FinishedRun, PointRuns};
use meniscus::results::trajectory::Outcome;
use meniscus::study::compare::lambda_ratio;
use meniscus::study::fits::fit_all;
use meniscus::study::survival::decay_length::{Lifetime, Lifetimes};
use meniscus::study::survival::{kaplan_meier::steps, lambda_fit, survival_fit, weibull::shape};
use rayon::prelude::*;
use std::process::Command;

fn run(seed: u64, outcome: Outcome, r_end: f64) -> FinishedRun {
    FinishedRun { seed, outcome, r_end, t_end: 1.0, v_g_mean: Some(0.7), mechanism: None, arrested: None }
}

fn point(box_size: f64, runs: Vec<FinishedRun>) -> PointRuns {
    let array = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.7), box_size };
    let point = Point::new(Model::Soft(Soft { e_w: 10.0 }), Scene::Obstacles(array));
    PointRuns { point_id: point.id(), point, runs }
}

#[test]
fn a_box_that_droplets_cross_several_times_does_not_make_lambda_larger() {
    // A droplet that crosses a box of 30 once meets the same obstacles for ever.
    let mut random = Draws::seeded(1);
    let runs = |seed| match random.exponential(190.0) {
        r if r <= 30.0 => run(seed, Outcome::Clogged, r),
        _ => run(seed, Outcome::Distance, 240.0),
    };
    let runs: Vec<_> = (0..400).map(runs).collect();
    let fit = lambda_fit(&point(30.0, runs.clone()), 0.0);
    assert!(fit.lambda_low < Some(190.0) && fit.lambda_high > Some(190.0), "{fit:?}");
    assert_eq!(fit.beyond_box, 400 - fit.clogs);
    let endless = lambda_fit(&point(5000.0, runs.clone()), 0.0);
    assert!(endless.lambda_low > Some(1000.0), "what the box does if it is not looked at: {endless:?}");
    let text = decay_lengths(&fit_all(&[point(30.0, runs)], 0.0));
    assert!(text.contains("went further than one side of the periodic box"), "{text}");
}

#[test]
fn a_clog_beyond_the_box_is_none() {
    let runs = vec![run(0, Outcome::Clogged, 10.0), run(1, Outcome::Clogged, 45.0)];
    let fit = lambda_fit(&point(30.0, runs), 0.0);
    assert_eq!((fit.clogs, fit.beyond_box, fit.lambda), (1, 1, Some(40.0)));
}

#[test]
fn where_time_cuts_runs_off_lambda_is_told_for_both_cases_and_the_truth_lies_between() {
    // Droplets slow down over the last tenth of their way, so time cuts off those that are about to clog.
    let mut random = Draws::seeded(2);
    let runs = |seed| match random.exponential(51.0) {
        r if random.uniform() < 0.3 => run(seed, Outcome::TimeLimit, 0.95 * r),
        r if r > 120.0 => run(seed, Outcome::Distance, 120.0),
        r => run(seed, Outcome::Clogged, r),
    };
    let cut = point(500.0, (0..400).map(runs).collect());
    let fit = lambda_fit(&cut, 0.0);
    assert_eq!(fit.clogs + fit.by_time + fit.by_distance, 400);
    assert!(fit.lambda > Some(58.0) && fit.lambda_low > Some(51.0), "censoring alone excludes the truth: {fit:?}");
    assert!(fit.lambda_if_stuck < Some(54.0), "{fit:?}");
    let text = decay_lengths(&fit_all(&[cut], 0.0));
    assert!(text.contains("if stuck") && text.contains("t_max cut off while they moved"), "{text}");
    let few = point(500.0, (0..40).map(|seed| run(seed, Outcome::Clogged, 1.0 + seed as f64)).collect());
    assert!(!decay_lengths(&fit_all(&[few], 0.0)).contains("if stuck"), "no column where time cut nothing off");
}

#[test]
fn what_lies_before_a_displacement_can_be_left_out() {
    // Nothing clogs over the first sigma: droplets start in a void.
    let mut random = Draws::seeded(3);
    let clogs = |seed| run(seed, Outcome::Clogged, 1.0 + random.exponential(3.0));
    let void = point(500.0, (0..4000).map(clogs).collect());
    let (whole, beyond) = (lambda_fit(&void, 0.0), lambda_fit(&void, 1.0));
    assert!(whole.lambda > Some(3.8) && beyond.lambda < Some(3.2) && beyond.lambda > Some(2.8), "{whole:?} {beyond:?}");
    assert!(whole.p_exponential < Some(1e-3) && beyond.p_exponential > Some(0.01), "{whole:?} {beyond:?}");
    assert!(beyond.weibull_low < Some(1.0) && beyond.weibull_high > Some(1.0), "{beyond:?}");
    assert_eq!((beyond.runs, beyond.r_from), (4000, 1.0));
    let curve = survival_fit(&void, 1.0).1;
    assert!((curve[1999].survival - 0.5).abs() < 1e-9 && (curve[1999].r - 3.0 * libm::log(2.0)).abs() < 0.2);
    assert!(decay_lengths(&fit_all(&[void], 1.0)).starts_with("Decay lengths beyond 1 sigma, SP"));
    let early = point(500.0, vec![run(0, Outcome::Clogged, 0.5), run(1, Outcome::Clogged, 3.0)]);
    let fit = lambda_fit(&early, 1.0);
    assert_eq!((fit.runs, fit.clogs, fit.lambda), (1, 1, Some(2.0)), "who did not get there does not count");
}

/// The share of sets in which `holds`, of those that have an answer.
fn share(sets: u64, holds: impl Fn(&mut Draws) -> Option<bool> + Sync) -> f64 {
    let answers: Vec<bool> = (0..sets).into_par_iter().filter_map(|set| holds(&mut Draws::seeded(set))).collect();
    let share = answers.iter().filter(|held| **held).count() as f64 / answers.len() as f64;
    assert!((0.91..0.995).contains(&share), "{share} of {} answers", answers.len());
    share
}

/// Coverage of the interval of lambda = 24 from `n` runs of which `censored` are cut off, those before `from` left out.
fn covers_lambda(sets: u64, n: u64, censored: f64, from: f64) -> f64 {
    let limit = from - 24.0 * libm::log(censored.max(1e-12));
    share(sets, |random| {
        let runs = |seed| match random.exponential(24.0) {
            r if r > limit => run(seed, Outcome::Distance, limit),
            r => run(seed, Outcome::Clogged, r),
        };
        let fit = lambda_fit(&point(5000.0, (0..n).map(runs).collect()), from);
        Some(fit.lambda_low? <= 24.0 && fit.lambda_high.is_none_or(|high| high >= 24.0))
    })
}

#[test]
fn the_interval_beyond_a_displacement_covers_what_it_promises() {
    for censored in [0.0, 0.5] {
        let coverage = covers_lambda(4000, 50, censored, 2.4);
        assert!((0.93..=0.97).contains(&coverage), "{censored}: {coverage}");
    }
}

#[test]
#[ignore = "many sets take minutes; `cargo test --release --test survival -- --ignored --nocapture` prints the table"]
fn coverage_of_every_interval() {
    println!("| interval | n | coverage |\n|---|---|---|");
    for from in [0.0, 2.4] {
        for (n, censored) in [(10, 0.0), (10, 0.5), (10, 0.9), (50, 0.0), (50, 0.5), (50, 0.9)] {
            let name = if from > 0.0 { "lambda beyond 0.1 lambda" } else { "lambda" };
            println!("| {name}, {censored} cut off | {n} | {:.3} |", covers_lambda(40_000, n, censored, from));
        }
    }
    for (n, censored) in [(10, 0.0), (50, 0.0), (50, 0.5), (50, 0.9)] {
        let limit = -libm::log(f64::max(censored, 1e-12));
        let coverage = share(10_000, |random| {
            let life = |r: f64| Lifetime { r: r.min(limit), clogged: r <= limit };
            let found = shape(&Lifetimes::new((0..n).map(|_| life(random.exponential(1.0))).collect()))?;
            Some(found.low <= 1.0 && found.high >= 1.0)
        });
        println!("| Weibull's k, {censored} cut off | {n} | {coverage:.3} |");
    }
    for n in [10, 50] {
        let coverage = share(40_000, |random| {
            let curve = steps(&Lifetimes::new(
                (0..n).map(|_| Lifetime { r: random.exponential(1.0), clogged: true }).collect(),
            ));
            let [low, high] = curve.iter().rfind(|step| step.r <= libm::log(2.0))?.band()?;
            Some(low <= 0.5 && high >= 0.5)
        });
        println!("| P(r) at its half | {n} | {coverage:.3} |");
    }
    for n in [20, 30, 50] {
        let coverage = share(2_000, |random| {
            let mut both = [Vec::new(), Vec::new()];
            for seed in 0..n {
                let common = random.exponential(1.0);
                for (runs, lambda) in both.iter_mut().zip([24.0, 18.0]) {
                    let r = lambda * (0.7 * common + 0.3 * random.exponential(1.0));
                    runs.push(if r > 40.0 {
                        run(seed, Outcome::Distance, 40.0)
                    } else {
                        run(seed, Outcome::Clogged, r)
                    });
                }
            }
            let [a, b] = both.map(|runs| point(5000.0, runs));
            // The truth with these limits, from many seeds.
            let found = lambda_ratio(&a, &b, 0.0)?;
            Some(found.low <= TRUE_RATIO && found.high >= TRUE_RATIO)
        });
        println!("| ratio of lambdas over common seeds | {n} | {coverage:.3} |");
    }
}

/// S'/d' over S/d of those pairs, from 4e7 seeds.
const TRUE_RATIO: f64 = 0.7272;

#[test]
fn the_command_compares_and_names_what_there_is_to_compare() {
    let dir = tempfile::tempdir().unwrap();
    let meniscus = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_meniscus")).args(arguments).current_dir(dir.path()).output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8(said).unwrap())
    };
    let campaign = "name = \"two\"\nmodel = \"SP\"\nscene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\ndensity = 0.7\n\
                    box_size = 40.0\nruns_per_point = 40\nfit_from = 0.1\ngrid = { e_w = [1.0, 30.0] }\n\
                    limits = { t_max = 2e3, distance = 20.0 }\n";
    std::fs::write(dir.path().join("two.toml"), campaign).unwrap();
    let (code, said) = meniscus(&["run", "two.toml"]);
    assert!(code == Some(0) && said.contains("Decay lengths beyond 0.1 sigma"), "{said}");
    let (code, said) = meniscus(&["compare", "--over", "e_w", "--format", "csv"]);
    let row = said.lines().nth(1).unwrap_or_default();
    assert!(code == Some(0) && row.contains(",e_w,1.0,30.0,40,"), "{said}");
    let (code, said) = meniscus(&["compare", "--over", "e_w", "--from", "0.2", "--values", "1", "30"]);
    assert!(code == Some(0) && said.contains("1 -> 30") && said.contains("beyond 0.2 sigma"), "{said}");
    let (code, said) = meniscus(&["compare", "--over", "e_w", "--values", "1", "31"]);
    assert!(code == Some(1) && said.contains("no two points have these values of e_w; there are: 1, 30"), "{said}");
    let (code, said) = meniscus(&["compare", "--over", "w_ob"]);
    assert!(code == Some(1) && said.contains("differ in w_ob alone; they do in e_w"), "{said}");
    let (code, said) = meniscus(&["compare", "--over", "gama"]);
    assert!(code == Some(2) && said.contains("meniscus keys"), "{said}");
    let (code, said) = meniscus(&["fit", "--from", "50"]);
    assert!(code == Some(0) && said.contains("give a smaller displacement"), "{said}");
}

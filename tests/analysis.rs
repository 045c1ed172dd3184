//! Laws of the estimators on synthetic runs of known lambda, and what the printed tables say.

#[path = "common/draws.rs"]
mod draws;

use draws::Draws;
use meniscus::parameters::*;
use meniscus::report::tables::{decay_lengths, mean_speeds};
use meniscus::results::fits::{FinishedRun, LambdaFit, PointRuns};
use meniscus::results::trajectory::Outcome;
use meniscus::study::fits::fit_all;
use meniscus::study::speed::speed_average;
use meniscus::study::survival::decay_length::{DecayLength, Lifetime, Lifetimes, maximum_likelihood};
use meniscus::study::survival::goodness::p_exponential;
use meniscus::study::survival::lambda_fit;
use rayon::prelude::*;

impl Draws {
    fn normal(&mut self) -> f64 {
        let angle = std::f64::consts::TAU * self.uniform();
        self.exponential(2.0).sqrt() * libm::cos(angle)
    }

    /// A droplet that would clog after `r` but is cut off at `limit`.
    fn life(r: f64, limit: f64) -> Lifetime {
        Lifetime { r: r.min(limit), clogged: r <= limit }
    }
}

fn ring(gamma: f64) -> Model {
    Model::Deformable(Deformable::of_tension(gamma))
}

fn point_runs(model: Model, runs: Vec<FinishedRun>) -> PointRuns {
    let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.35), box_size: 500.0 };
    let mut point = Point::new(model, Scene::Obstacles(field));
    point.limits.distance = Some(60.0);
    PointRuns { point_id: point.id(), point, runs }
}

/// `n` runs of decay length `lambda`, ended at 60 sigma, those that flow at a speed near 0.7 V_t.
fn synthetic(gamma: f64, lambda: f64, n: u64) -> PointRuns {
    let mut draws = Draws::seeded(gamma.to_bits());
    let run = |seed| {
        let Lifetime { r, clogged } = Draws::life(draws.exponential(lambda), 60.0);
        let outcome = if clogged { Outcome::Clogged } else { Outcome::Distance };
        FinishedRun {
            seed,
            outcome,
            r_end: r,
            t_end: r / 0.02,
            v_g_mean: Some(0.7 + 0.03 * draws.normal()),
            mechanism: None,
            arrested: None,
        }
    };
    point_runs(ring(gamma), (0..n).map(run).collect())
}

/// All numbers of a decay-length fit, for comparison.
fn numbers(fit: &LambdaFit) -> [Option<f64>; 5] {
    [fit.lambda, fit.lambda_low, fit.lambda_high, fit.lambda_least_squares, fit.p_exponential]
}

#[test]
fn a_95_percent_interval_of_lambda_holds_the_truth_in_93_to_97_percent() {
    // Runs and the chance of each to clog before it is cut off: about 5, 20 and 50 clogs.
    for (n, chance) in [(50, 0.1), (50, 0.4), (100, 0.5), (5, 1.0)] {
        let mut draws = Draws::seeded(n);
        let limit = -24.0 * libm::log(1.0 - chance);
        let repetitions = 4000;
        let mut held = 0;
        for _ in 0..repetitions {
            let lives = (0..n).map(|_| Draws::life(draws.exponential(24.0), limit)).collect();
            held += u32::from(match maximum_likelihood(&Lifetimes::new(lives)) {
                DecayLength::Measured { low, high, .. } => low <= 24.0 && 24.0 <= high,
                DecayLength::Above(low) => low <= 24.0,
                DecayLength::Unknown => false,
            });
        }
        let coverage = f64::from(held) / f64::from(repetitions);
        println!("{n} runs, {chance} clog: coverage {coverage}");
        assert!((0.93..=0.97).contains(&coverage), "{n} runs of which {chance} clog: {coverage}");
    }
}

#[test]
fn the_bound_without_clogs_is_wrong_in_5_percent_of_the_cases_at_worst() {
    // 20 runs of 60 sigma: a lambda of exactly the bound gives no clog in one case of twenty.
    let truth = 20.0 * 60.0 / -libm::log(0.05);
    let mut draws = Draws::seeded(5);
    let mut unclogged = 0;
    for _ in 0..10_000 {
        let lives = (0..20).map(|_| Draws::life(draws.exponential(truth), 60.0)).collect();
        if let DecayLength::Above(bound) = maximum_likelihood(&Lifetimes::new(lives)) {
            assert!((bound / truth - 1.0).abs() < 1e-12);
            unclogged += 1;
        }
    }
    assert!((440..=560).contains(&unclogged), "{unclogged}");
}

/// Share of 10 000 sets of lives with p below 0.05, below 0.25, below 0.5.
fn shares_of_small_p(n: usize, life: impl Fn(&mut Draws) -> Lifetime + Sync) -> [f64; 3] {
    let p_of = |seed: u64| {
        let mut draws = Draws::seeded(seed);
        p_exponential(&Lifetimes::new((0..n).map(|_| life(&mut draws)).collect()))
    };
    let all: Vec<f64> = (0..10_000).into_par_iter().filter_map(p_of).collect();
    [0.05, 0.25, 0.5].map(|limit| all.iter().filter(|&&p| p <= limit).count() as f64 / all.len() as f64)
}

#[test]
fn p_is_uniform_when_survival_is_exponential() {
    // Three standard errors of a share of 10 000, and a little for the small-n series.
    let uniform = |name: &str, [a, b, c]: [f64; 3]| {
        println!("{name}: p <= 0.05 in {a:.3}, <= 0.25 in {b:.3}, <= 0.5 in {c:.3}");
        let far = [(a - 0.05) / 0.007, (b - 0.25) / 0.02, (c - 0.5) / 0.03];
        assert!(far.iter().all(|x| x.abs() < 1.0), "{name}: {a} {b} {c}");
    };
    uniform("all clog", shares_of_small_p(30, |d| Draws::life(d.exponential(1.0), 1e9)));
    uniform("only six runs", shares_of_small_p(6, |d| Draws::life(d.exponential(1.0), 1e9)));
    uniform("cut off at a distance", shares_of_small_p(30, |d| Draws::life(d.exponential(1.0), 1.0)));
    uniform("one in five clogs", shares_of_small_p(50, |d| Draws::life(d.exponential(1.0), 0.223)));
    let anywhere = |d: &mut Draws| Draws::life(d.exponential(1.0), 0.3 + 1.4 * d.uniform());
    uniform("cut off anywhere", shares_of_small_p(30, anywhere));
}

#[test]
fn p_is_small_when_survival_is_not_exponential() {
    // Weibull of shape 2 (ageing) and 1/2 (the weak clog first), and of shape 2 with 37% cut off.
    let [ageing, ..] = shares_of_small_p(30, |d| Draws::life(d.exponential(1.0).sqrt(), 1e9));
    let [weak_first, ..] = shares_of_small_p(30, |d| Draws::life(d.exponential(1.0).powi(2), 1e9));
    let [cut_off, ..] = shares_of_small_p(50, |d| Draws::life(d.exponential(1.0).sqrt(), 1.0));
    println!("power: {ageing:.3} {weak_first:.3} {cut_off:.3}");
    assert!(ageing > 0.95 && weak_first > 0.95 && cut_off > 0.9, "{ageing} {weak_first} {cut_off}");
}

#[test]
fn lengths_in_another_unit_give_the_same_fit_in_that_unit() {
    let one = synthetic(1.09, 24.0, 40);
    for unit in [1e-3, 7.0, 4096.0] {
        let mut other = one.clone();
        other.runs.iter_mut().for_each(|run| run.r_end *= unit);
        other.point.limits.distance = Some(60.0 * unit);
        if let Scene::Obstacles(array) = &mut other.point.scene {
            array.box_size *= unit;
        }
        let (mut expected, found) = (numbers(&lambda_fit(&one, 0.0)), numbers(&lambda_fit(&other, 0.0)));
        expected[..4].iter_mut().flatten().for_each(|length| *length *= unit);
        for (a, b) in expected.iter().zip(found) {
            assert!((a.unwrap() / b.unwrap() - 1.0).abs() < 1e-6, "{expected:?} {found:?}");
        }
    }
}

#[test]
fn the_order_of_the_runs_and_the_threads_change_no_bit() {
    let one = synthetic(1.09, 24.0, 40);
    let mut other = one.clone();
    other.runs.reverse();
    other.runs.swap(3, 17);
    let points = [one, other];
    let fits = fit_all(&points, 0.0);
    assert_eq!(fits[0].lambda, fits[1].lambda);
    assert_eq!(fits[0].speed, fits[1].speed);
    assert_eq!((fits[0].lambda, fits[0].speed), (lambda_fit(&points[0], 0.0), speed_average(&points[0])));
}

#[test]
fn the_interval_of_a_mean_speed_holds_the_truth() {
    // Ten runs; skewed downwards, as speeds below V_t are. Three standard errors of 2000 are 1.5%.
    let repetitions = 2000_u32;
    let coverage = |speed: fn(&mut Draws) -> f64, truth: f64| {
        let held = |seed: u32| {
            let mut draws = Draws::seeded(u64::from(seed));
            let run = |seed| FinishedRun {
                seed,
                outcome: Outcome::TimeLimit,
                r_end: 60.0,
                t_end: 1.0,
                v_g_mean: Some(speed(&mut draws)),
                mechanism: None,
                arrested: None,
            };
            let average = speed_average(&point_runs(ring(1.0), (0..10).map(run).collect()));
            average.v_g_low.unwrap() <= truth && truth <= average.v_g_high.unwrap()
        };
        let held = (0..repetitions).into_par_iter().filter(|&seed| held(seed)).count();
        held as f64 / f64::from(repetitions)
    };
    let normal = coverage(|d| 0.7 + 0.05 * d.normal(), 0.7);
    let skewed = coverage(|d| 1.0 - 0.2 * libm::exp(0.5 * d.normal()), 1.0 - 0.2 * libm::exp(0.125));
    println!("ten speeds: normal {normal}, skewed {skewed}");
    assert!((0.93..=0.97).contains(&normal) && (0.92..=0.97).contains(&skewed), "{normal} {skewed}");
}

#[test]
fn only_runs_that_flowed_are_averaged_and_ca_follows() {
    let run = |outcome, v_g_mean| FinishedRun {
        seed: 0,
        outcome,
        r_end: 60.0,
        t_end: 1.0,
        v_g_mean,
        mechanism: None,
        arrested: None,
    };
    let runs = vec![
        run(Outcome::TimeLimit, Some(0.6)),
        run(Outcome::Distance, Some(0.8)),
        run(Outcome::Exited, Some(0.7)),
        run(Outcome::Distance, None),
        run(Outcome::Clogged, Some(0.1)),
        run(Outcome::Settled, Some(0.0)),
    ];
    let speed = speed_average(&point_runs(ring(0.5), runs.clone()));
    assert_eq!((speed.runs, speed.flowing), (6, 3));
    assert!((speed.v_g.unwrap() - 0.7).abs() < 1e-15 && speed.v_g_low.is_none());
    assert!((speed.ca.unwrap() - 0.7 * std::f64::consts::PI / 2.0).abs() < 1e-14);
    let soft = speed_average(&point_runs(Model::Soft(Soft { e_w: 10.0 }), runs[4..].to_vec()));
    assert_eq!((soft.runs, soft.flowing, soft.v_g, soft.ca), (2, 0, None, None));
}

#[test]
fn an_arrested_run_counts_as_a_clog_at_its_equilibrium_and_does_not_flow() {
    let run = |outcome, r_end, arrested| FinishedRun {
        seed: 0,
        outcome,
        r_end,
        t_end: 1.0,
        v_g_mean: Some(0.5),
        mechanism: None,
        arrested,
    };
    let point = point_runs(
        ring(0.5),
        vec![
            run(Outcome::Clogged, 4.0, None),
            run(Outcome::TimeLimit, 7.9, Some(8.0)),
            run(Outcome::TimeLimit, 12.0, None),
        ],
    );
    let fit = lambda_fit(&point, 0.0);
    assert_eq!((fit.runs, fit.clogs, fit.arrested, fit.lambda), (3, 2, 1, Some(12.0)));
    assert_eq!(speed_average(&point).flowing, 1);
    let tables = decay_lengths(&fit_all(std::slice::from_ref(&point), 0.0));
    assert!(tables.contains("clogs   arrested"), "{tables}");
    let without = point_runs(ring(0.5), point.runs[..1].to_vec());
    assert!(!decay_lengths(&fit_all(&[without], 0.0)).contains("arrested"));
}

#[test]
fn a_point_without_runs_has_a_fit_without_answers() {
    let fit = lambda_fit(&point_runs(ring(1.0), vec![]), 0.0);
    assert_eq!((fit.runs, fit.clogs, fit.runs_for_ten_percent), (0, 0, None));
    assert_eq!(numbers(&fit), [None; 5]);
}

#[test]
fn tables_show_what_varies_and_name_what_does_not() {
    let mut points = vec![synthetic(1.09, 24.0, 50), synthetic(0.2, 1e9, 20), synthetic(3.0, 41.0, 50)];
    let constant = |seed| FinishedRun {
        seed,
        outcome: Outcome::Clogged,
        r_end: 9.0,
        t_end: 1.0,
        v_g_mean: None,
        mechanism: None,
        arrested: None,
    };
    points.push(point_runs(ring(10.0), (0..12).map(constant).collect()));
    points.push(point_runs(Model::Soft(Soft { e_w: 10.0 }), vec![]));
    let fits = fit_all(&points, 0.0);
    let text = decay_lengths(&fits);
    println!("{text}\n{}", mean_speeds(&fits));
    let row = |gamma: &str| text.lines().find(|line| line.trim_start().starts_with(gamma)).unwrap().to_owned();
    // 20 runs of 60 sigma without a clog: 1200/2.9957 = 400.57.
    assert!(row("0.2 ").contains("> 400") && row("10 ").contains("< 0.001 *"), "{text}");
    let position = |gamma: &str| text.find(&row(gamma)).unwrap();
    assert!(position("0.2 ") < position("1.09 ") && position("1.09 ") < position("3 "));
    assert!(text.contains("DP in obstacle arrays: dynamics = vertex, kappa = 1e-3, k_a = 1e4"), "{text}");
    assert!(text.contains("SP in obstacle arrays: e_w = 10") && !text.contains("gamma ="));
    assert!(text.contains("p < 0.05 in 1 of 3 rows tested, where chance alone gives 0.15"), "{text}");
    let speeds = mean_speeds(&fits);
    assert!(speeds.contains("20/20") && speeds.contains("0/12"), "{speeds}");
    assert!(text.lines().chain(speeds.lines()).all(|line| line.chars().count() <= 100));
}

/// Runs that clog at these displacements, and as many that go 60 sigma.
fn clogs_at(gamma: f64, clogs: &[f64], flowing: usize) -> PointRuns {
    let ends = clogs.iter().map(|&r| (Outcome::Clogged, r)).chain((0..flowing).map(|_| (Outcome::Distance, 60.0)));
    let run = |(seed, (outcome, r_end)): (usize, (Outcome, f64))| FinishedRun {
        seed: seed as u64,
        outcome,
        r_end,
        t_end: 1.0,
        v_g_mean: None,
        mechanism: None,
        arrested: None,
    };
    point_runs(ring(gamma), ends.enumerate().map(run).collect())
}

#[test]
fn a_lambda_from_one_or_two_clogs_bears_a_mark_that_says_how_little_it_is_worth() {
    let points = [clogs_at(1.0, &[0.5], 2), clogs_at(2.0, &[0.5, 1.0], 2), clogs_at(3.0, &[0.5, 20.0, 31.0], 2)];
    let text = decay_lengths(&fit_all(&points, 0.0));
    let marked: Vec<_> = text.lines().map(|line| line.contains("† ")).collect();
    let row = |gamma: &str| text.lines().position(|line| line.trim_start().starts_with(gamma)).unwrap();
    assert_eq!(["1 ", "2 ", "3 "].map(|gamma| marked[row(gamma)]), [true, true, false], "{text}");
    let rows: Vec<_> = ["1 ", "2 ", "3 "].map(|gamma| text.lines().nth(row(gamma)).unwrap().chars().count()).to_vec();
    assert!(rows.windows(2).all(|pair| pair[0] == pair[1]), "a mark shifts no column: {text}");
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("from 0.23 to 18 times the value shown, two clogs from 0.32 to 6 times"), "{words}");
    let interval = |clogs: usize| {
        let life = |clogged| Lifetime { r: 1.0, clogged };
        match maximum_likelihood(&Lifetimes::new(vec![life(true); clogs])) {
            DecayLength::Measured { low, high, .. } => [low, high],
            other => panic!("{other:?}"),
        }
    };
    let near = |[low, high]: [f64; 2], [a, b]: [f64; 2]| (low / a - 1.0).abs() < 0.03 && (high / b - 1.0).abs() < 0.03;
    assert!(near(interval(1), [0.23, 18.0]) && near(interval(2), [0.32, 6.0]));
    assert!(!decay_lengths(&fit_all(&points[2..], 0.0)).contains('†'), "no mark, no sentence about it");
}

#[test]
fn estimates_ten_times_apart_are_marked_however_many_clogs_there_are_and_keep_their_digits() {
    let points = [clogs_at(1.0, &[0.1, 0.11, 0.12, 0.13], 1)];
    let fit = lambda_fit(&points[0], 0.0);
    let (lambda, least_squares) = (fit.lambda.unwrap(), fit.lambda_least_squares.unwrap());
    assert!(lambda > 10.0 * least_squares, "{lambda} {least_squares}");
    let text = decay_lengths(&fit_all(&points, 0.0));
    let row = text.lines().find(|line| line.contains('†')).unwrap();
    assert!(row.contains(&format!("{least_squares:.2}")), "{least_squares}: {row}");
}

#[test]
fn tables_of_nothing_say_so() {
    assert_eq!(decay_lengths(&[]), "Decay lengths: no grid point has finished runs yet.\n");
    assert_eq!(mean_speeds(&[]), "Mean speeds: no grid point has finished runs yet.\n");
}

#[test]
fn the_words_of_the_tables_are_explained_where_they_first_stand() {
    let mut wide = synthetic(1.0, 20.0, 12);
    if let Scene::Obstacles(field) = &mut wide.point.scene {
        (field.w_ob, field.density) = (1.0, Density::Saturated);
    }
    wide.point_id = wide.point.id();
    let points = [synthetic(1.0, 20.0, 12), wide];
    let fits = fit_all(&points, 0.0);
    let tables = [decay_lengths(&fits), mean_speeds(&fits)];
    for text in &tables {
        assert!(text.contains("\nw_ob       smallest gap between two obstacles, in sigma\n"), "{text}");
        assert!(text.contains("\ndensity    obstacles per sigma^2; saturated: until no more fit\n"), "{text}");
        assert!(text.contains("\nother names: meniscus keys NAME\n") && !text.contains("\ngamma "), "{text}");
    }
    assert!(tables[1].contains("\nCa         capillary number"), "{}", tables[1]);
}

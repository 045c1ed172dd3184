//! Comparisons along an axis of a grid: ratios of neighbouring points, and whether lambda is monotonic.

use crate::parameters::Point;
use crate::report::parameters::{Split, by_kind, split};
use crate::report::rounding::{significant, with_interval};
use crate::report::text_table::{NOTHING, TextTable};
use crate::results::fits::PointRuns;
use crate::store::ColumnKind::{self, Number, Text, Whole};
use crate::study::compare::{Ratio, holm, lambda_ratio, speed_ratio};
use crate::study::series::{Series, axes, may_follow, series};
use crate::study::survival::monotonic::{Monotonic, monotonic};
use rayon::prelude::*;
use rusqlite::types::Value;
use std::borrow::Borrow;
use std::collections::BTreeSet;

/// An axis with fewer points says nothing about monotony.
const FEWEST_POINTS: usize = 4;

const NOTES: &str = "\
ratio      of the second point over the first, over the seeds that both have; speeds over those of them
           that flow at both
[a, b]     its 95% interval, by the studentised bootstrap over seeds
z          its logarithm over the standard error of that
p          two-sided, of a ratio of 1, from the same bootstrap; adjusted for the rows of its column (Holm),
           so it is at least 2e-4 times their number
-          fewer than twenty common seeds, too few clogs, or all but a few droplets end in the same places
";

/// Two points of a series, and their ratios.
#[derive(Clone, Debug)]
pub(crate) struct Pair<'a> {
    /// The points.
    points: [&'a PointRuns; 2],
    /// Their values of the axis.
    values: [f64; 2],
    lambda: Option<Adjusted>,
    speed: Option<Adjusted>,
}

/// A ratio, and its p adjusted for all pairs.
#[derive(Clone, Copy, Debug)]
struct Adjusted {
    ratio: Ratio,
    p: f64,
}

/// The pairs along an axis: neighbours, or those of two values that are asked for.
pub(crate) fn pairs<'a>(points: &'a [PointRuns], axis: &str, values: Option<[f64; 2]>, from: f64) -> Vec<Pair<'a>> {
    let chosen = series(points, axis).into_iter().flat_map(|Series(along)| match values {
        None => along.windows(2).map(|pair| [pair[0], pair[1]]).collect::<Vec<_>>(),
        Some(wanted) => {
            let at = |value: f64| along.iter().find(|(found, _)| *found == value).copied();
            at(wanted[0]).zip(at(wanted[1])).map(|(a, b)| [a, b]).into_iter().collect()
        }
    });
    let chosen: Vec<[(f64, &PointRuns); 2]> = chosen.collect();
    let compare = |&[(_, a), (_, b)]: &[(f64, &PointRuns); 2]| (lambda_ratio(a, b, from), speed_ratio(a, b));
    let (lambdas, speeds): (Vec<_>, Vec<_>) = chosen.par_iter().map(compare).unzip();
    let ratios = adjusted(&lambdas).into_iter().zip(adjusted(&speeds));
    let pairs = chosen.into_iter().zip(ratios);
    pairs
        .map(|([(low, a), (high, b)], (lambda, speed))| Pair { points: [a, b], values: [low, high], lambda, speed })
        .collect()
}

/// The ratios with their probabilities adjusted for each other.
fn adjusted(ratios: &[Option<Ratio>]) -> Vec<Option<Adjusted>> {
    let known: Vec<f64> = ratios.iter().flatten().map(|ratio| ratio.p).collect();
    let mut p = holm(&known).into_iter();
    ratios.iter().map(|ratio| Some(Adjusted { ratio: (*ratio)?, p: p.next()? })).collect()
}

/// The values of an axis at the points that differ in it alone.
pub(crate) fn values(points: &[PointRuns], axis: &str) -> Vec<f64> {
    let mut values: Vec<f64> =
        series(points, axis).iter().flat_map(|series| series.0.iter().map(|(value, _)| *value)).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// The tables of the pairs along an axis, one for each model and kind of scene.
pub(crate) fn text(pairs: &[Pair<'_>], axis: &str, from: f64) -> String {
    let tables = by_kind(pairs, |pair| &pair.points[0].point);
    let tables: String = tables.iter().map(|pairs| ratio_table(pairs, axis, from)).collect();
    tables + NOTES
}

/// `DP in obstacles`.
fn kind(point: &Point) -> String {
    format!("{} in {}", point.model.name(), point.scene.name())
}

fn ratio_table(pairs: &[&Pair<'_>], axis: &str, from: f64) -> String {
    let parameters: Vec<&Point> = pairs.iter().map(|pair| &pair.points[0].point).collect();
    let split = split(&parameters);
    let changes: Vec<String> =
        pairs.iter().map(|pair| pair.values.map(|value| significant(value, 6)).join(" -> ")).collect();
    let keys = telling_apart(&split, parameters[0], axis, &changes);
    let beyond = if from > 0.0 { format!(" beyond {from} sigma") } else { String::new() };
    let mut headers: Vec<String> = keys.iter().map(|&key| split.varying[key].to_owned()).collect();
    headers.extend([axis, "seeds", "lambda ratio", "z", "p", "seeds", "<v_g> ratio", "z", "p"].map(str::to_owned));
    let row = |&at: &usize| {
        let pair = &pairs[at];
        let mut cells: Vec<String> = keys.iter().map(|&key| split.rows[at][key].clone()).collect();
        cells.push(changes[at].clone());
        cells.extend(ratio_cells(pair.lambda));
        cells.extend(ratio_cells(pair.speed));
        cells
    };
    let rows = split.order.iter().map(row).collect();
    let title = format!("Ratios of decay lengths{beyond} and of mean speeds along {axis}, {}", kind(parameters[0]));
    TextTable { title, headers, rows, names: 0, keys: keys.len() + 1 }.text()
}

/// The columns of parameters that tell rows of one kind apart, which have these `labels` besides. Parameters that may follow
/// the axis stand there only if rows would look alike without them.
fn telling_apart(split: &Split, one: &Point, axis: &str, labels: &[String]) -> Vec<usize> {
    let others = |follow: bool| -> Vec<usize> {
        let stands = |name: &str| name != axis && name != "bond" && (follow || !may_follow(one, name));
        (0..split.varying.len()).filter(|&key| stands(split.varying[key])).collect()
    };
    let short = others(false);
    let seen = |at: usize| (short.iter().map(|&key| &split.rows[at][key]).collect::<Vec<_>>(), &labels[at]);
    let different = (0..labels.len()).map(seen).collect::<BTreeSet<_>>().len();
    if different == labels.len() { short } else { others(true) }
}

fn ratio_cells(found: Option<Adjusted>) -> [String; 4] {
    let Some(Adjusted { ratio: Ratio { seeds, ratio, low, high, z, .. }, p }) = found else {
        return [(); 4].map(|()| NOTHING.to_owned());
    };
    [seeds.to_string(), with_interval(ratio, low, high), format!("{z:.1}"), significant(p, 2)]
}

/// The columns of [`rows`].
pub(crate) const COLUMNS: [(&str, ColumnKind); 19] = [
    ("point_id", Text),
    ("other_id", Text),
    ("axis", Text),
    ("value", Number),
    ("other", Number),
    ("lambda_seeds", Whole),
    ("lambda_ratio", Number),
    ("lambda_ratio_low", Number),
    ("lambda_ratio_high", Number),
    ("lambda_z", Number),
    ("lambda_p", Number),
    ("lambda_p_holm", Number),
    ("v_g_seeds", Whole),
    ("v_g_ratio", Number),
    ("v_g_ratio_low", Number),
    ("v_g_ratio_high", Number),
    ("v_g_z", Number),
    ("v_g_p", Number),
    ("v_g_p_holm", Number),
];

/// A row for each pair.
pub(crate) fn rows(pairs: &[Pair<'_>], axis: &str) -> Vec<Vec<Value>> {
    let cells = |found: Option<Adjusted>| -> [Value; 7] {
        let Some(Adjusted { ratio, p }) = found else { return [const { Value::Null }; 7] };
        [
            ratio.seeds.into(),
            ratio.ratio.into(),
            ratio.low.into(),
            ratio.high.into(),
            ratio.z.into(),
            ratio.p.into(),
            p.into(),
        ]
    };
    let row = |pair: &Pair<'_>| {
        let mut row: Vec<Value> = pair.points.map(|point| point.point_id.to_string().into()).to_vec();
        row.push(axis.to_owned().into());
        row.extend(pair.values.map(Value::from));
        row.extend(cells(pair.lambda));
        row.extend(cells(pair.speed));
        row
    };
    pairs.iter().map(row).collect()
}

/// What each axis of four points and more says about lambda: a table for each axis, or nothing.
pub(crate) fn monotony(points: &[impl Borrow<PointRuns>], from: f64) -> String {
    let tables: String = axes(points, FEWEST_POINTS)
        .into_iter()
        .map(|axis| {
            let long = series(points, axis).into_iter().filter(|series| series.0.len() >= FEWEST_POINTS);
            let long: Vec<Series<'_>> = long.collect();
            let found: Vec<_> = long.par_iter().map(|series| Some((series, monotonic(series, from)?))).collect();
            let known: Vec<_> = found.into_iter().flatten().collect();
            let kinds = by_kind(&known, |(series, _)| &series.0[0].1.point);
            kinds.iter().map(|known| monotony_table(axis, known)).collect::<String>()
        })
        .collect();
    if tables.is_empty() { tables } else { format!("\n{tables}{MONOTONY_NOTE}") }
}

const MONOTONY_NOTE: &str = "\
rise, fall the most certain ones, from one value to the other; p is the chance of one as certain somewhere
           on the axis if there is none. Where lambda is monotonic, the larger p is above 0.05 in at least
           95% of all cases. Rows are not adjusted for each other, and the error of the discretisation is
           not in p
";

fn monotony_table(axis: &str, known: &[&(&Series<'_>, Monotonic)]) -> String {
    let parameters: Vec<&Point> = known.iter().map(|(series, _)| &series.0[0].1.point).collect();
    let split = split(&parameters);
    let keys = telling_apart(&split, parameters[0], axis, &vec![String::new(); known.len()]);
    let mut headers: Vec<String> = keys.iter().map(|&key| split.varying[key].to_owned()).collect();
    headers.extend(["values", "lambda", "rise", "p", "fall", "p"].map(str::to_owned));
    let row = |&at: &usize| {
        let (series, found) = known[at];
        let mut cells: Vec<String> = keys.iter().map(|&key| split.rows[at][key].clone()).collect();
        cells.extend([series.0.len().to_string(), verdict(found).to_owned()]);
        for slope in [found.rise, found.fall] {
            cells.push(slope.between.map(|value| significant(value, 6)).join(" -> "));
            cells.push(significant(slope.p, 2));
        }
        cells
    };
    let rows = split.order.iter().map(row).collect();
    let title = format!("Is lambda monotonic along {axis}? {}", kind(parameters[0]));
    TextTable { title, headers, rows, names: 0, keys: keys.len() }.text()
}

fn verdict(found: &Monotonic) -> &'static str {
    match (found.rise.p < 0.05, found.fall.p < 0.05) {
        (true, true) => "rises and falls",
        (true, false) => "rises",
        (false, true) => "falls",
        (false, false) => "not decided",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Deformable, Density, Model, ObstacleField, Scene, Soft};
    use crate::results::{fits::FinishedRun, trajectory::Outcome};

    /// Points of these decay lengths along e_w = 1, 2, ...; the droplets of a seed go equally many of them.
    fn points(lambdas: &[f64]) -> Vec<PointRuns> {
        let made = lambdas.iter().enumerate().map(|(k, lambda)| {
            let array = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 5000.0 };
            let point = Point::new(Model::Soft(Soft { e_w: 1.0 + k as f64 }), Scene::Obstacles(array));
            let run = |seed: u64| {
                let chance = (seed as f64 + 0.5) / 40.0;
                // What is not common is a tenth, and differs from point to point.
                let own = 0.1 * ((7 * seed + 11 * k as u64) % 40) as f64 / 40.0;
                let r_end = lambda * (own - libm::log(chance));
                let (outcome, v_g_mean) = (Outcome::Clogged, None);
                FinishedRun { seed, outcome, r_end, t_end: 1.0, v_g_mean, mechanism: None, arrested: None }
            };
            PointRuns { point_id: point.id(), point, runs: (0..40).map(run).collect() }
        });
        made.collect()
    }

    #[test]
    fn neighbours_on_an_axis_or_two_values_are_compared() {
        let points = points(&[5.0, 20.0, 20.0, 5.0]);
        let neighbours = pairs(&points, "e_w", None, 0.0);
        assert_eq!(neighbours.iter().map(|pair| pair.values).collect::<Vec<_>>(), [[1.0, 2.0], [2.0, 3.0], [3.0, 4.0]]);
        let ratios: Vec<f64> = neighbours.iter().map(|pair| pair.lambda.unwrap().ratio.ratio).collect();
        assert!((ratios[0] - 4.0).abs() < 0.2 && (ratios[1] - 1.0).abs() < 0.1 && (ratios[2] - 0.25).abs() < 0.02);
        let text = text(&neighbours, "e_w", 0.0);
        assert!(text.contains("1 -> 2") && text.contains("lambda ratio"), "{text}");
        let two = pairs(&points, "e_w", Some([1.0, 3.0]), 0.0);
        assert_eq!((two.len(), rows(&two, "e_w")[0].len()), (1, COLUMNS.len()));
        assert!(
            pairs(&points, "e_w", Some([1.0, 9.0]), 0.0).is_empty() && pairs(&points, "w_ob", None, 0.0).is_empty()
        );
        assert_eq!(values(&points, "e_w"), [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn points_of_two_models_stand_in_tables_of_their_own() {
        let mut both = points(&[5.0, 20.0]);
        for point in points(&[5.0, 20.0]) {
            let ring = Deformable::of_tension(1.0);
            let mut made = Point::new(Model::Deformable(ring), point.point.scene.clone());
            if let Scene::Obstacles(array) = &mut made.scene {
                array.w_ob = both.len() as f64 / 10.0;
            }
            both.push(PointRuns { point_id: made.id(), point: made, runs: point.runs });
        }
        if let Scene::Obstacles(array) = &mut both[1].point.scene {
            array.w_ob = 0.5;
        }
        if let Model::Soft(soft) = &mut both[1].point.model {
            soft.e_w = 1.0;
        }
        let text = text(&pairs(&both, "w_ob", None, 0.0), "w_ob", 0.0);
        assert!(text.contains("w_ob, SP in obstacles") && text.contains("w_ob, DP in obstacles"), "{text}");
        assert!(text.contains("0.2 -> 0.5") && text.contains("0.2 -> 0.3"), "{text}");
    }

    #[test]
    fn where_vertices_are_an_axis_too_they_tell_rows_apart() {
        let ring = |gamma, n_vertices| {
            let ring = Deformable { n_vertices, ..Deformable::of_tension(gamma) };
            let array = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 5000.0 };
            let point = Point::new(Model::Deformable(ring), Scene::Obstacles(array));
            PointRuns { point_id: point.id(), point, runs: points(&[gamma])[0].runs.clone() }
        };
        let one = [ring(1.0, 64), ring(3.0, 96)];
        assert!(!text(&pairs(&one, "gamma", None, 0.0), "gamma", 0.0).contains("n_vertices"));
        let both = [ring(1.0, 64), ring(3.0, 64), ring(1.0, 96), ring(3.0, 96)];
        assert!(text(&pairs(&both, "gamma", None, 0.0), "gamma", 0.0).contains("n_vertices"));
    }

    #[test]
    fn a_lambda_that_rises_and_falls_along_an_axis_is_said_to() {
        let text = monotony(&points(&[5.0, 20.0, 20.0, 5.0]), 0.0);
        assert!(text.contains("Is lambda monotonic along e_w?") && text.contains("rises and falls"), "{text}");
        let falls = monotony(&points(&[40.0, 20.0, 10.0, 5.0]), 0.0);
        assert!(falls.contains(" falls ") && !falls.contains("rises and"), "{falls}");
        assert_eq!(monotony(&points(&[40.0, 20.0, 10.0]), 0.0), "", "three points are too few");
    }
}

//! Tables of decay lengths and of mean speeds, one of each per model and kind of scene.
//!
//! A table has a column for each parameter that varies over its rows and names the others in its title. Rows are
//! sorted by those columns. The lines under the last table say what the columns mean.

use crate::parameters::{PARAMETERS, Parameter, Point, PointId, Scene};
use crate::report::parameters::split;
use crate::report::rounding::{lower_bound, significant, to_precision, with_interval};
use crate::report::text_table::{NOTHING, TextTable, terminal_width};
use crate::results::fits::{LambdaFit, SpeedAverage};
use crate::results::trajectory::Mechanism;
use crate::study::fits::FittedPoint;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

/// Below this probability a row is marked.
const DOUBTFUL: f64 = 0.05;

/// Width to which titles and footnotes are broken, unless the terminal is narrower.
const WIDTH: usize = 100;

const LAMBDA_NOTE: &str = "\
lambda     decay length of the survival probability P(r) = exp(-r/lambda), in sigma, by maximum
           likelihood; a run that did not clog counts as cut off at its r
[a, b]     95% profile-likelihood interval: of many such intervals 95% hold the true lambda
> a        nothing clogged; were lambda smaller, the chance of that would be below 5%
least sq.  the paper's estimate, exp(-r/lambda) fitted to P(r)
p_exp      chance of clogs as unevenly spread as these, were P(r) exponential; from 5 clogs on
w/s/h      how the clogs hold: wrap, squeeze, hybrid, in percent
for ±10%   runs in total that would narrow the interval to ±10%, at the present share of clogs
";

/// Where the column of arrests stands, if there are any: behind that of the clogs.
const ARRESTED_COLUMN: usize = 2;

const ARRESTED_NOTE: &str = "\
arrested   those of the clogs that t_max cut off at rest, above ek_threshold: each counts as a clog at the
           stable equilibrium ahead of it
";

const HARDLY_KNOWN: &str = "\
† lambda is hardly known: it comes from one or two clogs, or the two estimates are ten times apart. One clog leaves it \
anywhere from 0.23 to 18 times the value shown, two clogs from 0.32 to 6 times. More runs help.";

const SPEED_NOTE: &str = "\
<v_g>/V_t  speed after the start-up, mean over the flowing runs: those without a clog or an arrest
[a, b]     95% studentised bootstrap interval of that mean; from 5 flowing runs on
Ca         capillary number, viscous stress over capillary pressure: v_g/V_t * pi/(4 gamma)
";

/// The tables of decay lengths.
///
/// Rows whose survival is hardly exponential (p < 0.05) bear a star. A line below says how many there are, and how many
/// chance alone would give. Rows whose lambda is hardly known bear a dagger, which a line below explains. Where runs
/// were arrested at their time limit, a column counts them.
pub fn decay_lengths(points: &[FittedPoint]) -> String {
    let mut headers = vec!["runs", "clogs", "lambda [95%]", "least sq.", "p_exp", "w/s/h [%]", "for ±10%"];
    // Elsewhere than in an array of obstacles there is one place to clog at, and no decay of P(r).
    let in_arrays = |row: &&FittedPoint| matches!(row.point.point.scene, Scene::Obstacles(_));
    let rows: Vec<&FittedPoint> = points.iter().filter(in_arrays).collect();
    if rows.is_empty() && !points.is_empty() {
        return "Decay lengths: none, for no droplet moved in an array of obstacles.\n".to_owned();
    }
    if !rows.iter().any(|row| row.lambda.arrested > 0) {
        return tables("Decay lengths", &rows, &headers, lambda_cells, lambda_notes);
    }
    headers.insert(ARRESTED_COLUMN, "arrested");
    let cells = |row: &FittedPoint| {
        let mut cells = lambda_cells(row);
        cells.insert(ARRESTED_COLUMN, row.lambda.arrested.to_string());
        cells
    };
    tables("Decay lengths", &rows, &headers, cells, |rows| lambda_notes(rows) + ARRESTED_NOTE)
}

/// The tables of mean speeds.
pub fn mean_speeds(points: &[FittedPoint]) -> String {
    let headers = ["flowing/runs", "<v_g>/V_t [95%]", "Ca"];
    let rows: Vec<&FittedPoint> = points.iter().collect();
    tables("Mean speeds", &rows, &headers, |row| speed_cells(&row.speed), |_| SPEED_NOTE.to_owned())
}

/// What follows the tables of a campaign where the store holds finished runs of seeds that it does not ask for; nothing
/// where it holds none. `asked` are the seeds that it asks for.
pub fn further_runs(points: &[FittedPoint], asked: &HashMap<PointId, Range<u64>>) -> String {
    let of_campaign = |point: &FittedPoint| {
        let seeds = asked.get(&point.point.point_id);
        point.point.runs.iter().filter(|run| seeds.is_none_or(|seeds| seeds.contains(&run.seed))).count()
    };
    let counts = points.iter().map(|point| (point.point.runs.len(), of_campaign(point)));
    let (used, asked): (Vec<usize>, Vec<usize>) = counts.filter(|(used, asked)| used > asked).unzip();
    if used.is_empty() {
        return String::new();
    }
    let text = format!(
        "These tables use every finished run that the store holds. At {} of {} points that is {} runs, of which this \
         campaign asks for {}.",
        used.len(),
        points.len(),
        ends(&used),
        ends(&asked)
    );
    format!("\n{}\n", wrap(&text))
}

/// `5`, or `4 to 9`.
fn ends(counts: &[usize]) -> String {
    match (counts.iter().min(), counts.iter().max()) {
        (Some(least), Some(most)) if least < most => format!("{least} to {most}"),
        (Some(all), _) => all.to_string(),
        (None, _) => String::new(),
    }
}

/// Whether the data leave lambda nearly open: one or two clogs, or estimates ten times apart.
fn is_hardly_known(fit: &LambdaFit) -> bool {
    let apart = fit.lambda.zip(fit.lambda_least_squares).map(|(a, b)| (a / b).max(b / a));
    matches!(fit.clogs, 1 | 2) || apart.is_some_and(|ratio| ratio >= 10.0)
}

fn lambda_cells(row: &FittedPoint) -> Vec<String> {
    let fit: &LambdaFit = &row.lambda;
    let or_nothing = |text: Option<String>| text.unwrap_or_else(|| NOTHING.to_owned());
    let (lambda, least_squares) = match (fit.lambda, fit.lambda_low, fit.lambda_high) {
        (Some(lambda), Some(low), Some(high)) => {
            let narrower = (lambda - low).min(high - lambda);
            // A value far below the interval still shows digits of its own.
            let least_squares = fit.lambda_least_squares.map(|x| to_precision(x, narrower.min(x)));
            let mark = if is_hardly_known(fit) { "† " } else { "" };
            (Some(format!("{mark}{}", with_interval(lambda, low, high))), least_squares)
        }
        (None, Some(low), _) => (Some(lower_bound(low)), None),
        _ => (None, None),
    };
    // Both endings have the same width, so that the digits stay aligned.
    let p_text = |p: f64| {
        let number = if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") };
        number + if p < DOUBTFUL { " *" } else { "  " }
    };
    vec![
        fit.runs.to_string(),
        fit.clogs.to_string(),
        or_nothing(lambda),
        or_nothing(least_squares),
        or_nothing(fit.p_exponential.map(p_text)),
        or_nothing(shares(row)),
        or_nothing(fit.runs_for_ten_percent.map(|runs| runs.to_string())),
    ]
}

/// `10/85/5`: percentages of the clogs that hold by wrap, squeeze and hybrid, among those whose mechanism is known.
fn shares(row: &FittedPoint) -> Option<String> {
    let known: Vec<Mechanism> = row.point.runs.iter().filter_map(|run| run.mechanism).collect();
    let percent = |wanted| {
        let clogs = known.iter().filter(|&&mechanism| mechanism == wanted).count();
        format!("{:.0}", 100.0 * clogs as f64 / known.len() as f64)
    };
    let all = [Mechanism::Wrap, Mechanism::Squeeze, Mechanism::Hybrid];
    (!known.is_empty()).then(|| all.map(percent).join("/"))
}

fn lambda_notes(rows: &[&FittedPoint]) -> String {
    let mut notes = LAMBDA_NOTE.to_owned();
    let tested: Vec<f64> = rows.iter().filter_map(|row| row.lambda.p_exponential).collect();
    let doubtful = tested.iter().filter(|&&p| p < DOUBTFUL).count();
    if doubtful > 0 {
        let (tested, by_chance) = (tested.len(), significant(DOUBTFUL * tested.len() as f64, 2));
        notes += &wrap(&format!(
            "* p < {DOUBTFUL} in {doubtful} of {tested} rows tested, where chance alone gives {by_chance} on average: \
             there one lambda may not describe P(r)."
        ));
        notes += "\n";
    }
    if rows.iter().any(|row| is_hardly_known(&row.lambda)) {
        notes += &wrap(HARDLY_KNOWN);
        notes += "\n";
    }
    notes
}

fn speed_cells(speed: &SpeedAverage) -> Vec<String> {
    let half_width = match (speed.v_g, speed.v_g_low, speed.v_g_high) {
        (Some(v_g), Some(low), Some(high)) => Some((v_g - low).min(high - v_g)),
        _ => None,
    };
    let v_g = match (speed.v_g, speed.v_g_low, speed.v_g_high) {
        (Some(v_g), Some(low), Some(high)) => with_interval(v_g, low, high),
        (Some(v_g), ..) => significant(v_g, 2),
        _ => NOTHING.to_owned(),
    };
    // Ca is v_g times a constant, so both have the same relative uncertainty.
    let ca_text = |ca: f64| match (half_width, speed.v_g) {
        (Some(width), Some(v_g)) if v_g > 0.0 => to_precision(ca, ca * width / v_g),
        _ => significant(ca, 2),
    };
    vec![format!("{}/{}", speed.flowing, speed.runs), v_g, speed.ca.map_or_else(|| NOTHING.to_owned(), ca_text)]
}

/// One table per model and kind of scene, in the order in which they first appear.
fn tables(
    what: &str,
    points: &[&FittedPoint],
    headers: &[&str],
    cells: impl Fn(&FittedPoint) -> Vec<String>,
    notes: impl Fn(&[&FittedPoint]) -> String,
) -> String {
    let kind = |row: &FittedPoint| (row.point.point.model.name(), row.point.point.scene.name());
    let mut kinds = vec![];
    for row in points {
        if !kinds.contains(&kind(row)) {
            kinds.push(kind(row));
        }
    }
    if kinds.is_empty() {
        return format!("{what}: no grid point has finished runs yet.\n");
    }
    let mut varying: BTreeSet<&str> = BTreeSet::new();
    let table = |&wanted: &(&str, &str)| {
        let rows: Vec<&FittedPoint> = points.iter().copied().filter(|row| kind(row) == wanted).collect();
        let parameters: Vec<&Point> = rows.iter().map(|row| &row.point.point).collect();
        let split = split(&parameters);
        let title = wrap(&format!("{what}, {}: {}", kind_in_words(parameters[0]), split.constant.join(", ")));
        let headers = split.varying.iter().chain(headers).map(|&name| name.to_owned()).collect();
        let row = |&i: &usize| split.rows[i].iter().cloned().chain(cells(rows[i])).collect();
        let rows = split.order.iter().map(row).collect();
        let keys = split.varying.len();
        varying.extend(split.varying);
        TextTable { title, headers, rows, names: 0, keys }.text()
    };
    let tables: Vec<String> = kinds.iter().map(table).collect();
    format!("{}{}{}", tables.join("\n"), names_note(&varying, points), notes(points))
}

/// What the columns of parameters mean, and where to ask for the parameters in the titles.
fn names_note(varying: &BTreeSet<&str>, points: &[&FittedPoint]) -> String {
    let mut note = String::new();
    // `e_w` has a row for each model, and may vary for one of them only.
    let varies = |parameter: &Parameter| {
        let mut values = points.iter().filter_map(|row| parameter.get(&row.point.point));
        values.next().is_some_and(|first| values.any(|value| value != first))
    };
    let rows = PARAMETERS.iter().filter(|parameter| varying.contains(parameter.name) && varies(parameter));
    for Parameter { name, about, unit, .. } in rows {
        let unit = if unit.is_empty() { String::new() } else { format!(", in {unit}") };
        let saturated = if *name == "density" { "; saturated: until no more fit" } else { "" };
        let line = format!("{name:<10} {about}{unit}{saturated}\n");
        // `e_w` of either model is told once if both mean the same.
        if !note.contains(&line) {
            note += &line;
        }
    }
    note + "other names: meniscus keys NAME\n"
}

fn kind_in_words(point: &Point) -> String {
    let scene = match point.scene {
        Scene::Obstacles(_) => "obstacle arrays",
        Scene::Channel(_) => "channels",
        Scene::Plate => "plates",
        Scene::Disc(_) => "front of a disc",
    };
    format!("{} in {scene}", point.model.name())
}

/// The text in lines of at most [`WIDTH`] characters, or as many as the terminal has, broken at spaces but not at
/// no-break spaces.
fn wrap(text: &str) -> String {
    let width = terminal_width().map_or(WIDTH, |width| width.min(WIDTH));
    let mut lines = String::new();
    let mut length = 0;
    for word in text.split(' ') {
        let word_length = word.chars().count();
        if length > 0 {
            let fits = length + 1 + word_length <= width;
            lines.push(if fits { ' ' } else { '\n' });
            length = if fits { length + 1 } else { 0 };
        }
        lines.push_str(word);
        length += word_length;
    }
    lines.replace('\u{a0}', " ")
}

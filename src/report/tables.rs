//! Tables of decay lengths and of mean speeds, one of each per model and kind of scene.
//!
//! A table has a column for each parameter that varies over its rows and names the others in its title. Rows are
//! sorted by those columns. The lines under the last table say what the columns mean.

use crate::campaign::choose::discretisation::discretisation_error;
use crate::campaign::choose::tolerance::Kind;
use crate::parameters::{Model, PARAMETERS, Parameter, Point, PointId, Scene};
use crate::report::lambda_columns::{DOUBTFUL, columns, is_hardly_known};
use crate::report::parameters::{by_kind, split};
use crate::report::rounding::{significant, to_precision, with_interval};
use crate::report::text_table::{NOTHING, TextTable, terminal_width};
use crate::results::fits::SpeedAverage;
use crate::study::fits::FittedPoint;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

/// Width to which titles and footnotes are broken, unless the terminal is narrower.
const WIDTH: usize = 100;

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
/// were arrested at their time limit, a column counts them; where time cut many off, two columns say what that means.
pub fn decay_lengths(points: &[FittedPoint]) -> String {
    // Elsewhere than in an array of obstacles there is one place to clog at, and no decay of P(r).
    let in_arrays = |row: &&FittedPoint| matches!(row.point.point.scene, Scene::Obstacles(_));
    let rows: Vec<&FittedPoint> = points.iter().filter(in_arrays).collect();
    if rows.is_empty() && !points.is_empty() {
        return "Decay lengths: none, for no droplet moved in an array of obstacles.\n".to_owned();
    }
    let columns = columns(&rows);
    let headers: Vec<&str> = columns.iter().map(|column| column.header).collect();
    let cells = |row: &FittedPoint| columns.iter().map(|column| (column.cell)(row)).collect();
    let notes = |rows: &[&FittedPoint]| {
        let notes: String = columns.iter().map(|column| column.note).collect();
        notes + &discretisation(rows, Kind::Clog) + &lambda_remarks(rows)
    };
    let from = rows.first().map_or(0.0, |row| row.lambda.r_from);
    let what = if from > 0.0 { format!("Decay lengths beyond {from} sigma") } else { "Decay lengths".to_owned() };
    tables(&what, &rows, &headers, cells, notes)
}

/// The tables of mean speeds.
pub fn mean_speeds(points: &[FittedPoint]) -> String {
    let headers = ["flowing/runs", "<v_g>/V_t [95%]", "Ca"];
    let rows: Vec<&FittedPoint> = points.iter().collect();
    tables(
        "Mean speeds",
        &rows,
        &headers,
        |row| speed_cells(&row.speed),
        |rows| SPEED_NOTE.to_owned() + &discretisation(rows, Kind::Flow),
    )
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

/// The error of the discretisation, which no interval holds: as it was measured, by ring, or that it was not.
fn discretisation(rows: &[&FittedPoint], wanted: Kind) -> String {
    let mut found = BTreeSet::new();
    for point in rows.iter().map(|row| &row.point.point) {
        let Model::Deformable(ring) = &point.model else { continue };
        let error = discretisation_error(point).filter(|(kind, _)| *kind == wanted);
        let error = error.map_or("not measured".to_owned(), |(_, error)| format!("{}%", significant(100.0 * error, 2)));
        found.insert(format!("{error} ({}, n_vertices = {})", ring.dynamics.name(), ring.n_vertices));
    }
    if found.is_empty() {
        return String::new();
    }
    let found: Vec<String> = found.into_iter().collect();
    let text = format!(
        "Error of the discretisation, which is not in the intervals: {}; see docs/statistics.md.",
        found.join(", ")
    );
    wrap(&text) + "\n"
}

/// Sentences about what stands out in the rows.
fn lambda_remarks(rows: &[&FittedPoint]) -> String {
    let mut remarks = Vec::new();
    let tested: Vec<f64> = rows.iter().filter_map(|row| row.lambda.p_exponential).collect();
    let doubtful = tested.iter().filter(|&&p| p < DOUBTFUL).count();
    if doubtful > 0 {
        let (tested, by_chance) = (tested.len(), significant(DOUBTFUL * tested.len() as f64, 2));
        remarks.push(format!(
            "* p < {DOUBTFUL} in {doubtful} of {tested} rows tested, where chance alone gives {by_chance} on average: \
             there one lambda may not describe P(r)."
        ));
    }
    if rows.iter().any(|row| is_hardly_known(&row.lambda)) {
        remarks.push(HARDLY_KNOWN.to_owned());
    }
    if let Some(row) = rows.iter().find(|row| row.lambda.runs == 0 && row.lambda.r_from > 0.0) {
        remarks.push(format!(
            "In the rows with 0 runs no droplet got beyond {} sigma; give a smaller displacement to begin at.",
            row.lambda.r_from
        ));
    }
    let beyond: u32 = rows.iter().map(|row| row.lambda.beyond_box).sum();
    if beyond > 0 {
        remarks.push(format!(
            "{beyond} runs went further than one side of the periodic box, where a droplet meets the same obstacles again. \
             They count as cut off there; a larger box_size brings more."
        ));
    }
    remarks.iter().map(|remark| wrap(remark) + "\n").collect()
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
    let kinds = by_kind(points, |row| &row.point.point);
    if kinds.is_empty() {
        return format!("{what}: no grid point has finished runs yet.\n");
    }
    let mut varying: BTreeSet<&str> = BTreeSet::new();
    let table = |rows: &Vec<&&FittedPoint>| {
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

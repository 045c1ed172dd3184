//! The table of a calibration: a row for each trial, then what they say together.

use crate::report::rounding::{significant, to_precision};
use crate::study::calibrate::{Calibration, Estimate};
use comfy_table::{CellAlignment, Table};

/// Lines above and below the table and under its head, none between rows or columns.
const LINES: &str = "  ── ──      ──    ";

const NOTE: &str = "\
Delta_v    root mean square of v_sim - v_g over the frames, in V_t; Delta_A the same of the shape parameter
";

const NOTE_WEIGHED: &str = "\
Delta_v    root mean square of (v_sim - v_g)/v_g_error over the frames, about 1 where only noise is left;
           Delta_A the same of the shape parameter, in shape_error where the file gives it
";

const ONE: &str = "\
std, 95%   of the one trial: from the curvature of Delta_v^2 at its minimum, by Student's t; several trials say more
";

const MANY: &str = "\
std, 95%   standard deviation over the trials, and interval of their mean by Student's t
";

/// The table of a calibration; `names` are those of its trials with their numbers of frames.
pub fn table(calibration: &Calibration, names: &[(String, usize)], weighed: bool) -> String {
    let mut table = Table::new();
    table.load_preset(LINES);
    table.set_header(["trial", "frames", "gamma*", "b0*", "Delta_v", "Delta_A"]);
    for ((name, frames), fit) in names.iter().zip(&calibration.fits) {
        let number = |value: f64| significant(value, 4);
        let (parameters, deviation) = (fit.parameters, fit.deviation);
        let mut cells = vec![name.clone(), frames.to_string()];
        cells.extend([parameters.gamma, parameters.b0, deviation.v_g, deviation.shape].map(number));
        table.add_row(cells);
    }
    let mut summary = |name: &str, text: fn(&Estimate) -> Option<String>| {
        let cell = |estimate| text(estimate).unwrap_or_else(|| "-".to_owned());
        let cells = [name.to_owned(), String::new(), cell(&calibration.gamma), cell(&calibration.b0)];
        table.add_row(cells.into_iter().chain([String::new(), String::new()]));
    };
    if names.len() > 1 {
        summary("mean", |estimate| Some(to_precision(estimate.value, estimate.spread.unwrap_or(0.0))));
    }
    summary("std", |estimate| estimate.spread.map(|spread| significant(spread, 2)));
    summary("95%", |estimate| {
        let [low, high] = estimate.interval?.map(|end| to_precision(end, estimate.spread.unwrap_or(0.0)));
        Some(format!("[{low}, {high}]"))
    });
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let title = "Line tension gamma* and near-wall drag b0* of least Delta_v";
    let note = if weighed { NOTE_WEIGHED } else { NOTE };
    let spread = if names.len() > 1 { MANY } else { ONE };
    format!("{title}\n{table}\n{note}{spread}")
}

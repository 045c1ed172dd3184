//! The table of a calibration: a row for each trial, then mean, spread and interval over all trials.

use crate::report::rounding::{significant, to_precision};
use crate::report::text_table::{NOTHING, TextTable, owned};
use crate::study::calibrate::{Calibration, FittedParameter};

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

/// The table of a calibration; `names` are those of its trials with their numbers of frames. `weighed` says whether
/// frames have errors.
pub(crate) fn table(calibration: &Calibration, names: &[(String, usize)], weighed: bool) -> String {
    let mut rows: Vec<Vec<String>> = Vec::new();
    for ((name, frames), fit) in names.iter().zip(&calibration.fits) {
        let (parameters, deviation) = (fit.parameters, fit.deviation);
        let numbers = [parameters.gamma, parameters.b0, deviation.v_g, deviation.shape].map(|x| significant(x, 4));
        rows.push([name.clone(), frames.to_string()].into_iter().chain(numbers).collect());
    }
    let mut summary = |name: &str, text: fn(&FittedParameter) -> Option<String>| {
        let cell = |fitted| text(fitted).unwrap_or_else(|| NOTHING.to_owned());
        rows.push(owned([name, "", &cell(&calibration.gamma), &cell(&calibration.b0), "", ""]));
    };
    if names.len() > 1 {
        summary("mean", |fitted| Some(to_precision(fitted.value, fitted.spread.unwrap_or(0.0))));
    }
    summary("std", |fitted| fitted.spread.map(|spread| significant(spread, 2)));
    summary("95%", |fitted| {
        let [low, high] = fitted.interval?.map(|end| to_precision(end, fitted.spread.unwrap_or(0.0)));
        Some(format!("[{low}, {high}]"))
    });
    let title = "Line tension gamma* and near-wall drag b0* of least Delta_v".to_owned();
    let headers = owned(["trial", "frames", "gamma*", "b0*", "Delta_v", "Delta_A"]);
    let note = if weighed { NOTE_WEIGHED } else { NOTE };
    let spread = if names.len() > 1 { MANY } else { ONE };
    format!("{}{note}{spread}", TextTable { title, headers, rows, names: 1, keys: 1 }.text())
}

//! Cells of a file of frames: their places in the text, and the numbers in them.

use csv::StringRecord;
use std::ops::Range;

/// Farthest from the orifice that a frame may be, in sigma.
const FARTHEST: f64 = 1000.0;

/// The bytes of a record's first line.
pub(super) fn line(text: &str, record: &StringRecord) -> Range<usize> {
    line_at(text, record.position().map_or(0, |position| position.byte() as usize))
}

/// The bytes of the first line at or after byte `at` that is not blank.
pub(super) fn line_at(text: &str, at: usize) -> Range<usize> {
    // The reader puts a record that follows blank lines at the first of these.
    let rest = &text[at.min(text.len())..];
    let start = text.len() - rest.trim_start_matches(['\r', '\n']).len();
    let length = text[start..].find(['\r', '\n']).unwrap_or(text.len() - start);
    start..start + length
}

/// The bytes of each cell. The CSV reader knows only where records begin. If a record has quotes, each of its cells is
/// given the whole line.
pub(super) fn cells(text: &str, record: &StringRecord) -> Vec<Range<usize>> {
    let line = line(text, record);
    if !text[line.clone()].split(',').eq(record) {
        return vec![line; record.len()];
    }
    let mut start = line.start;
    let span = |cell: &str| {
        let span = start..start + cell.len();
        start = span.end + 1;
        span
    };
    record.iter().map(span).collect()
}

/// The number in a cell, if the column allows it; otherwise what is wrong, and what to write.
pub(super) fn number(column: &str, cell: &str) -> Result<f64, (String, &'static str)> {
    if cell.is_empty() {
        return Err(("the cell is empty".to_owned(), "write a number, or take the line out"));
    }
    let value: f64 =
        cell.parse().map_err(|_| (format!("`{cell}` is not a number"), "write a number, like -0.35 or 1e-3"))?;
    if !value.is_finite() {
        return Err((format!("`{cell}` is not finite"), "take the line out where nothing was measured"));
    }
    match column {
        "h" if value.abs() > FARTHEST => {
            Err((format!("{cell} is too far away"), "h is in droplet diameters, at most 1000 from the orifice"))
        }
        "shape" if value <= 0.0 => {
            Err((format!("a shape parameter of {cell} is impossible"), "A = perimeter^2/(4 pi a), 1 for a circle"))
        }
        "v_g_error" | "shape_error" if value <= 0.0 => {
            Err((format!("an error of {cell} is impossible"), "write a standard error above 0, or take the column out"))
        }
        _ => Ok(value),
    }
}

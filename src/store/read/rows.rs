//! Rows that the program worked out itself, written in the formats of a query.

use crate::results::fits::{LambdaFit, SpeedAverage};
use crate::store::read::format::{Format, Sink};
use crate::store::read::parquet_rows::AnswerColumn;
use crate::store::schema::{columns, points};
use crate::study::fits::FittedPoint;
use rusqlite::types::{Value, ValueRef};
use std::io::{Result, Write};

/// A row of `outline` or of `obstacles`, after the job's id.
pub(super) type JobRow = [Value; 4];

/// Writes rows under the names of their columns.
///
/// # Errors
/// What writing to `out` reports.
pub(crate) fn write_rows(
    names: &[&str],
    rows: impl IntoIterator<Item = Vec<Value>>,
    format: Format,
    out: &mut dyn Write,
) -> Result<()> {
    // Columns of fits have the types of the views; what is unknown there, the rows decide.
    let known = |name: &str| columns::column("lambda_fits", name).or_else(|| columns::column("speed_averages", name));
    let column = |&name: &&str| AnswerColumn { name: name.to_owned(), kind: known(name).map(|column| column.kind) };
    let columns = names.iter().map(column).collect();
    let mut sink = Sink::begin(format, columns, Vec::new(), out)?;
    for row in rows {
        let values: Vec<ValueRef<'_>> = row.iter().map(ValueRef::from).collect();
        sink.row(&values)?;
    }
    sink.end()
}

/// The columns of a fit beside `point_id` and the parameters; named as in the views `lambda_fits` and `speed_averages`.
const FIT: [&str; 13] = [
    "runs",
    "clogs",
    "lambda",
    "lambda_low",
    "lambda_high",
    "lambda_least_squares",
    "p_exponential",
    "runs_for_ten_percent",
    "flowing",
    "v_g",
    "v_g_low",
    "v_g_high",
    "ca",
];

/// Writes fits, a row for each point.
///
/// # Errors
/// What writing to `out` reports.
pub(crate) fn write_fits(fits: &[FittedPoint<'_>], format: Format, out: &mut dyn Write) -> Result<()> {
    let parameters = points::names();
    let names: Vec<&str> = ["point_id"].into_iter().chain(parameters.split(", ")).chain(FIT).collect();
    let row = |fit: &FittedPoint<'_>| {
        let mut row = vec![Value::from(fit.point.point_id.to_string())];
        row.extend(points::values(&fit.point.point));
        row.extend(fitted(&fit.lambda, &fit.speed));
        row
    };
    write_rows(&names, fits.iter().map(row), format, out)
}

/// The values of [`FIT`].
fn fitted(lambda: &LambdaFit, speed: &SpeedAverage) -> [Value; 13] {
    [
        lambda.runs.into(),
        lambda.clogs.into(),
        lambda.lambda.into(),
        lambda.lambda_low.into(),
        lambda.lambda_high.into(),
        lambda.lambda_least_squares.into(),
        lambda.p_exponential.into(),
        lambda.runs_for_ten_percent.into(),
        speed.flowing.into(),
        speed.v_g.into(),
        speed.v_g_low.into(),
        speed.v_g_high.into(),
        speed.ca.into(),
    ]
}

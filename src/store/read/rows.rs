//! Rows that the program worked out itself, written in the formats of a query.

use crate::results::fits::{LambdaFit, SpeedAverage};
use crate::store::read::format::{Format, Sink};
use crate::store::read::parquet_rows::AnswerColumn;
use crate::store::schema::columns::{Kind, column};
use crate::store::schema::points;
use crate::study::fits::FittedPoint;
use rusqlite::types::{Value, ValueRef};
use std::io::{Result, Write};

/// A row of `outline` or of `obstacles`, after the job's id.
pub(super) type JobRow = [Value; 4];

/// Writes rows under the names of their columns. The types are stated, so they do not depend on the rows at hand.
///
/// # Errors
/// What writing to `out` reports.
pub(crate) fn write_rows(
    columns: &[(&str, Kind)],
    rows: impl IntoIterator<Item = Vec<Value>>,
    format: Format,
    out: &mut dyn Write,
) -> Result<()> {
    let column = |&(name, kind): &(&str, Kind)| AnswerColumn { name: name.to_owned(), kind: Some(kind) };
    let mut sink = Sink::begin(format, columns.iter().map(column).collect(), Vec::new(), out)?;
    for row in rows {
        let values: Vec<ValueRef<'_>> = row.iter().map(ValueRef::from).collect();
        sink.row(&values)?;
    }
    sink.end()
}

/// The columns of a fit beside `point_id` and the parameters; named as in the views `lambda_fits` and `speed_averages`.
const FIT: [&str; 22] = [
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
    "arrested",
    "by_distance",
    "by_time",
    "beyond_box",
    "lambda_if_stuck",
    "weibull_shape",
    "weibull_low",
    "weibull_high",
    "r_from",
];

/// Writes fits, a row for each point.
///
/// # Errors
/// What writing to `out` reports.
pub(crate) fn write_fits(fits: &[FittedPoint<'_>], format: Format, out: &mut dyn Write) -> Result<()> {
    let parameters = points::names();
    let names = ["point_id"].into_iter().chain(parameters.split(", ")).chain(FIT);
    // The types of the two views of fits, which have all of these columns between them.
    let meaning = |name| column("lambda_fits", name).or_else(|| column("speed_averages", name));
    let columns: Vec<_> = names.map(|name| (name, meaning(name).map_or(Kind::Number, |column| column.kind))).collect();
    let row = |fit: &FittedPoint<'_>| {
        let mut row = vec![Value::from(fit.point.point_id.to_string())];
        row.extend(points::values(&fit.point.point));
        row.extend(fitted(&fit.lambda, &fit.speed));
        row
    };
    write_rows(&columns, fits.iter().map(row), format, out)
}

/// The values of [`FIT`].
fn fitted(lambda: &LambdaFit, speed: &SpeedAverage) -> [Value; 22] {
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
        lambda.arrested.into(),
        lambda.by_distance.into(),
        lambda.by_time.into(),
        lambda.beyond_box.into(),
        lambda.lambda_if_stuck.into(),
        lambda.weibull_shape.into(),
        lambda.weibull_low.into(),
        lambda.weibull_high.into(),
        lambda.r_from.into(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    #[test]
    fn the_types_of_columns_do_not_depend_on_the_rows() {
        let types = |rows: Vec<Vec<Value>>| {
            let mut file = tempfile::tempfile().unwrap();
            let columns = [("file", Kind::Text), ("jobs", Kind::Whole), ("cpu_s", Kind::Number)];
            write_rows(&columns, rows, Format::Parquet, &mut file).unwrap();
            let builder = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
            builder.schema().fields().iter().map(|field| field.data_type().clone()).collect::<Vec<_>>()
        };
        let full = types(vec![vec!["a".to_owned().into(), 1_i64.into(), 0.5.into()]]);
        assert_eq!(full, types(Vec::new()));
        assert_eq!(full, types(vec![vec![Value::Null, Value::Null, Value::Null]]));
    }
}

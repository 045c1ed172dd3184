//! Rows as text or Parquet: a table for people, CSV, JSON and Parquet for programs.
//!
//! Programs get numbers with all their digits, so that they read back bit for bit; people get six digits.
//!
//! CSV is written here and not by the `csv` crate, which writes NULL and the empty text alike. Here NULL is nothing and
//! the empty text is `""`.

use crate::parameters::plain;
use crate::store::read::parquet_rows::{AnswerColumn, ParquetRows};
use comfy_table::{Cell, CellAlignment, Table, presets};
use parquet::file::metadata::KeyValue;
use rusqlite::types::{Value, ValueRef};
use std::io::{Result, Write};
use std::str::FromStr;

/// The most rows of a table for people, who do not read more; laying one out takes all of it in memory.
pub const MOST_TABLE_ROWS: usize = 10_000;

/// How the answer to a query is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Aligned columns, for reading, at most [`MOST_TABLE_ROWS`] rows; NULL is empty.
    Table,
    /// Comma-separated values (RFC 4180) under a line of names; NULL is empty.
    Csv,
    /// An array of objects, one a line.
    Json,
    /// One Parquet file.
    Parquet,
}

impl Format {
    /// Its name, which also ends the names of its files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table => "table",
            Self::Csv => "csv",
            Self::Json => "json",
            Self::Parquet => "parquet",
        }
    }
}

impl FromStr for Format {
    type Err = String;
    fn from_str(name: &str) -> std::result::Result<Self, String> {
        match name {
            "table" => Ok(Self::Table),
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            "parquet" => Ok(Self::Parquet),
            _ => Err(format!("`{name}` is not a format: choose table, csv, json or parquet")),
        }
    }
}

/// Writes the rows of an answer in one of the formats.
pub(super) struct Sink<'a> {
    format: Format,
    names: Vec<String>,
    out: &'a mut dyn Write,
    /// All rows so far of a table, whose form depends on them.
    kept: Vec<Vec<Value>>,
    /// The file, if it is one.
    parquet: Option<ParquetRows>,
    rows: usize,
}

impl<'a> Sink<'a> {
    /// Writes whatever comes before the rows.
    pub(super) fn begin(
        format: Format,
        columns: Vec<AnswerColumn>,
        metadata: Vec<KeyValue>,
        out: &'a mut dyn Write,
    ) -> Result<Self> {
        let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
        match format {
            Format::Csv => {
                let names: Vec<String> = names.iter().map(|name| csv_text(name)).collect();
                writeln!(out, "{}", names.join(","))?;
            }
            Format::Json => write!(out, "[")?,
            Format::Table | Format::Parquet => {}
        }
        let names = if matches!(format, Format::Json | Format::Parquet) { distinct(names) } else { names };
        let parquet = (format == Format::Parquet).then(|| {
            let kinds = columns.iter().map(|column| column.kind);
            let columns = names.iter().cloned().zip(kinds).map(|(name, kind)| AnswerColumn { name, kind });
            ParquetRows::new(columns.collect(), metadata)
        });
        Ok(Self { format, names, out, kept: Vec::new(), parquet, rows: 0 })
    }

    /// Whether no further row can be taken.
    pub(super) fn is_full(&self) -> bool {
        self.format == Format::Table && self.rows == MOST_TABLE_ROWS
    }

    /// Takes one row.
    pub(super) fn row(&mut self, values: &[ValueRef<'_>]) -> Result<()> {
        self.rows += 1;
        match self.format {
            Format::Csv => {
                let cells: Vec<String> = values.iter().map(|value| csv_cell(*value)).collect();
                writeln!(self.out, "{}", cells.join(","))
            }
            Format::Json => {
                let members = self.names.iter().zip(values);
                let members: Vec<String> =
                    members.map(|(name, value)| format!("{}:{}", json_text(name), json_cell(*value))).collect();
                write!(self.out, "{}{{{}}}", if self.rows == 1 { "\n" } else { ",\n" }, members.join(","))
            }
            Format::Parquet => self.parquet.as_mut().map_or(Ok(()), |file| file.row(values, self.out)),
            Format::Table => {
                self.kept.push(values.iter().map(|value| shown(*value)).collect());
                Ok(())
            }
        }
    }

    /// Writes whatever comes after the rows.
    pub(super) fn end(self) -> Result<()> {
        match self.format {
            Format::Csv => {}
            Format::Json => writeln!(self.out, "\n]")?,
            Format::Table => writeln!(self.out, "{}", table(&self.names, &self.kept))?,
            Format::Parquet => self.parquet.map_or(Ok(()), |file| file.end(self.out))?,
        }
        self.out.flush()
    }
}

/// Numbers names that occur twice, as in `t, r, t_2`, for formats where a name must mean one column.
fn distinct(names: Vec<String>) -> Vec<String> {
    let mut distinct: Vec<String> = Vec::with_capacity(names.len());
    for name in names {
        let numbered = (2..).map(|number| format!("{name}_{number}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(|name| !distinct.contains(name));
        distinct.extend(free);
    }
    distinct
}

fn owned(value: ValueRef<'_>) -> Value {
    match value {
        ValueRef::Null => Value::Null,
        ValueRef::Integer(number) => Value::Integer(number),
        ValueRef::Real(number) => Value::Real(number),
        ValueRef::Text(bytes) => Value::Text(text(bytes)),
        ValueRef::Blob(bytes) => Value::Blob(bytes.to_owned()),
    }
}

/// A value as a table shows it: a text on one line, and of bytes, how many they are.
fn shown(value: ValueRef<'_>) -> Value {
    match value {
        ValueRef::Blob(bytes) => Value::Text(format!("<{} bytes>", bytes.len())),
        ValueRef::Text(bytes) => Value::Text(plain(&text(bytes)).into_owned()),
        other => owned(other),
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn csv_cell(value: ValueRef<'_>) -> String {
    match value {
        ValueRef::Null => String::new(),
        ValueRef::Integer(number) => number.to_string(),
        ValueRef::Real(number) => format!("{number:?}"),
        ValueRef::Text([]) => "\"\"".to_owned(),
        ValueRef::Text(bytes) => csv_text(&text(bytes)),
        ValueRef::Blob(bytes) => hex(bytes),
    }
}

/// A text as a cell. Spreadsheets take a text that begins with `=` or the like for a formula, and run it; with an
/// apostrophe before it, it is a text. Numbers are left as they are.
fn csv_text(text: &str) -> String {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    let text = &*if is_formula { format!("'{text}") } else { text.to_owned() };
    match text.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

fn json_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn json_cell(value: ValueRef<'_>) -> String {
    match value {
        ValueRef::Null => "null".to_owned(),
        ValueRef::Integer(number) => number.to_string(),
        // JSON has no infinity: it becomes null.
        ValueRef::Real(number) => serde_json::Value::from(number).to_string(),
        ValueRef::Text(bytes) => json_text(&text(bytes)),
        ValueRef::Blob(bytes) => json_text(&hex(bytes)),
    }
}

fn table(names: &[String], rows: &[Vec<Value>]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    let is_number =
        |column: usize| rows.iter().all(|row| matches!(row[column], Value::Null | Value::Integer(_) | Value::Real(_)));
    let alignment: Vec<CellAlignment> = (0..names.len())
        .map(|column| if is_number(column) { CellAlignment::Right } else { CellAlignment::Left })
        .collect();
    let aligned = |(text, alignment): (String, &CellAlignment)| Cell::new(text).set_alignment(*alignment);
    table.set_header(names.iter().map(|name| plain(name).into_owned()).zip(&alignment).map(aligned));
    for row in rows {
        table.add_row(row.iter().map(table_cell).zip(&alignment).map(aligned));
    }
    table
}

fn table_cell(value: &Value) -> String {
    match value {
        Value::Real(number) => {
            let six_digits: f64 = format!("{number:.5e}").parse().unwrap_or(*number);
            format!("{six_digits:?}")
        }
        Value::Text(text) => text.clone(),
        other => csv_cell(other.into()),
    }
}

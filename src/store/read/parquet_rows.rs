//! Rows as one Parquet file, written while they come.
//!
//! The type of a column comes from its declaration, not from the rows at hand, so that it is the same in the files of
//! any two stores, with rows or without. A column of a table or a view has its declared type, and an expression the one
//! that SQLite infers, as from `CAST(... AS INTEGER)`. Where SQLite infers none, as for `avg(...)`, the column holds
//! numbers (double), or text if a text is among its first rows.

use crate::store::schema::columns::Kind;
use arrow_array::{ArrayRef, BinaryArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use rusqlite::types::{Value, ValueRef};
use rusqlite::{Connection, Statement};
use std::io::{Error, Result, Write};
use std::sync::Arc;

/// Rows that become one Arrow batch.
const BATCH_ROWS: usize = 16 * 1024;

/// Rows of a row group, at most: what is held in memory.
const GROUP_ROWS: usize = 128 * 1024;

/// A column of an answer; no kind, where nothing but rows can tell.
#[derive(Clone, Debug)]
pub(super) struct AnswerColumn {
    pub name: String,
    pub kind: Option<Kind>,
}

/// The columns of the answer to a statement.
pub(super) fn columns_of(conn: &Connection, statement: &Statement<'_>) -> Vec<AnswerColumn> {
    let inferred = statement.expanded_sql().and_then(|sql| inferred(conn, &sql).ok()).unwrap_or_default();
    // `BLOB` is what SQLite says where it infers nothing.
    let inferred = |index: usize| inferred.get(index).map(String::as_str).filter(|kind| !["", "BLOB"].contains(kind));
    let kind = |index: usize, declared: Option<&str>| declared.or_else(|| inferred(index)).map(Kind::declared);
    let column = |(index, column): (usize, rusqlite::Column<'_>)| AnswerColumn {
        name: column.name().to_owned(),
        kind: kind(index, column.decl_type()),
    };
    statement.columns().enumerate().map(column).collect()
}

/// The types that SQLite infers for the columns of an answer, if it were a view; empty where it infers none.
fn inferred(conn: &Connection, sql: &str) -> rusqlite::Result<Vec<String>> {
    // A view of this connection alone, which lasts no longer than this question.
    conn.pragma_update(None, "query_only", false)?;
    let ask = || {
        conn.execute_batch(&format!("CREATE TEMP VIEW types_of_answer AS {sql}"))?;
        let mut statement = conn.prepare("SELECT type FROM pragma_table_info('types_of_answer') ORDER BY cid")?;
        statement.query_map([], |row| row.get(0))?.collect()
    };
    let types = ask();
    let dropped = conn.execute_batch("DROP VIEW IF EXISTS temp.types_of_answer");
    conn.pragma_update(None, "query_only", true)?;
    dropped.and(types)
}

/// A Parquet file that is being written.
pub(super) struct ParquetRows {
    columns: Vec<AnswerColumn>,
    metadata: Vec<KeyValue>,
    /// The rows of the next batch, by column.
    kept: Vec<Vec<Value>>,
    /// There once the first batch settled the last types.
    writer: Option<ArrowWriter<Vec<u8>>>,
}

impl ParquetRows {
    /// A file of these columns, whose names are distinct, with these entries in its metadata.
    pub(super) fn new(columns: Vec<AnswerColumn>, metadata: Vec<KeyValue>) -> Self {
        let kept = columns.iter().map(|_| Vec::new()).collect();
        Self { columns, metadata, kept, writer: None }
    }

    /// Takes one row.
    pub(super) fn row(&mut self, values: &[ValueRef<'_>], out: &mut dyn Write) -> Result<()> {
        for (column, value) in self.kept.iter_mut().zip(values) {
            column.push(Value::try_from(*value).map_err(Error::other)?);
        }
        if self.kept.first().is_some_and(|column| column.len() == BATCH_ROWS) { self.batch(out) } else { Ok(()) }
    }

    /// Writes what is left, and the end of the file.
    pub(super) fn end(mut self, out: &mut dyn Write) -> Result<()> {
        self.batch(out)?;
        let rest = self.writer.take().map(ArrowWriter::into_inner).transpose()?;
        out.write_all(&rest.unwrap_or_default())
    }

    /// Hands the rows so far to the writer, and what that has finished to `out`.
    fn batch(&mut self, out: &mut dyn Write) -> Result<()> {
        for (column, values) in self.columns.iter_mut().zip(&self.kept) {
            column.kind.get_or_insert_with(|| kind_of(values));
        }
        let fields = self.columns.iter().map(|column| Field::new(&column.name, data_type(column.kind), true));
        let schema: SchemaRef = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
        let arrays =
            self.columns.iter().zip(&mut self.kept).map(|(column, values)| array(column, std::mem::take(values)));
        let batch = RecordBatch::try_new(schema.clone(), arrays.collect::<Result<_>>()?).map_err(Error::other)?;
        let writer = match &mut self.writer {
            Some(writer) => writer,
            None => self.writer.insert(open(schema, std::mem::take(&mut self.metadata))?),
        };
        writer.write(&batch)?;
        let finished = std::mem::take(writer.inner_mut());
        out.write_all(&finished)
    }
}

fn open(schema: SchemaRef, metadata: Vec<KeyValue>) -> parquet::errors::Result<ArrowWriter<Vec<u8>>> {
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_key_value_metadata(Some(metadata))
        .build();
    let options = ArrowWriterOptions::new().with_properties(properties).with_skip_arrow_metadata(true);
    ArrowWriter::try_new_with_options(Vec::new(), schema, options)
}

/// The kind of a column of which only values can tell.
fn kind_of(values: &[Value]) -> Kind {
    let is_text = |value: &Value| matches!(value, Value::Text(_) | Value::Blob(_));
    if values.iter().any(is_text) { Kind::Text } else { Kind::Number }
}

fn data_type(kind: Option<Kind>) -> DataType {
    match kind {
        Some(Kind::Text) => DataType::Utf8,
        Some(Kind::Whole) => DataType::Int64,
        Some(Kind::Bytes) => DataType::Binary,
        Some(Kind::Number) | None => DataType::Float64,
    }
}

fn array(column: &AnswerColumn, values: Vec<Value>) -> Result<ArrayRef> {
    let values = values.into_iter();
    Ok(match column.kind.unwrap_or(Kind::Number) {
        Kind::Whole => Arc::new(values.map(|value| whole(column, value)).collect::<Result<Int64Array>>()?),
        Kind::Number => Arc::new(values.map(|value| number(column, value)).collect::<Result<Float64Array>>()?),
        Kind::Bytes => Arc::new(values.map(|value| bytes(column, value)).collect::<Result<BinaryArray>>()?),
        Kind::Text => Arc::new(values.map(|value| as_text(&value)).collect::<StringArray>()),
    })
}

fn whole(column: &AnswerColumn, value: Value) -> Result<Option<i64>> {
    match value {
        Value::Null => Ok(None),
        Value::Integer(number) => Ok(Some(number)),
        other => Err(misfit(column, &other)),
    }
}

fn number(column: &AnswerColumn, value: Value) -> Result<Option<f64>> {
    match value {
        Value::Null => Ok(None),
        Value::Integer(number) => Ok(Some(number as f64)),
        Value::Real(number) => Ok(Some(number)),
        other => Err(misfit(column, &other)),
    }
}

fn bytes(column: &AnswerColumn, value: Value) -> Result<Option<Vec<u8>>> {
    match value {
        Value::Null => Ok(None),
        Value::Blob(bytes) => Ok(Some(bytes)),
        Value::Text(text) => Ok(Some(text.into_bytes())),
        other => Err(misfit(column, &other)),
    }
}

/// A value that a column of its type cannot hold.
fn misfit(column: &AnswerColumn, value: &Value) -> Error {
    let (name, kind) = (&column.name, column.kind.unwrap_or(Kind::Number).name());
    let value = as_text(value).unwrap_or_default();
    Error::other(format!(
        "a Parquet column has one type, and {name} is {kind}, but a row holds `{value}`: CAST(... AS TEXT) AS {name} \
         takes every value"
    ))
}

fn as_text(value: &Value) -> Option<String> {
    match value {
        Value::Null => None,
        Value::Integer(number) => Some(number.to_string()),
        Value::Real(number) => Some(format!("{number:?}")),
        Value::Text(text) => Some(text.clone()),
        Value::Blob(bytes) => Some(bytes.iter().map(|byte| format!("{byte:02x}")).collect()),
    }
}

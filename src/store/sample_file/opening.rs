//! Whether a Parquet file is one of ours, before a row of it is read.
//!
//! A checksum in a catalogue says that a file is what the catalogue was made for. It does not say that this program
//! made either. So nothing in the file is believed: the schema must be the one that sample files have, and no number in
//! it may make the Parquet library reserve memory that the file does not account for.

use crate::store::sample_file::thrift::walk;
use crate::store::sample_file::{COLUMNS, schema};
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::basic::{Repetition, Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::{ColumnChunkMetaData, PageIndexPolicy, ParquetMetaData, ParquetMetaDataReader};
use parquet::schema::types::SchemaDescriptor;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::sync::Arc;

/// Bytes at the end of a file: the length of the footer and a magic word.
const TAIL: u64 = 8;
const MAGIC: &[u8; 4] = b"PAR1";

/// Largest footer and largest index, in bytes. A row group takes 2 KB of a footer.
const LARGEST_FOOTER: u64 = 4 << 20;

/// Largest page, in bytes and unpacked. Ours have 64 KB, and up to 1 MB in a dictionary of ids.
const LARGEST_PAGE: i64 = 4 << 20;

/// Largest head of a page, in bytes.
const LARGEST_HEAD: usize = 4096;

/// Most rows for each byte of a file. A row has nine values, and not all of them stand still.
const MOST_ROWS_A_BYTE: u64 = 4;

/// The encodings of pages that any version of this program writes, by their numbers in the format: plain, the two by
/// dictionary, byte-stream split.
const ENCODINGS: [i64; 4] = [0, 2, 8, 9];

/// Reads what a file says of itself, and refuses it unless it is a sample file.
pub(super) fn metadata(file: &File) -> Result<ArrowReaderMetadata> {
    let bytes = file.metadata()?.len();
    check_footer(file, bytes)?;
    let mut metadata =
        ParquetMetaDataReader::new().with_page_index_policy(PageIndexPolicy::Skip).parse_and_finish(file)?;
    check_schema(metadata.file_metadata().schema_descr())?;
    check_rows(&metadata, bytes)?;
    for column in metadata.row_groups().iter().flat_map(|group| group.columns()) {
        check_index(file, column, bytes)?;
        check_pages(file, column, bytes)?;
    }
    let mut reader =
        ParquetMetaDataReader::new_with_metadata(metadata).with_offset_index_policy(PageIndexPolicy::Optional);
    reader.read_page_indexes(file)?;
    metadata = reader.finish()?;
    // The same Arrow types for files of every version, whatever they say themselves.
    ArrowReaderMetadata::try_new(Arc::new(metadata), ArrowReaderOptions::new().with_schema(schema()))
}

fn refuse<T>(problem: impl Into<String>) -> Result<T> {
    Err(ParquetError::General(problem.into()))
}

/// Bytes of a file, at most so many as there are.
fn bytes_at(file: &File, at: u64, most: usize) -> Result<Vec<u8>> {
    let (mut bytes, mut length) = (vec![0; most], 0);
    while length < most {
        match file.read_at(&mut bytes[length..], at + length as u64)? {
            0 => break,
            read => length += read,
        }
    }
    bytes.truncate(length);
    Ok(bytes)
}

fn check_footer(file: &File, bytes: u64) -> Result<()> {
    let tail = bytes_at(file, bytes.saturating_sub(TAIL), TAIL as usize)?;
    let Some((length, _)) = tail.split_first_chunk::<4>().filter(|(_, magic)| magic == MAGIC) else {
        return refuse("it does not end as Parquet files do");
    };
    let length = u64::from(u32::from_le_bytes(*length));
    if length > LARGEST_FOOTER || length + TAIL > bytes {
        return refuse(format!("its footer cannot have {length} bytes"));
    }
    check_structure(&bytes_at(file, bytes - TAIL - length, length as usize)?)
}

fn check_structure(bytes: &[u8]) -> Result<()> {
    walk(bytes, &mut |_, _| {}).map_or_else(|| refuse("the lengths in its footer contradict each other"), |_| Ok(()))
}

/// The columns are those of a sample file: their names, their types, and which of them may lack a value.
fn check_schema(found: &SchemaDescriptor) -> Result<()> {
    if found.num_columns() != COLUMNS.len() {
        return refuse(format!("it has {} columns, and a sample file has {}", found.num_columns(), COLUMNS.len()));
    }
    for (column, field) in found.columns().iter().zip(schema().fields()) {
        let wanted = if field.name() == COLUMNS[0] { Type::BYTE_ARRAY } else { Type::DOUBLE };
        let (name, kind) = (column.path().string(), column.physical_type());
        let repetition = column.self_type().get_basic_info().repetition();
        let flat = column.max_rep_level() == 0 && column.max_def_level() <= 1;
        let as_wanted = name == *field.name() && kind == wanted && flat;
        if !as_wanted || (repetition == Repetition::OPTIONAL && !field.is_nullable()) {
            let (field, name) = (field.name(), crate::parameters::plain(&name));
            return refuse(format!("where a sample file has its column {field}, it has {name} of type {kind}"));
        }
    }
    Ok(())
}

/// The rows of the groups are those of the file, and not more than so many bytes can hold.
fn check_rows(metadata: &ParquetMetaData, bytes: u64) -> Result<()> {
    let all = u64::try_from(metadata.file_metadata().num_rows()).ok();
    let mut sum = Some(0_u64);
    for group in metadata.row_groups() {
        let rows = u64::try_from(group.num_rows()).ok();
        sum = sum.zip(rows).and_then(|(sum, rows)| sum.checked_add(rows));
        let as_many = |column: &ColumnChunkMetaData| u64::try_from(column.num_values()).ok() == rows;
        if group.num_columns() != COLUMNS.len() || !group.columns().iter().all(as_many) {
            return refuse("its columns differ in length");
        }
    }
    match all {
        Some(rows) if all == sum && rows <= bytes * MOST_ROWS_A_BYTE => Ok(()),
        _ => refuse(format!("{bytes} bytes cannot hold the rows that it claims")),
    }
}

/// The index of the pages of a column, if it has one, is a structure that fits its bytes.
fn check_index(file: &File, column: &ColumnChunkMetaData, bytes: u64) -> Result<()> {
    let (Some(at), Some(length)) = (column.offset_index_offset(), column.offset_index_length()) else { return Ok(()) };
    let (at, length) = (u64::try_from(at).unwrap_or(u64::MAX), u64::try_from(length).unwrap_or(u64::MAX));
    if length > LARGEST_FOOTER || at.saturating_add(length) > bytes {
        return refuse("the index of its pages lies outside of it");
    }
    check_structure(&bytes_at(file, at, length as usize)?)
}

/// No page of a column is larger, unpacked, than pages are, and all are encoded as this program encodes.
fn check_pages(file: &File, column: &ColumnChunkMetaData, bytes: u64) -> Result<()> {
    let (mut at, length) = column.byte_range();
    let end = at.saturating_add(length);
    if end > bytes {
        return refuse("a column of it lies outside of it");
    }
    while at < end {
        let head = bytes_at(file, at, LARGEST_HEAD.min((end - at) as usize))?;
        let (mut unpacked, mut packed, mut encoding) = (None, None, None);
        // Fields 5, 7 and 8 are the heads of a data page, a dictionary, and a data page of version 2.
        let taken = walk(&head, &mut |path, number| match path {
            [2] => unpacked = Some(number),
            [3] => packed = u64::try_from(number).ok(),
            [5, 2] | [7, 2] | [8, 4] => encoding = Some(number),
            _ => {}
        });
        let (Some(taken), Some(packed)) = (taken, packed) else { return refuse("a page of it has no sound head") };
        if !unpacked.is_some_and(|size| (0..=LARGEST_PAGE).contains(&size)) {
            return refuse("a page of it is larger than pages of sample files are");
        }
        if !encoding.is_some_and(|encoding| ENCODINGS.contains(&encoding)) {
            return refuse("a page of it is encoded as no sample file is");
        }
        at = at.saturating_add(taken as u64).saturating_add(packed);
    }
    if at == end { Ok(()) } else { refuse("a page of it ends outside of its column") }
}

//! Parquet files that are no sample files, or that lie about themselves.

use arrow_array::builder::{Float64Builder, ListBuilder};
use arrow_array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, ZstdLevel};
use parquet::file::properties::WriterProperties;
use std::sync::Arc;

/// What is wrong with a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Odd {
    /// The times are texts.
    Texts,
    /// The times are whole numbers.
    Integers,
    /// The times are lists.
    Lists,
    /// The ids are numbers.
    NumbersForIds,
    /// A column is missing.
    FewColumns,
    /// The columns have other names.
    OtherNames,
    /// Some ids are missing.
    MissingIds,
    /// Twenty million rows of ids that alternate, in less than a megabyte.
    AlternatingIds,
    /// A page of 64 MB of zeros, in some kilobytes.
    LargePage,
    /// Encoded as this program never encodes.
    OtherEncoding,
    /// The footer says that it has 2^31 - 1 row groups.
    ManyGroups,
    /// The footer says that it has a million times as many rows.
    ManyRows,
    /// No Parquet file.
    Noise,
}

impl Odd {
    pub const ALL: [Self; 13] = [
        Self::Texts,
        Self::Integers,
        Self::Lists,
        Self::NumbersForIds,
        Self::FewColumns,
        Self::OtherNames,
        Self::MissingIds,
        Self::AlternatingIds,
        Self::LargePage,
        Self::OtherEncoding,
        Self::ManyGroups,
        Self::ManyRows,
        Self::Noise,
    ];
}

const NAMES: [&str; 9] = ["job_id", "t", "r", "h", "y", "v_g", "ek_ratio", "shape", "area_error"];

fn ids(rows: usize) -> ArrayRef {
    let id = |row: usize| Some(if row.is_multiple_of(2) { "0123456789abcdef0123" } else { "0123456789abcdef0124" });
    Arc::new((0..rows).map(id).collect::<StringArray>())
}

fn zeros(rows: usize) -> ArrayRef {
    Arc::new(Float64Array::from(vec![0.0; rows]))
}

/// A file of these columns, all with a value in every row.
fn file(names: &[&str], columns: Vec<ArrayRef>, properties: WriterProperties) -> Vec<u8> {
    let nullable = |column: &ArrayRef| arrow_array::Array::null_count(column) > 0;
    let columns: Vec<_> = names.iter().zip(columns).map(|(name, column)| (*name, nullable(&column), column)).collect();
    let batch = RecordBatch::try_from_iter_with_nullable(
        columns.into_iter().map(|(name, nullable, column)| (name, column, nullable)),
    )
    .unwrap();
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, batch.schema(), Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

fn properties() -> parquet::file::properties::WriterPropertiesBuilder {
    WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::try_new(3).unwrap()))
}

/// Nine sound columns with another one in the place of the times.
fn with_times(times: ArrayRef, rows: usize) -> Vec<u8> {
    let mut columns: Vec<ArrayRef> = vec![ids(rows)];
    columns.extend((1..9).map(|_| zeros(rows)));
    columns[1] = times;
    file(&NAMES, columns, properties().build())
}

/// A file with this fault; `sound` is one without.
pub fn odd_file(odd: Odd, sound: &[u8]) -> Vec<u8> {
    let all = |rows: usize| std::iter::once(ids(rows)).chain((1..9).map(|_| zeros(rows))).collect::<Vec<_>>();
    match odd {
        Odd::Texts => with_times(Arc::new(StringArray::from(vec!["x"; 40])), 40),
        Odd::Integers => with_times(Arc::new(Int64Array::from(vec![7; 40])), 40),
        Odd::Lists => {
            let mut lists = ListBuilder::new(Float64Builder::new());
            (0..40).for_each(|_| lists.append_value([Some(1.0), Some(2.0)]));
            with_times(Arc::new(lists.finish()), 40)
        }
        Odd::NumbersForIds => {
            let mut columns = all(40);
            columns[0] = zeros(40);
            file(&NAMES, columns, properties().build())
        }
        Odd::FewColumns => file(&NAMES[..8], all(40)[..8].to_vec(), properties().build()),
        Odd::OtherNames => file(&["a", "b", "c", "d", "e", "f", "g", "h", "i"], all(40), properties().build()),
        Odd::MissingIds => {
            let mut columns = all(40);
            columns[0] = Arc::new((0..40).map(|row| (row % 2 == 0).then_some("x")).collect::<StringArray>());
            file(&NAMES, columns, properties().build())
        }
        Odd::AlternatingIds => file(
            &NAMES,
            all(20_000_000),
            properties().set_statistics_enabled(parquet::file::properties::EnabledStatistics::None).build(),
        ),
        Odd::LargePage => {
            let properties = properties().set_dictionary_enabled(false).set_data_page_size_limit(1 << 30);
            file(
                &NAMES,
                all(8 << 20),
                properties.set_data_page_row_count_limit(usize::MAX).set_write_batch_size(8 << 20).build(),
            )
        }
        Odd::OtherEncoding => {
            let properties = properties().set_dictionary_enabled(false);
            let column = parquet::schema::types::ColumnPath::from("job_id");
            file(&NAMES, all(40), properties.set_column_encoding(column, Encoding::DELTA_BYTE_ARRAY).build())
        }
        Odd::ManyGroups => {
            // The list of row groups is field 4 of the footer, a list of structures with one element: 0x19 0x1c.
            let mut bytes = sound.to_vec();
            let footer = footer(&bytes);
            let place =
                (footer.start..footer.end).rev().find(|&at| bytes[at..].starts_with(&[0x19, 0x1c, 0x19])).unwrap();
            bytes.splice(place + 1..place + 2, [0xfc, 0xff, 0xff, 0xff, 0xff, 0x07]);
            with_footer_length(bytes, footer.len() + 5)
        }
        Odd::ManyRows => {
            // The number of rows is field 3 of the footer, just before that list.
            let mut bytes = sound.to_vec();
            let footer = footer(&bytes);
            let list =
                (footer.start..footer.end).rev().find(|&at| bytes[at..].starts_with(&[0x19, 0x1c, 0x19])).unwrap();
            let place = (footer.start..list).rev().find(|&at| bytes[at] == 0x16).unwrap();
            let old = list - place - 1;
            bytes.splice(place + 1..list, [0xfe, 0xff, 0xff, 0xff, 0xff, 0x3f]);
            with_footer_length(bytes, footer.len() + 6 - old)
        }
        Odd::Noise => b"PAR1 this is no Parquet file PAR1".to_vec(),
    }
}

fn footer(bytes: &[u8]) -> std::ops::Range<usize> {
    let end = bytes.len() - 8;
    let length = u32::from_le_bytes(bytes[end..end + 4].try_into().unwrap()) as usize;
    end - length..end
}

fn with_footer_length(mut bytes: Vec<u8>, length: usize) -> Vec<u8> {
    let end = bytes.len() - 8;
    bytes[end..end + 4].copy_from_slice(&(length as u32).to_le_bytes());
    bytes
}

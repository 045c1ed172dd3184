//! Recorded time series as Parquet: one file for each batch of jobs, never changed, named by the hash of its bytes.
//!
//! The columns are `job_id` (text), `t, r, h, y, v_g, ek_ratio` and the nullable `shape, area_error` (f64, null for
//! SP). The rows of a job follow each other. The catalogue knows the first and how many they are, so that reading one
//! job decodes a page or two of each column.
//!
//! Other programs read these files too, old ones among them (`docs/reading.md`). So numbers are stored plain, texts by
//! dictionary, and nothing in a file says how Arrow would hold it. A row of 72 bytes takes 40 with zstd level 3 and 43
//! with level 1. Byte-stream split would bring it to 35, and fastparquet and pyarrow before 13 could not read it. A
//! dictionary of times gains nothing.
//!
//! `writing.rs` makes a file, `reading.rs` opens one and reads rows. A file that is opened may come from anybody, so it is
//! held against the one schema that these files have (`opening.rs`, with `thrift.rs`) before a row of it is read.

mod opening;
mod reading;
mod thrift;
mod writing;

pub(super) use reading::{Batches, OpenFile, numbers, texts, verify};
pub(super) use writing::{write, write_aside};

use crate::store::entries::SampleName;
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use std::sync::Arc;

/// The columns of a sample file and of the table `samples`, in order.
pub(super) const COLUMNS: [&str; 9] = ["job_id", "t", "r", "h", "y", "v_g", "ek_ratio", "shape", "area_error"];

/// Version of these files, in their metadata under `meniscus_schema` and in the catalogue. Files of version 1 had
/// byte-stream split, and marks that old readers refuse; this program reads both.
pub(super) const SCHEMA_VERSION: u32 = 2;

/// Rows of a data page: what reading one job decodes at least.
pub(super) const PAGE_ROWS: usize = 8 * 1024;

/// Rows of a row group, at most.
const GROUP_ROWS: usize = 1024 * 1024;

/// Rows turned into Arrow arrays at a time.
const CHUNK_ROWS: usize = 64 * 1024;

/// A sample file on disk, as the catalogue lists it.
#[derive(Debug, PartialEq)]
pub(super) struct SampleFile {
    /// Its name.
    pub name: SampleName,
    /// Rows in it.
    pub rows: u64,
    /// Its size.
    pub bytes: u64,
    /// blake3 of its bytes, hexadecimal.
    pub checksum: String,
}

fn schema() -> SchemaRef {
    let text = DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8));
    let fields = COLUMNS.iter().enumerate().map(|(index, name)| match index {
        0 => Field::new(*name, text.clone(), false),
        _ => Field::new(*name, DataType::Float64, index >= 7),
    });
    Arc::new(Schema::new(fields.collect::<Vec<_>>()))
}

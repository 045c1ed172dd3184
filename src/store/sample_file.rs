//! Recorded time series as Parquet: one file for each batch of jobs, never changed, named by the hash of its bytes.
//!
//! The columns are `job_id` (text), `t, r, h, y, v_g, ek_ratio` and the nullable `shape, area_error` (f64, null for
//! SP). The rows of a job follow each other. The catalogue knows the first and how many they are, so that reading one job
//! decodes a page or two of each column.
//!
//! Other programs read these files too, old ones among them (`docs/reading.md`). So numbers are stored plain, texts by
//! dictionary, and nothing in a file says how Arrow would hold it. A row of 72 bytes takes 40 with zstd level 3 and 43
//! with level 1. Byte-stream split would bring it to 35, and fastparquet and pyarrow before 13 could not read it. A
//! dictionary of times gains nothing.

use crate::parameters::JobId;
use crate::results::trajectory::Samples;
use crate::store::error::StoreError;
use crate::store::folders::{aside_dir, samples_dir};
use crate::store::schema::columns::{self, Kind};
use crate::store::{aside, disk};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{ArrayRef, DictionaryArray, Float64Array, Int32Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder, RowSelection,
};
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::arrow::{ArrowWriter, ProjectionMask};
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::{KeyValue, PageIndexPolicy};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use std::fs::File;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
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
    /// Path within the store's folder.
    pub path: String,
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

fn properties() -> parquet::errors::Result<WriterProperties> {
    let kind = |index| if index == 0 { Kind::Text } else { Kind::Number };
    let typed: Vec<_> = COLUMNS.iter().enumerate().map(|(index, name)| (*name, kind(index))).collect();
    let meaning = columns::in_metadata("samples", &typed);
    let version = KeyValue::new("meniscus_schema".to_owned(), SCHEMA_VERSION.to_string());
    Ok(WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3)?))
        .set_dictionary_enabled(false)
        .set_column_dictionary_enabled(COLUMNS[0].into(), true)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_data_page_row_count_limit(PAGE_ROWS)
        .set_write_batch_size(PAGE_ROWS)
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_key_value_metadata(Some(vec![version, meaning]))
        .build())
}

/// A file that is hashed while it is written.
pub(super) struct HashingFile<'a> {
    file: File,
    path: &'a Path,
    hasher: blake3::Hasher,
    /// The number of the first error of the system: the Parquet writer passes on its words alone.
    errno: Option<i32>,
}

impl Write for HashingFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        disk::write(&self.file, self.path, bytes)
            .inspect_err(|error| self.errno = self.errno.or(error.raw_os_error()))?;
        self.hasher.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// Writes the samples of a batch of jobs, one after the other, as a new file of the store in `dir`.
///
/// When this returns the file is complete, safely on disk and under its name. Nobody reads it before it is catalogued.
pub(super) fn write(dir: &Path, jobs: &[(JobId, &Samples)]) -> Result<SampleFile, StoreError> {
    let written = write_half(dir, |writer| write_rows(writer, jobs))?;
    disk::rename(&half(dir), &dir.join(&written.path))?;
    disk::sync_folder(&samples_dir(dir))?;
    Ok(written)
}

/// What writes the rows of a new file.
pub(super) type RowWriter<'a, 'b> = ArrowWriter<&'a mut HashingFile<'b>>;

/// Writes whatever rows `fill` writes as a new file of the store in `dir`. When this returns the file is complete and
/// safely on disk, but still aside.
pub(super) fn write_aside(
    dir: &Path,
    fill: impl FnOnce(&mut RowWriter<'_, '_>) -> parquet::errors::Result<()>,
) -> Result<SampleFile, StoreError> {
    let written = write_half(dir, fill)?;
    disk::rename(&half(dir), &aside::places(dir, &written.path)[1])?;
    disk::sync_folder(&aside_dir(dir))?;
    Ok(written)
}

/// There is one writer, so one half-written file: the next attempt replaces it, or the next opening removes it.
fn half(dir: &Path) -> PathBuf {
    aside_dir(dir).join("batch.tmp")
}

/// Writes a new file whose bytes are safely on disk, but which has no name of its own yet.
fn write_half(
    dir: &Path,
    fill: impl FnOnce(&mut RowWriter<'_, '_>) -> parquet::errors::Result<()>,
) -> Result<SampleFile, StoreError> {
    let half = half(dir);
    let mut written =
        HashingFile { file: disk::create(&half)?, path: &half, hasher: blake3::Hasher::new(), errno: None };
    let rows = write_all(&mut written, fill).map_err(|error| match written.errno {
        Some(number) => StoreError::io(&half)(std::io::Error::from_raw_os_error(number)),
        None => StoreError::parquet(&half)(error),
    })?;
    disk::sync(&written.file, &half)?;
    let bytes = written.file.metadata().map_err(StoreError::io(&half))?.len();
    let checksum = written.hasher.finalize().to_hex();
    let path = format!("samples/{}.parquet", &checksum[..20]);
    Ok(SampleFile { path, rows, bytes, checksum: checksum.to_string() })
}

/// Writes the whole file; returns the number of its rows.
fn write_all(
    file: &mut HashingFile<'_>,
    fill: impl FnOnce(&mut RowWriter<'_, '_>) -> parquet::errors::Result<()>,
) -> parquet::errors::Result<u64> {
    let options = ArrowWriterOptions::new().with_properties(properties()?).with_skip_arrow_metadata(true);
    let mut writer = ArrowWriter::try_new_with_options(file, schema(), options)?;
    fill(&mut writer)?;
    Ok(writer.close()?.file_metadata().num_rows() as u64)
}

fn write_rows(writer: &mut RowWriter<'_, '_>, jobs: &[(JobId, &Samples)]) -> parquet::errors::Result<()> {
    let mut rest = jobs;
    while !rest.is_empty() {
        let mut rows = 0;
        let fits = rest.iter().take_while(|(_, samples)| {
            rows += samples.len();
            rows <= CHUNK_ROWS
        });
        let (chunk, later) = rest.split_at(fits.count().max(1));
        writer.write(&to_arrow(chunk)?)?;
        rest = later;
    }
    Ok(())
}

fn to_arrow(jobs: &[(JobId, &Samples)]) -> parquet::errors::Result<RecordBatch> {
    let names = StringArray::from_iter_values(jobs.iter().map(|(id, _)| id.to_string()));
    let keys = jobs.iter().enumerate().flat_map(|(key, (_, samples))| std::iter::repeat_n(key as i32, samples.len()));
    let ids = DictionaryArray::<Int32Type>::try_new(Int32Array::from_iter_values(keys), Arc::new(names))?;
    let values = |column: fn(&Samples) -> &Vec<f64>| -> ArrayRef {
        let joined: Vec<f64> = jobs.iter().flat_map(|(_, samples)| column(samples)).copied().collect();
        Arc::new(Float64Array::from(joined))
    };
    let nullable = |column: fn(&Samples) -> &Vec<f64>| -> ArrayRef {
        let joined =
            jobs.iter().flat_map(|(_, samples)| (0..samples.len()).map(|row| column(samples).get(row).copied()));
        Arc::new(joined.collect::<Float64Array>())
    };
    let columns = vec![
        Arc::new(ids) as ArrayRef,
        values(|s| &s.t),
        values(|s| &s.r),
        values(|s| &s.h),
        values(|s| &s.y),
        values(|s| &s.v_g),
        values(|s| &s.ek_ratio),
        nullable(|s| &s.shape),
        nullable(|s| &s.area_error),
    ];
    Ok(RecordBatch::try_new(schema(), columns)?)
}

/// Compares the bytes of the file that the catalogue of the store in `dir` calls `path` with its checksum.
///
/// # Errors
/// [`StoreError::Damaged`] if they differ or the file is missing; [`StoreError::Io`].
pub(super) fn verify(dir: &Path, path: &str, checksum: &str) -> Result<(), StoreError> {
    let damaged = |problem: &str| StoreError::Damaged { path: dir.join(path), problem: problem.to_owned() };
    let file = match aside::open(dir, path) {
        Err(StoreError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            return Err(damaged("it is missing"));
        }
        opened => opened?,
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file).map_err(StoreError::io(&dir.join(path)))?;
    let is_sound = hasher.finalize().to_hex().as_str() == checksum;
    if is_sound { Ok(()) } else { Err(damaged("its bytes do not match the checksum in the catalogue")) }
}

/// A sample file whose footer is read: cheap to clone, ready to read rows.
#[derive(Clone, Debug)]
pub(super) struct OpenFile {
    dir: PathBuf,
    path: String,
    metadata: ArrowReaderMetadata,
}

impl OpenFile {
    /// Reads the footer and the page index of the file that the catalogue of the store in `dir` calls `path`.
    pub(super) fn open(dir: &Path, path: &str) -> Result<Self, StoreError> {
        let file = aside::open(dir, path)?;
        // The same Arrow types for files of every version, whatever they say themselves.
        let options =
            ArrowReaderOptions::new().with_schema(schema()).with_offset_index_policy(PageIndexPolicy::Optional);
        let metadata = ArrowReaderMetadata::load(&file, options).map_err(StoreError::parquet(&dir.join(path)))?;
        Ok(Self { dir: dir.to_owned(), path: path.to_owned(), metadata })
    }

    /// The file.
    pub(super) fn path(&self) -> PathBuf {
        self.dir.join(&self.path)
    }

    /// Rows in the file.
    pub(super) fn rows(&self) -> usize {
        self.metadata.metadata().file_metadata().num_rows() as usize
    }

    /// Reads the rows `rows` of the columns whose bit is set in `columns` (bit 0 is `job_id`), in batches.
    pub(super) fn read(&self, rows: Range<usize>, columns: u64) -> Result<ParquetRecordBatchReader, StoreError> {
        let file = aside::open(&self.dir, &self.path)?;
        let wanted = (0..COLUMNS.len()).filter(|column| columns >> column & 1 == 1);
        let projection = ProjectionMask::leaves(self.metadata.parquet_schema(), wanted);
        let (groups, within) = self.groups(rows);
        let group_rows = groups.iter().map(|&g| self.metadata.metadata().row_group(g).num_rows() as usize).sum();
        let selection = RowSelection::from_consecutive_ranges(std::iter::once(within.clone()), group_rows);
        ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.metadata.clone())
            .with_row_groups(groups)
            .with_row_selection(selection)
            .with_projection(projection)
            .with_batch_size(within.len().clamp(1, CHUNK_ROWS))
            .build()
            .map_err(StoreError::parquet(&self.path()))
    }

    /// The row groups that hold `rows`, and where `rows` lie within those.
    fn groups(&self, rows: Range<usize>) -> (Vec<usize>, Range<usize>) {
        let (mut groups, mut start, mut skipped) = (Vec::new(), 0, 0);
        for (group, metadata) in self.metadata.metadata().row_groups().iter().enumerate() {
            let end = start + metadata.num_rows() as usize;
            if end <= rows.start {
                skipped = end;
            } else if start < rows.end {
                groups.push(group);
            }
            start = end;
        }
        (groups, rows.start - skipped..rows.end - skipped)
    }
}

/// A column of numbers of a batch that was read.
pub(super) fn numbers(column: &ArrayRef) -> &Float64Array {
    column.as_primitive::<Float64Type>()
}

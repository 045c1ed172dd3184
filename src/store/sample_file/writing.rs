//! Making a sample file: written aside, flushed, and named by the hash of its bytes.

use crate::parameters::JobId;
use crate::results::trajectory::Samples;
use crate::store::entries::SampleName;
use crate::store::error::StoreError;
use crate::store::folders::{aside_dir, samples_dir};
use crate::store::sample_file::{CHUNK_ROWS, COLUMNS, GROUP_ROWS, PAGE_ROWS, SCHEMA_VERSION, SampleFile, schema};
use crate::store::schema::columns::{self, Kind};
use crate::store::{aside, disk, entries};
use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, DictionaryArray, Float64Array, Int32Array, RecordBatch, StringArray};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
pub(in crate::store) struct HashingFile<'a> {
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
pub(in crate::store) fn write(dir: &Path, jobs: &[(JobId, &Samples)]) -> Result<SampleFile, StoreError> {
    let written = write_half(dir, |writer| write_rows(writer, jobs))?;
    disk::rename(&half(dir), &written.name.home(dir))?;
    disk::sync_folder(&samples_dir(dir))?;
    Ok(written)
}

/// What writes the rows of a new file.
pub(in crate::store) type RowWriter<'a, 'b> = ArrowWriter<&'a mut HashingFile<'b>>;

/// Writes whatever rows `fill` writes as a new file of the store in `dir`. When this returns the file is complete and
/// safely on disk, but still aside.
pub(in crate::store) fn write_aside(
    dir: &Path,
    fill: impl FnOnce(&mut RowWriter<'_, '_>) -> parquet::errors::Result<()>,
) -> Result<SampleFile, StoreError> {
    let written = write_half(dir, fill)?;
    disk::rename(&half(dir), &aside::places(dir, &written.name)[1])?;
    disk::sync_folder(&aside_dir(dir))?;
    Ok(written)
}

/// There is one writer, so one half-written file: the next attempt replaces it, or the next opening removes it.
fn half(dir: &Path) -> PathBuf {
    dir.join(entries::HALF)
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
    let name = SampleName::of_checksum(&checksum);
    Ok(SampleFile { name, rows, bytes, checksum: checksum.to_string() })
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

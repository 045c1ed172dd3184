//! Reading a sample file: all of it for its checksum, or the rows of a job.

use crate::store::aside;
use crate::store::entries::SampleName;
use crate::store::error::StoreError;
use crate::store::quiet::quietly;
use crate::store::sample_file::{CHUNK_ROWS, COLUMNS, opening};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type};
use arrow_array::{Array, ArrayRef, Float64Array, RecordBatch, RecordBatchReader, StringArray, TypedDictionaryArray};
use arrow_schema::SchemaRef;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder, RowSelection,
};
use parquet::errors::ParquetError;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Compares the bytes of a sample file of the store in `dir` with its checksum in the catalogue.
///
/// # Errors
/// [`StoreError::Damaged`] if they differ or the file is missing; [`StoreError::Io`].
pub(in crate::store) fn verify(dir: &Path, name: &SampleName, checksum: &str) -> Result<(), StoreError> {
    let damaged = |problem: &str| StoreError::Damaged { path: name.home(dir), problem: problem.to_owned() };
    let file = match aside::open(dir, name) {
        Err(StoreError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            return Err(damaged("it is missing"));
        }
        opened => opened?,
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file).map_err(StoreError::io(&name.home(dir)))?;
    let is_sound = hasher.finalize().to_hex().as_str() == checksum;
    if is_sound { Ok(()) } else { Err(damaged("its bytes do not match the checksum in the catalogue")) }
}

/// A sample file whose footer is read: cheap to clone, ready to read rows.
#[derive(Clone, Debug)]
pub(in crate::store) struct OpenFile {
    dir: PathBuf,
    name: SampleName,
    metadata: ArrowReaderMetadata,
}

impl OpenFile {
    /// Reads footer and page index of a file of the store in `dir`, and refuses a file that is none of ours.
    ///
    /// # Errors
    /// [`StoreError::Parquet`] for such a file; [`StoreError::Io`].
    pub(in crate::store) fn open(dir: &Path, name: &SampleName) -> Result<Self, StoreError> {
        let file = aside::open(dir, name)?;
        let metadata = guarded(&name.home(dir), || opening::metadata(&file))?;
        Ok(Self { dir: dir.to_owned(), name: name.clone(), metadata })
    }

    /// The file.
    pub(in crate::store) fn path(&self) -> PathBuf {
        self.name.home(&self.dir)
    }

    /// Rows in the file.
    pub(in crate::store) fn rows(&self) -> usize {
        self.metadata.metadata().file_metadata().num_rows() as usize
    }

    /// Reads the rows `rows` of the columns whose bit is set in `columns` (bit 0 is `job_id`), in batches.
    ///
    /// # Errors
    /// [`StoreError::Parquet`], also for rows that the file does not have.
    pub(in crate::store) fn read(&self, rows: Range<usize>, columns: u64) -> Result<Batches, StoreError> {
        let file = aside::open(&self.dir, &self.name)?;
        let reader = guarded(&self.path(), || {
            if rows.end > self.rows() {
                return Err(ParquetError::General(format!("it has no row {}", rows.end)));
            }
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
        })?;
        Ok(Batches { path: self.path(), reader })
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

/// The batches of rows that are read.
pub(in crate::store) struct Batches {
    path: PathBuf,
    reader: ParquetRecordBatchReader,
}

impl Batches {
    /// The columns that are read.
    pub(in crate::store) fn schema(&self) -> SchemaRef {
        self.reader.schema()
    }
}

impl Iterator for Batches {
    type Item = Result<RecordBatch, StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        let reader = &mut self.reader;
        let next = || {
            let batch = reader.next().transpose()?;
            match batch.as_ref().is_none_or(is_sound) {
                true => Ok(batch),
                false => Err(ParquetError::General("its columns do not hold what a sample file holds".to_owned())),
            }
        };
        guarded(&self.path, next).transpose()
    }
}

/// Whether each column of a batch holds ids or numbers, and each id that a row names is there.
fn is_sound(batch: &RecordBatch) -> bool {
    let are_ids = |column: &ArrayRef| {
        let Some(texts) = texts(column) else { return false };
        let known = |key: &i32| usize::try_from(*key).is_ok_and(|key| key < texts.values().len());
        texts.keys().null_count() == 0 && texts.values().null_count() == 0 && texts.keys().values().iter().all(known)
    };
    batch.columns().iter().all(|column| numbers(column).is_some() || are_ids(column))
}

/// Asks the Parquet library about a file whose bytes may be anybody's. A panic of the library is an error too.
fn guarded<T>(path: &Path, ask: impl FnOnce() -> parquet::errors::Result<T>) -> Result<T, StoreError> {
    let answer = quietly(ask).unwrap_or_else(|| Err(ParquetError::General("it is no sound Parquet file".to_owned())));
    answer.map_err(StoreError::parquet(path))
}

/// A column of numbers of a batch that was read; `None` if it holds something else.
pub(in crate::store) fn numbers(column: &ArrayRef) -> Option<&Float64Array> {
    column.as_primitive_opt::<Float64Type>()
}

/// The column of ids of a batch that was read; `None` if it holds something else.
pub(in crate::store) fn texts(column: &ArrayRef) -> Option<TypedDictionaryArray<'_, Int32Type, StringArray>> {
    column.as_dictionary_opt::<Int32Type>()?.downcast_dict::<StringArray>()
}

//! Finds and reads recorded series through the catalogue, while a run may be adding to it.
//!
//! A lookup of one job decodes just its rows. A join that walks through many small jobs of one file would decode the
//! same page again and again. So a lookup close to the last one decodes the pages around it whole, and keeps them.

use crate::store::entries::SampleName;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::lock;
use crate::store::read::open_existing;
use crate::store::sample_file::{Batches, OpenFile, PAGE_ROWS, verify};
use arrow_array::RecordBatch;
use arrow_select::concat::concat_batches;
use rusqlite::{Connection, OptionalExtension};
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Footers kept in memory.
const FOOTERS: usize = 1024;

/// The sample files of one store, for reading.
#[derive(Debug)]
pub(super) struct SampleReader {
    dir: PathBuf,
    state: Mutex<State>,
    /// Keeps the writer from removing the files of this look at the catalogue; released after the connection.
    _announced: Option<File>,
}

#[derive(Debug)]
struct State {
    conn: Connection,
    footers: HashMap<SampleName, OpenFile>,
    /// Files whose bytes were compared with their checksum.
    verified: HashSet<SampleName>,
    last: Option<DecodedSpan>,
}

/// Rows of a sample file.
#[derive(Clone, Debug)]
struct FileSpan {
    name: SampleName,
    rows: Range<usize>,
}

/// Rows that the last lookup decoded.
#[derive(Debug)]
struct DecodedSpan {
    span: FileSpan,
    columns: u64,
    batch: RecordBatch,
}

/// The rows of one job.
pub(super) enum JobRows {
    /// Nothing was recorded, or the job is unknown.
    None,
    /// All its rows at once.
    Decoded(RecordBatch),
    /// A reader that decodes them in parts, because they are many.
    Streamed(Batches),
}

impl SampleReader {
    /// Opens the catalogue of the store in `dir`.
    pub(super) fn open(dir: &Path) -> Result<Self, StoreError> {
        let announced = lock::announce_reader(dir);
        let conn = open_existing(dir)?;
        // One look at the catalogue serves all lookups. It is taken at the first of them, and so after the statement
        // that asks has taken its own: every run which that statement sees has its samples here.
        conn.execute_batch("BEGIN").map_err(StoreError::sql(&database(dir)))?;
        let state = State { conn, footers: HashMap::new(), verified: HashSet::new(), last: None };
        Ok(Self { dir: dir.to_owned(), state: Mutex::new(state), _announced: announced })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // A panic elsewhere leaves the caches right, if perhaps emptier.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The sample files, oldest first.
    pub(super) fn files(&self) -> Result<Vec<SampleName>, StoreError> {
        let state = self.state();
        let list = || -> rusqlite::Result<Vec<SampleName>> {
            let mut statement = state.conn.prepare_cached("SELECT path FROM sample_files ORDER BY key")?;
            statement.query_map([], |row| row.get(0))?.collect()
        };
        list().map_err(StoreError::sql(&database(&self.dir)))
    }

    /// Reads the whole file; `columns` is a bit mask.
    pub(super) fn read_file(&self, name: &SampleName, columns: u64) -> Result<Batches, StoreError> {
        let file = self.state().footer(&self.dir, name)?;
        file.read(0..file.rows(), columns)
    }

    /// Reads the rows of one job; `columns` is a bit mask.
    pub(super) fn read_job(&self, job_id: &str, columns: u64) -> Result<JobRows, StoreError> {
        let mut state = self.state();
        let span = state.find(job_id).map_err(StoreError::sql(&database(&self.dir)))?;
        let Some(span) = span.filter(|span| !span.rows.is_empty()) else { return Ok(JobRows::None) };
        if let Some(last) = state.last.as_ref().filter(|last| last.covers(&span, columns)) {
            return Ok(JobRows::Decoded(last.slice(&span.rows)));
        }
        let file = state.footer(&self.dir, &span.name)?;
        if span.rows.len() >= PAGE_ROWS {
            return file.read(span.rows, columns).map(JobRows::Streamed);
        }
        let walking = state.last.as_ref().is_some_and(|last| last.is_near(&span));
        let rows = if walking { whole_pages(&span.rows, file.rows()) } else { span.rows.clone() };
        let batch = decode(&file, rows.clone(), columns)?;
        let decoded = DecodedSpan { span: FileSpan { name: span.name, rows }, columns, batch };
        let slice = decoded.slice(&span.rows);
        state.last = Some(decoded);
        Ok(JobRows::Decoded(slice))
    }
}

impl State {
    /// Where the rows of a job are.
    fn find(&self, job_id: &str) -> rusqlite::Result<Option<FileSpan>> {
        let mut statement = self.conn.prepare_cached(
            "SELECT sample_files.path, first_row, row_count FROM jobs
             JOIN sample_index ON sample_index.job = jobs.key
             JOIN sample_files ON sample_files.key = sample_index.file
             WHERE jobs.job_id = ?1",
        )?;
        let span = statement.query_row([job_id], |row| {
            let (first, count): (usize, usize) = (row.get::<_, u32>(1)? as usize, row.get::<_, u32>(2)? as usize);
            Ok(FileSpan { name: row.get(0)?, rows: first..first + count })
        });
        span.optional()
    }

    /// Compares the bytes of a file with its checksum, before its first row is read. So no number of a damaged file
    /// gets out, and the Parquet library, which can panic, never sees a damaged file.
    fn verify(&self, dir: &Path, name: &SampleName) -> Result<(), StoreError> {
        let find = || {
            let mut statement = self.conn.prepare_cached("SELECT checksum FROM sample_files WHERE path = ?1")?;
            statement.query_row([name], |row| row.get::<_, String>(0))
        };
        verify(dir, name, &find().map_err(StoreError::sql(&database(dir)))?)
    }

    fn footer(&mut self, dir: &Path, name: &SampleName) -> Result<OpenFile, StoreError> {
        if let Some(file) = self.footers.get(name) {
            return Ok(file.clone());
        }
        if self.footers.len() >= FOOTERS {
            self.footers.clear();
        }
        if !self.verified.contains(name) {
            self.verify(dir, name)?;
            self.verified.insert(name.clone());
        }
        let file = OpenFile::open(dir, name)?;
        self.footers.insert(name.clone(), file.clone());
        Ok(file)
    }
}

impl DecodedSpan {
    fn covers(&self, span: &FileSpan, columns: u64) -> bool {
        let Range { start, end } = self.span.rows;
        self.columns == columns && self.span.name == span.name && start <= span.rows.start && span.rows.end <= end
    }

    fn is_near(&self, span: &FileSpan) -> bool {
        let (from, to) = (self.span.rows.start, self.span.rows.end + PAGE_ROWS);
        self.span.name == span.name && from <= span.rows.end + PAGE_ROWS && span.rows.start <= to
    }

    fn slice(&self, rows: &Range<usize>) -> RecordBatch {
        self.batch.slice(rows.start - self.span.rows.start, rows.len())
    }
}

/// All rows of the pages that hold `rows`, in a file of `total` rows.
fn whole_pages(rows: &Range<usize>, total: usize) -> Range<usize> {
    rows.start / PAGE_ROWS * PAGE_ROWS..rows.end.next_multiple_of(PAGE_ROWS).min(total)
}

fn decode(file: &OpenFile, rows: Range<usize>, columns: u64) -> Result<RecordBatch, StoreError> {
    let batches = file.read(rows, columns)?;
    let schema = batches.schema();
    let batches = batches.collect::<Result<Vec<_>, _>>()?;
    concat_batches(&schema, &batches).map_err(|error| StoreError::parquet(&file.path())(error.into()))
}

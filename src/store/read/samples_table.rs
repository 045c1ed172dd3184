//! The table `samples`: the catalogued Parquet files as a read-only SQLite table.
//!
//! The catalogue answers `job_id = ?`, so SQLite is told that such a lookup is cheap and a full scan dear. In a join
//! it then loops over jobs and looks up the samples of each. Only the columns that a statement reads are decoded.
//!
//! The traits of `rusqlite::vtab` are unsafe because SQLite takes a pointer to each struct for one to its first field:
//! both structs here are `#[repr(C)]` and begin with that field, as the traits demand. Nothing else here is unsafe.
#![allow(unsafe_code)]

use crate::store::entries::SampleName;
use crate::store::error::StoreError;
use crate::store::read::sample_reader::{JobRows, SampleReader};
use crate::store::sample_file::{Batches, COLUMNS, numbers, texts};
use arrow_array::{Array, RecordBatch};
use rusqlite::types::{Null, ValueRef};
use rusqlite::vtab::{
    Context, Filters, IndexConstraintOp, IndexInfo, Module, VTab, VTabConfig, VTabConnection, VTabCursor, sqlite3_vtab,
    sqlite3_vtab_cursor,
};
use rusqlite::{Connection, Error, Result};
use std::borrow::Cow;
use std::ffi::{CStr, c_int};
use std::path::Path;
use std::sync::Arc;

const DECLARATION: &CStr = c"CREATE TABLE samples (job_id TEXT, t REAL, r REAL, h REAL, y REAL, v_g REAL,
                             ek_ratio REAL, shape REAL, area_error REAL)";

/// Adds the samples of the store in `dir` to a connection, as the table `samples`.
pub(super) fn add_to(conn: &Connection, dir: &Path) -> std::result::Result<(), StoreError> {
    const MODULE: Module<'_, SamplesTable> = Module::eponymous_only_module();
    let reader = Arc::new(SampleReader::open(dir)?);
    conn.create_module(c"samples", &MODULE, Some(reader)).map_err(StoreError::sql(dir))
}

/// How a statement reads the table. SQLite carries it from `best_index` to `filter` as a number.
#[derive(Clone, Copy)]
struct Access {
    /// Whether the statement gives the job; bit 0 of the number.
    by_job: bool,
    /// The columns that it reads, a bit each; bits 1 and up of the number.
    columns: u64,
}

impl Access {
    fn to_number(self) -> c_int {
        (self.columns << 1) as c_int | c_int::from(self.by_job)
    }

    fn from_number(number: c_int) -> Self {
        Self { by_job: number & 1 == 1, columns: number as u64 >> 1 }
    }
}

/// Whether the statement gives the job, the first column of every such table; if so, `filter` gets it as its argument.
pub(super) fn looks_up_job(info: &mut IndexInfo) -> bool {
    let mut by_job = false;
    for (constraint, mut usage) in info.constraints_and_usages() {
        let is_job = constraint.column() == 0 && constraint.operator() == IndexConstraintOp::SQLITE_INDEX_CONSTRAINT_EQ;
        if is_job && constraint.is_usable() && !by_job {
            by_job = true;
            usage.set_argv_index(1);
            usage.set_omit(true);
        }
    }
    by_job
}

/// Tells SQLite that looking a job up is cheap and a scan dear.
pub(super) fn tell_cost(info: &mut IndexInfo, by_job: bool) {
    let (cost, rows) = if by_job { (1e3, 1_000) } else { (1e12, 1_000_000_000) };
    info.set_estimated_cost(cost);
    info.set_estimated_rows(rows);
}

#[repr(C)]
struct SamplesTable {
    base: sqlite3_vtab,
    samples: Arc<SampleReader>,
}

unsafe impl VTab<'_> for SamplesTable {
    type Aux = Arc<SampleReader>;
    type Cursor = SamplesCursor;

    fn connect(
        conn: &mut VTabConnection,
        aux: Option<&Self::Aux>,
        _module: &[u8],
        _database: &[u8],
        _table: &[u8],
        _args: &[&[u8]],
    ) -> Result<(Cow<'static, CStr>, Self)> {
        conn.config(VTabConfig::Innocuous)?;
        let reader = aux.ok_or_else(|| Error::ModuleError("no store given".to_owned()))?.clone();
        Ok((Cow::Borrowed(DECLARATION), Self { base: sqlite3_vtab::default(), samples: reader }))
    }

    fn best_index(&self, info: &mut IndexInfo) -> Result<bool> {
        let used = info.col_used() & ((1 << COLUMNS.len()) - 1);
        let by_job = looks_up_job(info);
        // The job's own id is known and need not be read.
        let columns = if by_job { used & !1 } else { used };
        info.set_idx_num(Access { by_job, columns }.to_number());
        tell_cost(info, by_job);
        Ok(true)
    }

    fn open(&mut self) -> Result<SamplesCursor> {
        Ok(SamplesCursor::new(self.samples.clone()))
    }
}

#[repr(C)]
struct SamplesCursor {
    base: sqlite3_vtab_cursor,
    samples: Arc<SampleReader>,
    access: Access,
    /// The job that the statement gives; empty in a full scan.
    job_id: String,
    /// Files still to be scanned, the next one last.
    files: Vec<SampleName>,
    reader: Option<Batches>,
    batch: Option<RecordBatch>,
    row: usize,
    row_id: i64,
}

impl SamplesCursor {
    fn new(samples: Arc<SampleReader>) -> Self {
        Self {
            base: sqlite3_vtab_cursor::default(),
            samples,
            access: Access { by_job: false, columns: 0 },
            job_id: String::new(),
            files: Vec::new(),
            reader: None,
            batch: None,
            row: 0,
            row_id: 0,
        }
    }

    /// Steps to the next batch that has rows, through the files still to be scanned.
    fn load(&mut self) -> Result<()> {
        self.row = 0;
        loop {
            self.batch = self.reader.as_mut().and_then(Iterator::next).transpose().map_err(module_error)?;
            match &self.batch {
                Some(batch) if batch.num_rows() > 0 => return Ok(()),
                Some(_) => {}
                None => match self.files.pop() {
                    None => return Ok(()),
                    Some(file) => {
                        let batches = self.samples.read_file(&file, self.access.columns);
                        self.reader = Some(batches.map_err(module_error)?);
                    }
                },
            }
        }
    }
}

unsafe impl VTabCursor for SamplesCursor {
    fn filter(&mut self, number: c_int, _: Option<&str>, args: &Filters<'_>) -> Result<()> {
        self.access = Access::from_number(number);
        (self.reader, self.batch, self.row, self.row_id) = (None, None, 0, 0);
        if !self.access.by_job {
            self.files = self.samples.files().map_err(module_error)?;
            self.files.reverse();
            return self.load();
        }
        // A value that is not a text equals no job_id.
        let Some(ValueRef::Text(job_id)) = args.iter().next() else { return Ok(()) };
        self.job_id = String::from_utf8_lossy(job_id).into_owned();
        match self.samples.read_job(&self.job_id, self.access.columns).map_err(module_error)? {
            JobRows::None => Ok(()),
            JobRows::Decoded(batch) => {
                self.batch = Some(batch);
                Ok(())
            }
            JobRows::Streamed(reader) => {
                self.reader = Some(reader);
                self.load()
            }
        }
    }

    fn next(&mut self) -> Result<()> {
        self.row += 1;
        self.row_id += 1;
        match &self.batch {
            Some(batch) if self.row < batch.num_rows() => Ok(()),
            _ => self.load(),
        }
    }

    fn eof(&self) -> bool {
        self.batch.is_none()
    }

    fn column(&self, context: &mut Context, index: c_int) -> Result<()> {
        let Some(batch) = &self.batch else { return context.set_result(Null) };
        if index == 0 && self.access.by_job {
            return context.set_result(self.job_id.as_str());
        }
        // Batches hold the columns that are read, in order.
        let before = (self.access.columns & ((1 << index) - 1)).count_ones() as usize;
        let column = batch.column(before);
        if index == 0 {
            let texts = texts(column).ok_or_else(|| misfit("ids"))?;
            return context.set_result(texts.values().value(texts.keys().value(self.row) as usize));
        }
        let numbers = numbers(column).ok_or_else(|| misfit("numbers"))?;
        match numbers.is_valid(self.row) {
            true => context.set_result(numbers.value(self.row)),
            false => context.set_result(Null),
        }
    }

    fn rowid(&self) -> Result<i64> {
        Ok(self.row_id)
    }
}

const NEXT_STEP: &str = "`meniscus check DIR` examines all sample files";

/// A column that does not hold what its file was opened for.
fn misfit(what: &str) -> Error {
    Error::ModuleError(format!("a column of a sample file does not hold {what}; {NEXT_STEP}"))
}

fn module_error(error: StoreError) -> Error {
    Error::ModuleError(match error {
        StoreError::Parquet { .. } => format!("{error}; {NEXT_STEP}"),
        other => other.to_string(),
    })
}

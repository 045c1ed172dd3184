//! Tables whose rows are worked out job by job from what is stored: `outline` and `obstacles`.
//!
//! `outline(job_id, t, vertex, x, y)` has the vertices of the kept shapes, and `obstacles(job_id, obstacle, x, y,
//! radius)` the obstacles near the path of a job, in the same unwrapped coordinates. A join loops over jobs and looks
//! the rows of each up; a scan goes through all jobs that left a shape. Like the view `shapes`, both know jobs of the
//! current physics version alone: another one may have placed obstacles otherwise.
//!
//! As in `samples_table.rs`, the traits of `rusqlite::vtab` are unsafe because SQLite takes a pointer to each struct
//! for one to its first field: both structs here are `#[repr(C)]` and begin with that field. Nothing else is unsafe.
#![allow(unsafe_code)]

use crate::store::error::StoreError;
use crate::store::read::rows::JobRow;
use crate::store::read::samples_table::{self, looks_up_job, tell_cost};
use crate::store::read::{obstacles, open_existing, outlines};
use rusqlite::types::ValueRef;
use rusqlite::vtab::{
    Context, Filters, IndexInfo, Module, VTab, VTabConfig, VTabConnection, VTabCursor, sqlite3_vtab,
    sqlite3_vtab_cursor,
};
use rusqlite::{Connection, Error, OptionalExtension, Result};
use std::borrow::Cow;
use std::ffi::{CStr, c_int};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Works out the rows of one job.
type RowsOf = fn(&Connection, &str) -> std::result::Result<Vec<JobRow>, StoreError>;

/// The names of the tables.
pub(super) const NAMES: [&str; 2] = ["outline", "obstacles"];

const OUTLINE: (&CStr, RowsOf) =
    (c"CREATE TABLE outline (job_id TEXT, t REAL, vertex INTEGER, x REAL, y REAL)", outlines::vertices);

const OBSTACLES: (&CStr, RowsOf) =
    (c"CREATE TABLE obstacles (job_id TEXT, obstacle INTEGER, x REAL, y REAL, radius REAL)", obstacles::near_path);

/// Adds both tables, of the store in `dir`, to a connection.
pub(super) fn add_to(conn: &Connection, dir: &Path) -> std::result::Result<(), StoreError> {
    const MODULE: Module<'_, JobTable> = Module::eponymous_only_module();
    let jobs = Arc::new(Jobs { dir: dir.to_owned(), conn: Mutex::new(None) });
    for (name, (declaration, rows_of)) in NAMES.into_iter().zip([OUTLINE, OBSTACLES]) {
        let source = Source { declaration, rows_of, jobs: jobs.clone() };
        conn.create_module(name, &MODULE, Some(source)).map_err(StoreError::sql(dir))?;
    }
    Ok(())
}

/// The jobs of a store, behind a connection of their own, which is opened by the first statement that asks.
struct Jobs {
    dir: PathBuf,
    conn: Mutex<Option<Connection>>,
}

impl Jobs {
    fn ask<T>(&self, ask: impl FnOnce(&Connection) -> std::result::Result<T, StoreError>) -> Result<T> {
        let mut kept = self.conn.lock().unwrap_or_else(PoisonError::into_inner);
        let answer = || {
            let conn = match &*kept {
                Some(conn) => conn,
                None => kept.insert(self.connect()?),
            };
            ask(conn)
        };
        answer().map_err(|error: StoreError| Error::ModuleError(error.to_string()))
    }

    /// All looks at the jobs are of one moment: that of the first.
    fn connect(&self) -> std::result::Result<Connection, StoreError> {
        let conn = open_existing(&self.dir)?;
        samples_table::add_to(&conn, &self.dir)?;
        conn.execute_batch("BEGIN").map_err(StoreError::sql(&self.dir))?;
        Ok(conn)
    }

    /// Whether there is a job of that id, of the current physics version.
    fn is_current(&self, job_id: &str) -> Result<bool> {
        self.ask(|conn| {
            let find = || {
                let mut statement = conn.prepare_cached(
                    "SELECT 1 FROM jobs WHERE job_id = ?1 AND +physics_version = (SELECT physics_version FROM current)",
                )?;
                statement.exists([job_id])
            };
            find().map_err(StoreError::sql(&self.dir))
        })
    }

    /// The next job that left a shape, after the one with the key `after`.
    fn next(&self, after: i64) -> Result<Option<(i64, String)>> {
        self.ask(|conn| {
            let find = || {
                let mut statement = conn.prepare_cached(
                    "SELECT key, job_id FROM jobs
                     WHERE key > ?1 AND EXISTS (SELECT 1 FROM shape_rows WHERE job = jobs.key)
                         AND +physics_version = (SELECT physics_version FROM current)
                     ORDER BY key LIMIT 1",
                )?;
                statement.query_row([after], |row| Ok((row.get(0)?, row.get(1)?))).optional()
            };
            find().map_err(StoreError::sql(&self.dir))
        })
    }
}

/// Where the rows of a table come from.
#[derive(Clone)]
struct Source {
    declaration: &'static CStr,
    rows_of: RowsOf,
    jobs: Arc<Jobs>,
}

#[repr(C)]
struct JobTable {
    base: sqlite3_vtab,
    source: Source,
}

unsafe impl VTab<'_> for JobTable {
    type Aux = Source;
    type Cursor = JobCursor;

    fn connect(
        conn: &mut VTabConnection,
        aux: Option<&Self::Aux>,
        _module: &[u8],
        _database: &[u8],
        _table: &[u8],
        _args: &[&[u8]],
    ) -> Result<(Cow<'static, CStr>, Self)> {
        conn.config(VTabConfig::Innocuous)?;
        let source = aux.ok_or_else(|| Error::ModuleError("no store given".to_owned()))?.clone();
        Ok((Cow::Borrowed(source.declaration), Self { base: sqlite3_vtab::default(), source }))
    }

    fn best_index(&self, info: &mut IndexInfo) -> Result<bool> {
        let by_job = looks_up_job(info);
        info.set_idx_num(by_job.into());
        tell_cost(info, by_job);
        Ok(true)
    }

    fn open(&mut self) -> Result<JobCursor> {
        Ok(JobCursor {
            base: sqlite3_vtab_cursor::default(),
            source: self.source.clone(),
            job_id: String::new(),
            scanned: None,
            rows: Vec::new(),
            row: 0,
            row_id: 0,
        })
    }
}

#[repr(C)]
struct JobCursor {
    base: sqlite3_vtab_cursor,
    source: Source,
    /// The job whose rows are shown.
    job_id: String,
    /// The key of that job in a scan; `None` where the statement gives the job, and after the last.
    scanned: Option<i64>,
    rows: Vec<JobRow>,
    row: usize,
    row_id: i64,
}

impl JobCursor {
    /// Works out the rows of `job_id`, unless they are there from the look before: a join asks for the same job again
    /// for every row on its other side.
    fn show(&mut self, job_id: String) -> Result<()> {
        self.row = 0;
        if self.job_id == job_id {
            return Ok(());
        }
        self.rows = self.source.jobs.ask(|conn| (self.source.rows_of)(conn, &job_id))?;
        self.job_id = job_id;
        Ok(())
    }

    /// In a scan, steps to the next job that has rows.
    fn load(&mut self) -> Result<()> {
        while let Some(after) = self.scanned.filter(|_| self.row >= self.rows.len()) {
            let next = self.source.jobs.next(after)?;
            self.scanned = next.as_ref().map(|(key, _)| *key);
            if let Some((_, job_id)) = next {
                self.show(job_id)?;
            }
        }
        Ok(())
    }
}

unsafe impl VTabCursor for JobCursor {
    fn filter(&mut self, by_job: c_int, _: Option<&str>, args: &Filters<'_>) -> Result<()> {
        (self.row, self.row_id) = (self.rows.len(), 0);
        self.scanned = (by_job == 0).then_some(i64::MIN);
        if by_job == 0 {
            return self.load();
        }
        // A value that is not a text equals no job_id.
        let Some(ValueRef::Text(job_id)) = args.iter().next() else { return Ok(()) };
        let job_id = String::from_utf8_lossy(job_id).into_owned();
        if self.source.jobs.is_current(&job_id)? { self.show(job_id) } else { Ok(()) }
    }

    fn next(&mut self) -> Result<()> {
        self.row += 1;
        self.row_id += 1;
        self.load()
    }

    fn eof(&self) -> bool {
        self.row >= self.rows.len()
    }

    fn column(&self, context: &mut Context, index: c_int) -> Result<()> {
        match usize::try_from(index - 1) {
            Ok(column) => context.set_result(&self.rows[self.row][column]),
            Err(_) => context.set_result(self.job_id.as_str()),
        }
    }

    fn rowid(&self) -> Result<i64> {
        Ok(self.row_id)
    }
}

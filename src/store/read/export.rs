//! A store as plain files for other programs: one for each table, and a manifest that says what they hold.
//!
//! All tables are of one moment, so an export may be made while a run goes on.

use crate::parameters::PHYSICS_VERSION;
use crate::store::error::StoreError;
use crate::store::folders::database;
use crate::store::read::corrupt;
use crate::store::read::format::{Format, Sink};
use crate::store::read::opening::still_unchanged;
use crate::store::read::outlines::outline;
use crate::store::read::parquet_rows::{AnswerColumn, columns_of};
use crate::store::read::query::{QueryError, connection, explain, pour};
use crate::store::schema::columns::{self, Kind};
use rusqlite::Connection;
use rusqlite::types::ValueRef;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// The tables and what is asked for them. Samples of runs that ended after the rest was read are left out.
const TABLES: [(&str, &str); 8] = [
    ("runs", "SELECT * FROM runs"),
    ("clog_events", "SELECT * FROM clog_events"),
    ("arrest_events", "SELECT * FROM arrest_events"),
    ("pinch_events", "SELECT * FROM pinch_events"),
    ("lambda_fits", "SELECT * FROM lambda_fits"),
    ("speed_averages", "SELECT * FROM speed_averages"),
    ("survival", "SELECT * FROM survival"),
    ("samples", "SELECT * FROM samples WHERE +job_id IN (SELECT job_id FROM runs WHERE state = 'done')"),
];

/// The outlines of droplets, a row each vertex.
const OUTLINE: [(&str, Kind); 5] =
    [("job_id", Kind::Text), ("t", Kind::Number), ("vertex", Kind::Whole), ("x", Kind::Number), ("y", Kind::Number)];

/// What the units of the manifest mean.
const UNITS: &str = "droplet diameter sigma, gravity g and areal density rho are 1; t0 = sqrt(sigma/g); V_t is the \
                     column v_t of runs; no unit: words, counts and pure numbers; NULL: the column means nothing there";

/// A file of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportedFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its rows; `None` for the manifest.
    pub rows: Option<u64>,
    /// Its size.
    pub bytes: u64,
}

/// Writes the tables of the store in `dir` to the folder `out`, which is made if need be, and last `manifest.json`: its
/// columns with type, unit and meaning, the campaigns, which programs computed them, and a checksum of each file.
///
/// # Errors
/// [`QueryError::NotEmpty`] if there is anything in `out`; [`StoreError::Missing`] without a store; what the system
/// reports.
pub fn export(dir: &Path, out: &Path, format: Format) -> Result<Vec<ExportedFile>, QueryError> {
    let conn = connection(dir)?;
    conn.execute_batch("BEGIN").map_err(StoreError::sql(&database(dir)))?;
    let head = manifest(dir, &conn).map_err(StoreError::sql(&database(dir)))?;
    make_empty_folder(out)?;
    let mut export = Export { conn, dir, out, format, files: Vec::new(), tables: Vec::new() };
    for (table, sql) in TABLES {
        export.table(table, sql)?;
    }
    export.outlines()?;
    still_unchanged(&export.conn, dir)?;
    export.finish(head)
}

fn make_empty_folder(out: &Path) -> Result<(), QueryError> {
    std::fs::create_dir_all(out).map_err(StoreError::io(out))?;
    match std::fs::read_dir(out).map_err(StoreError::io(out))?.next() {
        Some(_) => Err(QueryError::NotEmpty(out.to_owned())),
        None => Ok(()),
    }
}

/// An export under way.
struct Export<'a> {
    conn: Connection,
    dir: &'a Path,
    out: &'a Path,
    format: Format,
    files: Vec<ExportedFile>,
    /// What the manifest says of each table.
    tables: Vec<Value>,
}

impl Export<'_> {
    /// Writes the answer to a statement as the file of a table.
    fn table(&mut self, table: &str, sql: &str) -> Result<(), QueryError> {
        let mut statement = self.conn.prepare(sql).map_err(|error| explain(&self.conn, &error))?;
        let answer = columns_of(&self.conn, &statement);
        let (file, said) =
            self.file(table, answer, |sink| pour(&self.conn, &mut statement, sink).map(|(rows, _)| rows))?;
        drop(statement);
        self.files.push(file);
        self.tables.push(said);
        Ok(())
    }

    fn outlines(&mut self) -> Result<(), QueryError> {
        let kinds = OUTLINE.map(|(name, kind)| AnswerColumn { name: name.to_owned(), kind: Some(kind) });
        let (file, said) = self.file("outline", kinds.to_vec(), |sink| self.pour_outlines(sink))?;
        self.files.push(file);
        self.tables.push(said);
        Ok(())
    }

    fn pour_outlines(&self, mut sink: Sink<'_>) -> Result<u64, QueryError> {
        let failed = |error| QueryError::from(StoreError::sql(&database(self.dir))(error));
        let sql = "SELECT t, vertices, loads, job_id FROM shapes ORDER BY job_id, t";
        let mut statement = self.conn.prepare(sql).map_err(failed)?;
        let (mut rows, mut count) = (statement.query([]).map_err(failed)?, 0);
        while let Some(row) = rows.next().map_err(failed)? {
            let job_id = row.get_ref(3).map_err(failed)?;
            let Some(outline) = outline(row).map_err(failed)? else {
                let row = job_id.as_str().unwrap_or_default();
                return Err(corrupt(row, "its outline cannot be read".to_owned()).into());
            };
            for (vertex, (x, y)) in outline.x.iter().zip(&outline.y).enumerate() {
                let [t, x, y] = [outline.t, *x, *y].map(ValueRef::Real);
                sink.row(&[job_id, t, ValueRef::Integer(vertex as i64), x, y]).map_err(QueryError::Output)?;
                count += 1;
            }
        }
        sink.end().map_err(QueryError::Output)?;
        Ok(count)
    }

    /// Writes the file of a table; returns it, and what the manifest says of it.
    fn file(
        &self,
        table: &str,
        answer: Vec<AnswerColumn>,
        pour: impl FnOnce(Sink<'_>) -> Result<u64, QueryError>,
    ) -> Result<(ExportedFile, Value), QueryError> {
        let name = format!("{table}.{}", self.format.name());
        let path = self.out.join(&name);
        let typed: Vec<(&str, Kind)> =
            answer.iter().map(|column| (column.name.as_str(), column.kind.unwrap_or(Kind::Number))).collect();
        let (described, metadata) = (columns::described(table, &typed), columns::in_metadata(table, &typed));
        let mut file = HashingFile::create(&path)?;
        let sink = Sink::begin(self.format, answer, vec![metadata], &mut file).map_err(QueryError::Output)?;
        let rows = pour(sink)?;
        let bytes = file.bytes;
        let checksum = file.finish(&path)?;
        let said = json!({
            "name": table, "file": name, "rows": rows, "bytes": bytes, "blake3": checksum, "columns": described,
        });
        Ok((ExportedFile { path, rows: Some(rows), bytes }, said))
    }

    /// Writes the manifest, which comes last: where it is, everything is.
    fn finish(mut self, mut manifest: Value) -> Result<Vec<ExportedFile>, QueryError> {
        manifest["tables"] = Value::Array(self.tables);
        let path = self.out.join("manifest.json");
        let text = format!("{manifest:#}\n");
        let mut file = HashingFile::create(&path)?;
        file.write_all(text.as_bytes()).map_err(StoreError::io(&path))?;
        file.finish(&path)?;
        self.files.push(ExportedFile { path, rows: None, bytes: text.len() as u64 });
        Ok(self.files)
    }
}

/// What a manifest says beside the tables.
fn manifest(dir: &Path, conn: &Connection) -> rusqlite::Result<Value> {
    let list = |sql: &str, names: &[&str]| -> rusqlite::Result<Value> {
        let mut statement = conn.prepare(sql)?;
        let rows = statement.query_map([], |row| {
            let member = |(index, name): (usize, &&str)| Ok(((*name).to_owned(), row.get::<_, String>(index)?.into()));
            names.iter().enumerate().map(member).collect::<rusqlite::Result<serde_json::Map<_, _>>>().map(Value::Object)
        });
        rows?.collect()
    };
    let name = std::path::absolute(dir).ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    Ok(json!({
        "store": name,
        "exported": chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Secs, true),
        "program": { "name": "meniscus", "version": env!("CARGO_PKG_VERSION"), "commit": env!("MENISCUS_COMMIT") },
        "physics_version": PHYSICS_VERSION,
        "units": UNITS,
        "campaigns": list("SELECT name, text FROM campaigns ORDER BY key", &["name", "text"])?,
        "computed_by": list(
            "SELECT DISTINCT program_version, git_commit, rustc, cpu_features, host FROM provenance ORDER BY key",
            &["version", "commit", "rustc", "cpu_features", "host"],
        )?,
    }))
}

/// A file that is hashed and measured while it is written.
struct HashingFile {
    file: BufWriter<File>,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl HashingFile {
    fn create(path: &Path) -> Result<Self, StoreError> {
        let file = File::create_new(path).map_err(StoreError::io(path))?;
        Ok(Self { file: BufWriter::new(file), hasher: blake3::Hasher::new(), bytes: 0 })
    }

    /// Makes it safe on disk; returns the checksum.
    fn finish(self, path: &Path) -> Result<String, StoreError> {
        let file = self.file.into_inner().map_err(|error| StoreError::io(path)(error.into_error()))?;
        file.sync_all().map_err(StoreError::io(path))?;
        Ok(self.hasher.finalize().to_hex().to_string())
    }
}

impl Write for HashingFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

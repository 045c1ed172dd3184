//! Files for other programs: what old readers refuse is not in them, types come from declarations, meanings are told.

use super::make::*;
use meniscus::store::{Format, Store, Writer, WriterOptions, query};
use parquet::basic::{ColumnOrder, Encoding, Type};
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use std::path::{Path, PathBuf};

fn metadata(path: &Path) -> ParquetMetaData {
    SerializedFileReader::try_from(path).unwrap().metadata().clone()
}

/// A file with the answer to a query.
fn answer_file(dir: &Path, name: &str, sql: &str) -> PathBuf {
    let mut bytes = Vec::new();
    query(dir, sql, Format::Parquet, &mut bytes).unwrap();
    let path = dir.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// The columns and their types.
fn types(path: &Path) -> Vec<(String, Type, String)> {
    let metadata = metadata(path);
    let columns = metadata.file_metadata().schema_descr().columns().iter();
    columns.map(|c| (c.name().to_owned(), c.physical_type(), format!("{:?}", c.logical_type_ref()))).collect()
}

/// What pyarrow 10, polars 1.30 and fastparquet refuse is not in the file.
fn opens_everywhere(path: &Path) {
    let metadata = metadata(path);
    let file = metadata.file_metadata();
    let orders = file.column_orders().unwrap();
    assert!(orders.iter().all(|order| matches!(order, ColumnOrder::TYPE_DEFINED_ORDER(_))), "{orders:?}");
    for column in metadata.row_groups().iter().flat_map(|group| group.columns()) {
        let old = [Encoding::PLAIN, Encoding::RLE, Encoding::RLE_DICTIONARY, Encoding::PLAIN_DICTIONARY];
        let encodings: Vec<_> = column.encodings().collect();
        assert!(encodings.iter().all(|encoding| old.contains(encoding)), "{encodings:?}");
    }
    let keys: Vec<_> = file.key_value_metadata().into_iter().flatten().map(|entry| entry.key.as_str()).collect();
    assert!(!keys.contains(&"ARROW:schema"), "{keys:?}");
}

fn sample_paths(dir: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(dir.join("samples")).unwrap().map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn samples_and_answers_hold_nothing_that_older_readers_refuse() {
    let dir = scratch();
    drop(filled(dir.path(), &[ring(0.3), soft(1.0)], 5, 40, 4));
    let answers = ["SELECT * FROM runs", "SELECT * FROM samples", "SELECT * FROM shapes", "SELECT 1.5 AS x"];
    let answers = answers.iter().enumerate().map(|(at, sql)| answer_file(dir.path(), &format!("{at}.parquet"), sql));
    let answers: Vec<_> = answers.collect();
    let samples = sample_paths(dir.path());
    assert!(samples.len() > 1);
    answers.iter().chain(&samples).for_each(|path| opens_everywhere(path));
}

#[test]
fn a_sample_file_says_the_unit_and_the_meaning_of_each_column() {
    let dir = scratch();
    drop(filled(dir.path(), &[ring(0.3)], 1, 4, 4));
    let metadata = metadata(&sample_paths(dir.path())[0]);
    let entries = metadata.file_metadata().key_value_metadata().unwrap();
    let entry = |key: &str| entries.iter().find(|entry| entry.key == key).unwrap().value.clone().unwrap();
    assert_eq!(entry("meniscus_schema"), "2");
    let columns: serde_json::Value = serde_json::from_str(&entry("meniscus_columns")).unwrap();
    assert_eq!(columns[1], serde_json::json!({ "name": "t", "type": "real", "unit": "t0", "meaning": "time" }));
    assert_eq!(columns.as_array().unwrap().len(), 9);
    assert!(columns.as_array().unwrap().iter().all(|column| column["meaning"] != ""));
}

#[test]
fn a_column_has_one_type_with_rows_without_rows_and_where_all_are_null() {
    let (full, empty) = (scratch(), scratch());
    drop(filled(full.path(), &[soft(1.0)], 3, 2, 4));
    drop(Store::open(empty.path()).unwrap());
    for sql in [
        "SELECT * FROM runs",
        "SELECT * FROM clog_events",
        "SELECT * FROM lambda_fits",
        "SELECT * FROM speed_averages",
        "SELECT * FROM shapes",
        "SELECT * FROM samples",
        "SELECT gamma, avg(gamma) AS mean, sum(r_end) AS total, count(*) AS n FROM runs GROUP BY 1",
        "SELECT CAST(count(*) AS INTEGER) AS n, CAST(max(error) AS TEXT) AS error, r_end / 2 AS half FROM runs",
    ] {
        let [one, other] = [&full, &empty].map(|dir| types(&answer_file(dir.path(), "answer.parquet", sql)));
        assert_eq!(one, other, "{sql}");
    }
    let path = answer_file(full.path(), "runs.parquet", "SELECT gamma, seed, error, n_vertices FROM runs");
    let kinds: Vec<Type> = types(&path).into_iter().map(|(_, kind, _)| kind).collect();
    assert_eq!(kinds, [Type::DOUBLE, Type::INT64, Type::BYTE_ARRAY, Type::INT64], "all of gamma is NULL");
    let path = answer_file(full.path(), "cast.parquet", "SELECT CAST(count(*) AS INTEGER) AS n FROM runs");
    assert_eq!(types(&path)[0].1, Type::INT64);
}

#[test]
fn a_value_that_its_column_cannot_hold_is_an_error_that_says_what_to_write() {
    let dir = scratch();
    drop(filled(dir.path(), &[soft(1.0)], 2, 1, 4));
    let sql = "SELECT seed FROM runs UNION ALL SELECT 'all'";
    let error = query(dir.path(), sql, Format::Parquet, &mut Vec::new()).unwrap_err().to_string();
    assert!(error.contains("seed is integer, but a row holds `all`: CAST(... AS TEXT) AS seed"), "{error}");
}

#[test]
fn many_rows_are_all_in_the_file() {
    let dir = scratch();
    drop(filled(dir.path(), &[soft(1.0)], 3, 70_000, 4));
    let path = answer_file(dir.path(), "answer.parquet", "SELECT * FROM samples");
    assert_eq!(metadata(&path).file_metadata().num_rows(), 210_000);
    assert!(metadata(&path).num_row_groups() > 1);
    let read = SerializedFileReader::try_from(path.as_path()).unwrap();
    let t: Vec<f64> = read.get_row_iter(None).unwrap().map(|row| row.unwrap().get_double(1).unwrap()).collect();
    let expected = csv(dir.path(), "SELECT t FROM samples");
    assert!(t.iter().zip(&expected).all(|(t, text)| format!("{t:?}") == *text));
}

#[test]
fn files_of_the_first_version_are_read_and_merge_with_new_ones_into_files_that_open_everywhere() {
    let dir = scratch();
    let old = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/store/fixtures/schema-1/store");
    std::fs::create_dir(dir.path().join("samples")).unwrap();
    std::fs::copy(old.join("store.db"), dir.path().join("store.db")).unwrap();
    for path in sample_paths(&old) {
        std::fs::copy(&path, dir.path().join("samples").join(path.file_name().unwrap())).unwrap();
    }
    let mut store = Store::open(dir.path()).unwrap();
    let before = csv(dir.path(), "SELECT * FROM samples ORDER BY job_id, t");
    assert!(!before.is_empty());
    register(&mut store, &[soft(7.5)], 40);
    let writer = Writer::spawn(store, WriterOptions { merge: 2, ..options(1) }).unwrap();
    (0..40).for_each(|seed| writer.sender().send(finished(&soft(7.5), seed, 3)).unwrap());
    drop(writer.finish().unwrap());
    sample_paths(dir.path()).iter().for_each(|path| opens_everywhere(path));
    let after = csv(dir.path(), "SELECT * FROM samples ORDER BY job_id, t");
    assert_eq!(after.len(), before.len() + 120);
    assert!(before.iter().all(|row| after.binary_search(row).is_ok() || after.contains(row)), "bit for bit");
}

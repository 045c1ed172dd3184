//! A store as plain files: complete, of one moment, and never over the files of somebody else.

use super::make::*;
use meniscus::store::{Format, QueryError, Store, StoreError, Writer, export};
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::path::Path;

fn manifest(out: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(out.join("manifest.json")).unwrap()).unwrap()
}

#[test]
fn an_export_holds_every_table_and_a_manifest_that_says_what_they_are() {
    let (dir, place) = (scratch(), scratch());
    drop(filled(dir.path(), &[ring(0.3), soft(1.0)], 5, 7, 4));
    let out = place.path().join("new/out");
    let files = export(dir.path(), &out, Format::Parquet).unwrap();
    assert_eq!(files.len(), 10);
    let manifest = manifest(&out);
    let rows = |table: &str| {
        manifest["tables"].as_array().unwrap().iter().find(|t| t["name"] == table).unwrap()["rows"].clone()
    };
    assert_eq!((rows("runs"), rows("clog_events"), rows("samples")), (10.into(), 4.into(), 70.into()));
    assert_eq!(rows("outline"), 5 * 2 * 5 + 5 * 2, "five vertices a ring, one a point, two shapes each");
    assert_eq!(manifest["campaigns"][0]["text"], "name = \"test\"");
    assert_eq!(manifest["program"]["version"], env!("CARGO_PKG_VERSION"));
    for table in manifest["tables"].as_array().unwrap() {
        let path = out.join(table["file"].as_str().unwrap());
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(table["blake3"], blake3::hash(&bytes).to_hex().as_str());
        assert_eq!(table["bytes"], bytes.len());
        let reader = SerializedFileReader::try_from(path.as_path()).unwrap();
        assert_eq!(table["rows"], reader.metadata().file_metadata().num_rows());
        let names: Vec<_> =
            reader.metadata().file_metadata().schema_descr().columns().iter().map(|c| c.name().to_owned()).collect();
        let columns = table["columns"].as_array().unwrap();
        assert_eq!(columns.iter().map(|column| column["name"].as_str().unwrap()).collect::<Vec<_>>(), names);
        assert!(columns.iter().all(|column| column["meaning"] != "" && column["type"] != ""), "{columns:?}");
    }
}

#[test]
fn csv_files_of_an_export_hold_what_a_query_answers() {
    let (dir, out) = (scratch(), scratch());
    drop(filled(dir.path(), &[soft(1.0)], 3, 2, 4));
    export(dir.path(), out.path(), Format::Csv).unwrap();
    for table in ["runs", "clog_events", "samples"] {
        let text = std::fs::read_to_string(out.path().join(format!("{table}.csv"))).unwrap();
        assert_eq!(text, answer(dir.path(), &format!("SELECT * FROM {table}"), Format::Csv));
    }
}

#[test]
fn an_export_overwrites_nothing_and_makes_nothing_without_a_store() {
    let (dir, out) = (scratch(), scratch());
    drop(filled(dir.path(), &[soft(1.0)], 1, 1, 4));
    std::fs::write(out.path().join("notes.txt"), "mine").unwrap();
    let refusal = export(dir.path(), out.path(), Format::Parquet).unwrap_err();
    assert!(
        matches!(refusal, QueryError::NotEmpty(_)) && refusal.to_string().contains("name a new folder"),
        "{refusal}"
    );
    assert_eq!(std::fs::read_dir(out.path()).unwrap().count(), 1);
    let nowhere = dir.path().join("nowhere");
    let missing = export(&nowhere, &out.path().join("new"), Format::Parquet).unwrap_err();
    assert!(matches!(missing, QueryError::Store(StoreError::Missing(_))), "{missing}");
    assert!(!nowhere.exists() && !out.path().join("new").exists());
}

#[test]
fn an_export_while_a_run_writes_is_of_one_moment() {
    let (dir, place) = (scratch(), scratch());
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[soft(1.0)], 200);
    let writer = Writer::spawn(store, options(5)).unwrap();
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for seed in 0..200 {
                writer.sender().send(finished(&soft(1.0), seed, 2)).unwrap();
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        });
        for number in 0..10 {
            let out = place.path().join(number.to_string());
            export(dir.path(), &out, Format::Csv).unwrap();
            let text = |table: &str| std::fs::read_to_string(out.join(format!("{table}.csv"))).unwrap();
            let done = text("runs").lines().filter(|line| line.contains(",done,")).count();
            assert_eq!(text("samples").lines().count() - 1, 2 * done);
        }
    });
    writer.finish().unwrap();
}

//! A store of every schema so far opens, is upgraded after a backup, and answers as the program did that wrote it.

use super::make::*;
use meniscus::store::{Store, StoreError, check, open_reading, status};
use rusqlite::Connection;
use std::path::{Path, PathBuf};

fn fixture(schema: usize) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/store/fixtures/schema-{schema}"))
}

/// A copy of the store of this schema, to be upgraded.
fn copy_of(schema: usize) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("samples")).unwrap();
    let store = fixture(schema).join("store");
    std::fs::copy(store.join("store.db"), dir.path().join("store.db")).unwrap();
    for file in std::fs::read_dir(store.join("samples")).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), dir.path().join("samples").join(file.file_name())).unwrap();
    }
    dir
}

/// What the program said that wrote it, without the line of names.
fn said(schema: usize, name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(fixture(schema).join(name)).unwrap();
    text.lines().skip(1).map(str::to_owned).collect()
}

fn schema_of(database: &Path) -> i64 {
    Connection::open(database).unwrap().pragma_query_value(None, "user_version", |row| row.get(0)).unwrap()
}

#[test]
fn a_store_of_every_earlier_schema_answers_the_same_after_its_upgrade() {
    let present = {
        let dir = tempfile::tempdir().unwrap();
        drop(Store::open(dir.path()).unwrap());
        schema_of(&dir.path().join("store.db")) as usize
    };
    let fixtures: Vec<_> = (1..present).filter(|&schema| fixture(schema).exists()).collect();
    assert!(fixtures.starts_with(&[1, 2]), "{fixtures:?}");
    for schema in fixtures {
        let dir = copy_of(schema);
        assert!(matches!(open_reading(dir.path()), Err(StoreError::Older { found, .. }) if found == schema));
        assert_eq!(check(dir.path()).unwrap().findings, [], "a check reads it as it is");
        assert_eq!(schema_of(&dir.path().join("store.db")), schema as i64, "and changes nothing");
        drop(Store::open(dir.path()).unwrap());
        let backup = dir.path().join(format!("store.db.schema-{schema}"));
        assert_eq!(schema_of(&backup), schema as i64);
        assert_eq!(schema_of(&dir.path().join("store.db")), present as i64);
        // `all_runs`: the physics may be another by now, and the runs stale.
        let runs = "SELECT job_id, model, gamma, e_w, density, seed, state, outcome, r_end, t_end, v_g_mean,
                    ek_ratio_end, shape_max, steps FROM all_runs ORDER BY job_id";
        assert_eq!(csv(dir.path(), runs), said(schema, "runs.csv"));
        let clogs = "SELECT job_id, t, r, x, y, ek_ratio, shape, contacts, mechanism
                     FROM clogs JOIN jobs ON jobs.key = clogs.job ORDER BY job_id";
        assert_eq!(csv(dir.path(), clogs), said(schema, "clogs.csv"));
        let samples = "SELECT job_id, t, r, h, y, v_g, ek_ratio, shape, area_error FROM samples ORDER BY job_id, t";
        assert_eq!(csv(dir.path(), samples), said(schema, "samples.csv"));
        assert_eq!(check(dir.path()).unwrap().findings, []);
        let status = status(dir.path()).unwrap();
        assert_eq!(status.total.jobs() + status.stale, 12);
    }
}

#[test]
fn a_newer_store_is_refused_in_words_that_name_both_schemas() {
    let dir = copy_of(2);
    drop(Store::open(dir.path()).unwrap());
    let present = schema_of(&dir.path().join("store.db"));
    let conn = Connection::open(dir.path().join("store.db")).unwrap();
    conn.pragma_update(None, "user_version", present + 1).unwrap();
    drop(conn);
    std::fs::remove_file(dir.path().join("store.db.seal")).unwrap();
    let refusal = Store::open(dir.path()).unwrap_err().to_string();
    assert!(refusal.contains(&format!("schema {}", present + 1)) && refusal.contains(&format!("up to {present}")));
    assert!(check(dir.path()).is_err(), "and is not judged either");
}

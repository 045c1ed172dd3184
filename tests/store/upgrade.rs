//! A store of every schema so far opens, is upgraded after a backup, and answers as the program did that wrote it.

use super::make::*;
use meniscus::store::{Format, Store, StoreError, check, open_reading, status};
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
    assert!(fixtures.starts_with(&[1, 2, 4]), "{fixtures:?}");
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
        let runs = "SELECT job_id, model, gamma, e_w, iif(saturated, 'saturated', density) AS density, seed, state,
                    outcome, r_end, t_end, v_g_mean, ek_ratio_end, shape_max, steps FROM all_runs ORDER BY job_id";
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

/// A store of schema 4 after its upgrade, whose runs are not stale whatever the physics is by now.
fn upgraded() -> tempfile::TempDir {
    let dir = copy_of(4);
    drop(Store::open(dir.path()).unwrap());
    let conn = Connection::open(dir.path().join("store.db")).unwrap();
    conn.execute("UPDATE current SET physics_version = (SELECT max(physics_version) FROM jobs)", []).unwrap();
    dir
}

/// The cells of an answer, its names first.
fn cells(csv: &str) -> Vec<Vec<String>> {
    let rows = csv::ReaderBuilder::new().has_headers(false).from_reader(csv.as_bytes()).into_records();
    rows.map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect()
}

#[test]
fn old_queries_on_old_names_answer_as_they_did_apart_from_the_word_of_density() {
    let dir = upgraded();
    let text = std::fs::read_to_string(fixture(4).join("answers.json")).unwrap();
    let answers: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    assert!(answers.len() > 15);
    for old in answers {
        let (sql, told) = (old["sql"].as_str().unwrap(), cells(old["csv"].as_str().unwrap()));
        let found = cells(&answer(dir.path(), sql, Format::Csv));
        assert_eq!(found.len(), told.len(), "{sql}");
        for (found, mut told) in found.into_iter().zip(told) {
            told.iter_mut().filter(|cell| *cell == "saturated").for_each(String::clear);
            // After `select *` new columns follow the old ones.
            assert!(found.starts_with(&told), "{sql}\n{found:?}\n{told:?}");
            assert!(found.len() == told.len() || sql.starts_with("select * from"), "{sql}");
        }
    }
}

#[test]
fn an_upgrade_fills_the_new_columns_from_what_the_store_says_of_points_and_campaigns() {
    let dir = upgraded();
    let sql = "SELECT block, model, box_size, density, saturated, alpha, gravity, h_start, t_max, shapes_every,
                      round(bond, 3) AS bond, count(*) FROM runs GROUP BY point_id ORDER BY block, gamma, box_size";
    assert_eq!(
        csv(dir.path(), sql),
        [
            "channels,SP,,,,1.3333333333333333,,-2.0,300.0,,,2",
            "full,SP,20.0,,1,1.5,,,300.0,,,2",
            "points,SP,20.0,0.7,0,1.3333333333333333,,,300.0,,,2",
            "points,SP,24.0,0.7,0,1.3333333333333333,,,300.0,,,2",
            "rings,DP,500.0,0.7,0,1.3333333333333333,centroid,,300.0,,3.333,2",
            "rings,DP,500.0,0.7,0,1.3333333333333333,centroid,,300.0,,1.0,2",
        ]
    );
}

#[test]
fn a_text_that_cannot_be_read_does_not_stop_an_upgrade() {
    let dir = copy_of(4);
    let conn = Connection::open(dir.path().join("store.db")).unwrap();
    conn.execute_batch(
        "UPDATE campaigns SET text = 'name = ';
         UPDATE points SET spec = '{' WHERE density = 'saturated';
         UPDATE points SET spec = x'ff' WHERE model = 'DP';",
    )
    .unwrap();
    drop(conn);
    drop(Store::open(dir.path()).unwrap());
    let sql =
        "SELECT model, scene, gamma, density, saturated, box_size, block FROM points JOIN jobs ON point = points.key
               WHERE seed = 0 ORDER BY 1, 2, 3, 4";
    assert_eq!(
        csv(dir.path(), sql),
        [
            "DP,obstacles,0.3,0.7,0,,",
            "DP,obstacles,1.0,0.7,0,,",
            "SP,channel,,,,,",
            "SP,obstacles,,,1,,",
            "SP,obstacles,,0.7,0,20.0,",
            "SP,obstacles,,0.7,0,24.0,",
        ]
    );
}

#[test]
fn a_damaged_store_of_an_earlier_schema_is_rescued_with_its_saturated_runs() {
    let dir = copy_of(4);
    let path = dir.path().join("store.db");
    let mut bytes = std::fs::read(&path).unwrap();
    // The reserved bytes of each page, which no store has: SQLite then finds every page in disorder.
    bytes[20] = 7;
    std::fs::write(&path, bytes).unwrap();
    assert_ne!(check(dir.path()).unwrap().findings, []);
    meniscus::store::repair(dir.path()).unwrap();
    assert_eq!(check(dir.path()).unwrap().findings, []);
    let sql = "SELECT count(*), sum(saturated), count(block) FROM all_runs WHERE state = 'done'";
    assert_eq!(csv(dir.path(), sql), ["12,2,12"]);
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

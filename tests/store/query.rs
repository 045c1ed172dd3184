//! SQL over a store: columns, the table `samples`, formats, errors.

use super::make::*;
use meniscus::parameters::{Density, ObstacleField, Scene};
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use meniscus::store::{Answer, Format, MOST_TABLE_ROWS, QueryError, Store, Writer, query};
use std::io::{ErrorKind, Write};

#[test]
fn functions_of_numbers_are_there_and_give_null_where_they_have_no_value() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let sql = "SELECT sqrt(9), exp(0), ln(1), log10(1000), floor(-1.5), ceil(1.5), power(2, 10), sqrt(-1), exp(NULL)";
    let numbers = answer(dir.path(), sql, Format::Csv);
    assert_eq!(numbers.lines().nth(1), Some("3.0,1.0,0.0,3.0,-2.0,2.0,1024.0,,"));
}

#[test]
fn median_stddev_and_percentile_leave_out_null_and_what_is_no_number() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let numbers = |values: &str, asked: &str| csv(dir.path(), &format!("SELECT {asked} FROM (VALUES {values}) AS v"));
    let asked = "median(column1), stddev(column1), percentile(column1, 25), percentile(column1, 100)";
    assert_eq!(numbers("(4), (NULL), (1.0), ('word'), (2), (3.5)", asked), ["2.75,1.3768926368215255,1.75,4.0"]);
    assert_eq!(numbers("(7)", asked), ["7.0,,7.0,7.0"], "one number has no scatter");
    assert_eq!(numbers("(NULL), ('word')", asked), [",,,"]);
    assert_eq!(numbers("(1e999), (1e999), (-1e999)", "median(column1)"), ["inf"]);
    let groups = "SELECT model, median(seed) FROM (VALUES ('DP', 1), ('SP', 5), ('SP', 7)) AS v GROUP BY 1";
    let groups = groups.replace("model, median(seed)", "column1, median(column2)");
    assert_eq!(csv(dir.path(), &groups), ["DP,1.0", "SP,6.0"]);
    for p in ["-1", "101", "column1", "NULL"] {
        let sql = format!("SELECT percentile(column1, {p}) FROM (VALUES (1), (2)) AS v");
        let error = query(dir.path(), &sql, Format::Csv, &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("one number from 0 to 100"), "{p}: {error}");
    }
}

#[test]
fn an_unknown_column_is_answered_with_those_of_the_tables_asked() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let error = query(dir.path(), "SELECT speed FROM runs", Format::Csv, &mut Vec::new()).unwrap_err().to_string();
    assert!(error.contains("no such column: speed") && error.contains("runs has: job_id, campaign"), "{error}");
    assert!(!error.contains("samples has"), "{error}");
}

#[test]
fn a_run_reads_back_with_its_parameters_and_null_where_a_column_means_nothing() {
    let dir = tempfile::tempdir().unwrap();
    filled(dir.path(), &[soft(2.5), ring(1.09)], 1, 1, 10);
    let sql = "SELECT campaign, model, gamma, e_w, density, b0, v_t, kappa, w, n_vertices, dt, state, outcome, r_end,
               v_g_mean, shape_max, steps, attempts FROM runs ORDER BY model";
    assert_eq!(
        csv(dir.path(), sql),
        [
            "test,DP,1.09,10000.0,,0.0,0.03,0.001,,256,0.001,done,clogged,1.0,,1.3,1000000,1",
            "test,SP,,2.5,0.35,0.0,0.03,,,,0.001,done,clogged,1.0,,,1000000,1",
        ]
    );
}

#[test]
fn samples_join_with_runs_and_equal_what_was_written_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    // Short series share pages, and the long one spans pages and Arrow batches.
    let points = [(soft(1.0), 40, 3), (ring(0.3), 2, 70_000)];
    for (point, seeds, rows) in &points {
        drop(filled(dir.path(), std::slice::from_ref(point), *seeds, *rows, 15));
    }
    for (point, seeds, rows) in points {
        let model = point.model.name();
        let sql = format!(
            "SELECT seed, samples.t, samples.ek_ratio, v_g, shape, area_error FROM runs JOIN samples USING (job_id)
             WHERE model = '{model}' ORDER BY seed, t"
        );
        let mut lines = csv(dir.path(), &sql).into_iter();
        for seed in 0..seeds {
            let samples = trajectory(&point, seed, rows).samples;
            for row in 0..rows {
                let optional =
                    |column: &Vec<f64>| column.get(row).map(|value| format!("{value:?}")).unwrap_or_default();
                let (t, ek_ratio, v_g) = (samples.t[row], samples.ek_ratio[row], samples.v_g[row]);
                let (shape, area_error) = (optional(&samples.shape), optional(&samples.area_error));
                assert_eq!(lines.next().unwrap(), format!("{seed},{t:?},{ek_ratio:?},{v_g:?},{shape},{area_error}"));
            }
        }
        assert_eq!(lines.next(), None);
    }
}

#[test]
fn a_scan_and_a_lookup_of_samples_agree_on_any_choice_of_columns() {
    let dir = tempfile::tempdir().unwrap();
    drop(filled(dir.path(), &[ring(0.3), soft(1.0)], 7, 5, 4));
    for columns in ["*", "job_id, y", "shape", "area_error, t, job_id", "count(*), max(h)"] {
        let scan =
            csv(dir.path(), &format!("SELECT {columns} FROM samples WHERE +job_id IN (SELECT job_id FROM runs)"));
        let lookup =
            csv(dir.path(), &format!("SELECT {columns} FROM samples WHERE job_id IN (SELECT job_id FROM runs)"));
        let sorted = |mut lines: Vec<String>| {
            lines.sort();
            lines
        };
        assert!(!scan.is_empty());
        assert_eq!(sorted(scan), sorted(lookup), "{columns}");
    }
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM samples WHERE job_id = 'nobody' OR job_id = 7"), ["0"]);
}

#[test]
fn sqlite_loops_over_jobs_and_looks_their_samples_up_whichever_way_a_join_is_written() {
    let dir = tempfile::tempdir().unwrap();
    drop(filled(dir.path(), &[soft(1.0)], 3, 2, 10));
    for join in [
        "runs JOIN samples USING (job_id)",
        "samples JOIN runs USING (job_id)",
        "clog_events JOIN samples USING (job_id)",
        "samples JOIN clog_events USING (job_id) JOIN runs USING (job_id)",
    ] {
        let plan = csv(dir.path(), &format!("EXPLAIN QUERY PLAN SELECT * FROM {join}"));
        let samples = plan.iter().position(|line| line.contains("samples")).unwrap();
        assert!(samples > 0, "{join}: {plan:#?}");
        // Odd plan numbers are those with the job given.
        let number = plan[samples].rsplit("INDEX ").next().unwrap().split(':').next().unwrap();
        assert_eq!(number.parse::<u32>().unwrap() % 2, 1, "{join}: {plan:#?}");
    }
}

#[test]
fn the_table_outline_has_every_vertex_of_every_shape() {
    let dir = tempfile::tempdir().unwrap();
    drop(filled(dir.path(), &[ring(0.3), soft(1.0)], 3, 2, 10));
    let sql = "SELECT model, seed, t, vertex, x, y FROM runs JOIN outline USING (job_id)
               ORDER BY model, seed, t, vertex";
    let mut lines = csv(dir.path(), sql).into_iter();
    for (point, is_ring) in [(ring(0.3), true), (soft(1.0), false)] {
        for (seed, t) in [(0, 0.0), (0, 1000.0), (1, 0.0), (1, 1000.0), (2, 0.0), (2, 1000.0)] {
            let shape = outline(t, seed, is_ring);
            for (vertex, (x, y)) in shape.x.iter().zip(&shape.y).enumerate() {
                let model = point.model.name();
                assert_eq!(lines.next().unwrap(), format!("{model},{seed},{t:?},{vertex},{x:?},{y:?}"));
            }
        }
    }
    assert_eq!(lines.next(), None);
    let scan = csv(dir.path(), "SELECT * FROM outline WHERE +job_id IN (SELECT job_id FROM runs)");
    let lookup = csv(dir.path(), "SELECT * FROM outline WHERE job_id IN (SELECT job_id FROM runs)");
    let sorted = |mut lines: Vec<String>| {
        lines.sort();
        lines
    };
    assert_eq!((scan.len(), sorted(scan)), (36, sorted(lookup)));
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM outline WHERE job_id = 'nobody' OR job_id = 7"), ["0"]);
    for join in ["outline JOIN runs USING (job_id)", "clog_events JOIN obstacles USING (job_id)"] {
        let plan = csv(dir.path(), &format!("EXPLAIN QUERY PLAN SELECT * FROM {join}"));
        assert!(plan.iter().any(|line| line.contains("VIRTUAL TABLE INDEX 1")), "it looks jobs up: {plan:#?}");
    }
}

#[test]
fn the_table_obstacles_has_every_disc_near_the_path_and_no_other() {
    let dir = tempfile::tempdir().unwrap();
    let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(1.0), box_size: 20.0 };
    let mut point = soft(1.0);
    point.scene = Scene::Obstacles(field.clone());
    // The path leaves the box below, so there are images of discs beside it.
    drop(filled(dir.path(), &[point.clone()], 2, 40, 10));
    let sql = "SELECT seed, obstacle, x, y, radius FROM runs JOIN obstacles USING (job_id) ORDER BY seed, x, y";
    let found = csv(dir.path(), sql);
    let mut expected = Vec::new();
    for seed in 0..2 {
        let (array, samples) = (ObstacleArray::generate(&field, seed).unwrap(), trajectory(&point, seed, 40).samples);
        // The path is straight, and the shapes are one point elsewhere.
        let shape = outline(0.0, seed, false);
        let ends = [0, 39].map(|row| [samples.h[row], samples.y[row]]);
        let steps = (0..=4000).map(|k| f64::from(k) / 4000.0);
        let way = steps.map(|s| [0, 1].map(|i| ends[0][i] + s * (ends[1][i] - ends[0][i])));
        let way: Vec<[f64; 2]> = way.chain([[shape.x[0], shape.y[0]]]).collect();
        let mut near = Vec::new();
        array.for_each_in([0.0; 2], [-20.0, 300.0, -60.0, 20.0], |disc| {
            if way.iter().any(|[x, y]| libm::hypot(x - disc.x, y - disc.y) <= 1.0 + array.radius) {
                near.push((disc.id, disc.x, disc.y));
            }
        });
        near.sort_by(|a, b| a.1.total_cmp(&b.1));
        expected.extend(near.iter().map(|(id, x, y)| format!("{seed},{id},{x:?},{y:?},0.15")));
    }
    assert!(expected.len() > 100, "{}", expected.len());
    assert_eq!(found, expected);
}

#[test]
fn scenes_without_discs_have_no_rows_in_obstacles() {
    let dir = tempfile::tempdir().unwrap();
    let mut plate = soft(1.0);
    plate.scene = Scene::Plate;
    drop(filled(dir.path(), &[plate], 2, 4, 10));
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM obstacles"), ["0"]);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM outline"), ["4"]);
}

#[test]
fn a_table_stops_at_ten_thousand_rows_and_what_programs_read_does_not() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let rows = |rows: usize| {
        format!("WITH RECURSIVE c(n) AS (VALUES (1) UNION ALL SELECT n + 1 FROM c LIMIT {rows}) SELECT n FROM c")
    };
    for (asked, format, lines, extent) in [
        (MOST_TABLE_ROWS, Format::Table, MOST_TABLE_ROWS + 1, Answer::Whole),
        (2 * MOST_TABLE_ROWS, Format::Table, MOST_TABLE_ROWS + 1, Answer::Cut),
        (2 * MOST_TABLE_ROWS, Format::Csv, 2 * MOST_TABLE_ROWS + 1, Answer::Whole),
        (2 * MOST_TABLE_ROWS, Format::Json, 2 * MOST_TABLE_ROWS + 2, Answer::Whole),
    ] {
        let mut out = Vec::new();
        assert_eq!(query(dir.path(), &rows(asked), format, &mut out).unwrap(), extent);
        assert_eq!(String::from_utf8(out).unwrap().lines().count(), lines, "{asked} rows as {format:?}");
    }
}

#[test]
fn a_table_says_how_long_bytes_are_and_other_formats_give_them() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    assert!(answer(dir.path(), "SELECT zeroblob(4096) AS b", Format::Table).contains("<4096 bytes>"));
    assert_eq!(csv(dir.path(), "SELECT x'00ff'"), ["00ff"]);
}

#[test]
fn statements_that_write_or_ask_for_nothing_are_refused_and_leave_nothing() {
    let dir = tempfile::tempdir().unwrap();
    drop(filled(dir.path(), &[soft(1.0)], 1, 2, 10));
    let here = dir.path().display();
    let files = || {
        let mut files: Vec<_> =
            std::fs::read_dir(dir.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        files.sort();
        files
    };
    csv(dir.path(), "SELECT 1");
    let before = files();
    for sql in [
        &format!("VACUUM INTO '{here}/copy.db'"),
        &format!("  vacuum main into '{here}/copy.db'"),
        "DROP TABLE jobs",
        "CREATE TEMP TABLE mine (x)",
        "CREATE VIRTUAL TABLE temp.mine USING fts5(x)",
        "PRAGMA user_version = 7",
        "PRAGMA journal_mode = delete",
        "REINDEX",
    ] {
        let error = query(dir.path(), sql, Format::Csv, &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("a query only reads") && error.contains("`meniscus run`"), "{sql}: {error}");
    }
    for sql in ["", "  \n", "-- a comment", ";", "BEGIN", &format!("ATTACH '{here}/new.db' AS new")] {
        let error = query(dir.path(), sql, Format::Csv, &mut Vec::new()).unwrap_err().to_string();
        assert!(error.contains("asks for nothing") && error.contains("select * from runs"), "{sql}: {error}");
    }
    let two = query(dir.path(), "SELECT 1; SELECT 2", Format::Csv, &mut Vec::new()).unwrap_err().to_string();
    assert!(two.contains("one statement"), "{two}");
    assert_eq!(files(), before);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM jobs; -- all of them"), ["1"]);
}

#[test]
fn counts_and_ids_come_from_an_index_alone_and_parameters_lead_to_their_jobs() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let plan = |sql: &str| csv(dir.path(), &format!("EXPLAIN QUERY PLAN {sql}")).join("\n");
    let ids = plan("SELECT job_id, state FROM jobs ORDER BY job_id");
    assert!(ids.contains("COVERING INDEX jobs_by_id") && !ids.contains("TEMP B-TREE"), "{ids}");
    let counts = plan(
        "SELECT campaign, state, count(*) FROM jobs WHERE physics_version = (SELECT physics_version FROM current)
         GROUP BY campaign, state",
    );
    assert!(counts.contains("COVERING INDEX jobs_by_state") && !counts.contains("TEMP B-TREE"), "{counts}");
    let by_parameter = plan("SELECT job_id FROM runs WHERE gamma = 1.09");
    assert!(by_parameter.contains("SEARCH jobs USING INDEX jobs_by_point"), "{by_parameter}");
    let seeds = plan("SELECT job_id, seed FROM runs");
    assert!(!seeds.contains("points") && !seeds.contains("outcomes"), "{seeds}");
}

#[test]
fn queries_work_while_a_run_writes() {
    let dir = tempfile::tempdir().unwrap();
    let mut store = Store::open(dir.path()).unwrap();
    register(&mut store, &[soft(1.0)], 300);
    let writer = Writer::spawn(store, options(10)).unwrap();
    std::thread::scope(|scope| {
        scope.spawn(|| (0..300).for_each(|seed| writer.sender().send(finished(&soft(1.0), seed, 2)).unwrap()));
        loop {
            let sql = "SELECT (SELECT count(*) FROM runs WHERE state = 'done'),
                              (SELECT count(*) FROM runs JOIN samples USING (job_id) WHERE state = 'done')";
            let line = &csv(dir.path(), sql)[0];
            let (done, rows) = line.split_once(',').unwrap();
            let (done, rows): (u64, u64) = (done.parse().unwrap(), rows.parse().unwrap());
            assert_eq!(rows, 2 * done, "an outcome and its samples come together");
            if done == 300 {
                break;
            }
        }
    });
    writer.finish().unwrap();
}

#[test]
fn each_format_tells_the_same_rows() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let sql = "SELECT 1 AS n, 1e-17 AS x, 'a \"b\", c' AS text, NULL AS none
               UNION ALL SELECT 20, 123456.789, '', 0.5";
    assert_eq!(
        answer(dir.path(), sql, Format::Csv),
        "n,x,text,none\n1,1e-17,\"a \"\"b\"\", c\",\n20,123456.789,\"\",0.5\n"
    );
    let json = answer(dir.path(), sql, Format::Json);
    let rows: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(rows[0], serde_json::json!({"n": 1, "x": 1e-17, "text": "a \"b\", c", "none": null}));
    assert_eq!(json.lines().count(), 4, "one object a line");
    let table = answer(dir.path(), sql, Format::Table);
    let lines: Vec<_> = table.lines().map(str::trim_end).collect();
    assert_eq!(lines[0].split_whitespace().collect::<Vec<_>>(), ["n", "x", "text", "none"]);
    assert!(lines[1].starts_with("  1 ") && lines[2].starts_with(" 20 "), "numbers are aligned: {table}");
    assert!(lines[2].contains("123457.0") && lines[1].contains("1e-17"), "{table}");
    assert_eq!(
        serde_json::from_str::<serde_json::Value>(&answer(dir.path(), "SELECT 1 WHERE 0", Format::Json)).unwrap(),
        serde_json::json!([])
    );
}

#[test]
fn a_parquet_answer_keeps_types_and_makes_names_distinct() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let mut out = Vec::new();
    let sql = "SELECT 1 AS n, 0.5 AS n, 'a' AS text UNION ALL SELECT NULL, 3, 4";
    query(dir.path(), sql, Format::Parquet, &mut out).unwrap();
    let path = dir.path().join("answer.parquet");
    std::fs::write(&path, out).unwrap();
    let reader = SerializedFileReader::try_from(path.as_path()).unwrap();
    let rows: Vec<String> = reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).collect();
    assert_eq!(rows, ["{n: 1.0, n_2: 0.5, text: \"a\"}", "{n: null, n_2: 3.0, text: \"4\"}"]);
}

#[test]
fn an_error_names_the_place_and_the_tables_that_exist() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let error = |sql: &str| query(dir.path(), sql, Format::Csv, &mut Vec::new()).unwrap_err().to_string();
    let unknown = error("SELECT * FROM run");
    assert!(unknown.contains("no such table: run"), "{unknown}");
    assert!(
        unknown.contains(
            "there are: samples, outline, obstacles, all_runs, arrest_events, clog_events, failures, lambda_fits, pinch_events, runs, shapes"
        ),
        "{unknown}"
    );
    let column = error("SELECT job_id,\n gama FROM runs");
    assert!(column.contains("no such column: gama\n   gama FROM runs\n   ^"), "{column}");
    assert!(error("DELETE FROM jobs").contains("a query only reads"), "a query cannot write");
}

#[test]
fn a_closed_pipe_ends_a_query_quietly_and_other_output_errors_do_not() {
    struct Broken(ErrorKind);
    impl Write for Broken {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(self.0.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    for format in [Format::Table, Format::Csv, Format::Json, Format::Parquet] {
        let asked = |kind| query(dir.path(), "SELECT 1", format, &mut Broken(kind));
        asked(ErrorKind::BrokenPipe).unwrap();
        assert!(matches!(asked(ErrorKind::StorageFull), Err(QueryError::Output(_))));
    }
}

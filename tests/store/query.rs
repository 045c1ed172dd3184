//! SQL over a store: columns, the table `samples`, formats, errors.

use super::make::*;
use meniscus::store::{Format, QueryError, Store, Writer, query};
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
        unknown.contains("there are: samples, all_runs, clog_events, failures, lambda_fits, runs, shapes"),
        "{unknown}"
    );
    let column = error("SELECT job_id,\n gama FROM runs");
    assert!(column.contains("no such column: gama\n   gama FROM runs\n   ^"), "{column}");
    assert!(error("DELETE FROM jobs").contains("readonly"), "a query cannot write");
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

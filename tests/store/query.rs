//! SQL over a store: columns, the table `samples`, formats, errors.

use super::make::*;
use meniscus::store::{Format, QueryError, Store, Writer, point_runs, query, save_fits};
use std::io::{ErrorKind, Write};

/// The columns of a view or table, joined by commas.
fn columns(dir: &std::path::Path, table: &str) -> String {
    answer(dir, &format!("SELECT * FROM {table} LIMIT 0"), Format::Csv).trim().to_owned()
}

/// The keys that a campaign may give, in the order of the new columns of `runs`.
const NEW_KEYS: &str = "saturated,box_size,bond,delta,eps,wall,contact,gravity,self_contact,engulfed";

#[test]
fn the_views_have_the_columns_of_the_contract_the_old_ones_in_their_places() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    let old = "job_id,campaign,model,scene,gamma,e_w,w_ob,sigma_ob,density,b0,v_t,k_a,kappa,w,n_vertices,dt,\
               integrator,seed,state,outcome,r_end,t_end,v_g_mean,ek_ratio_end,shape_max,area_error_max,overlap_max,\
               delta_s,steps,wall_s,attempts,error_class,error";
    let (places, limits) =
        ("angle,tip_radius,offset,h_start,h_end,alpha", "t_max,distance,ek_threshold,sample_every,shapes_every");
    let runs = format!("{old},point_id,block,{NEW_KEYS},{places},{limits}");
    assert_eq!(columns(dir.path(), "runs"), runs);
    assert_eq!(columns(dir.path(), "stale_runs"), runs);
    assert_eq!(columns(dir.path(), "clog_events"), "job_id,t,r,x,y,ek_ratio,shape,contacts,mechanism");
    let health = "job_id,energy_rise_max,area_error_max,overlap_max,ek_ratio_min,engulfed_t,refused,error_class";
    assert_eq!(columns(dir.path(), "stability"), health);
    assert_eq!(columns(dir.path(), "samples"), "job_id,t,r,h,y,v_g,ek_ratio,shape,area_error");
    let point = "model,scene,gamma,e_w,w_ob,sigma_ob,density,b0,v_t,k_a,kappa,n_vertices,dt";
    let fit = "runs,clogs,lambda,lambda_low,lambda_high,lambda_least_squares,p_exponential,runs_for_ten_percent";
    let shares = "wrap_share,squeeze_share,hybrid_share";
    let more = format!("{NEW_KEYS},w,{places},integrator,{limits}");
    let fits = format!("{point},{fit},{shares},point_id,decay_length,{more}");
    assert_eq!(columns(dir.path(), "lambda_fits"), fits);
    assert_eq!(columns(dir.path(), "shapes"), "job_id,t,vertices,loads");
    let speeds = format!("{point},runs,flowing,v_g,v_g_low,v_g_high,ca,point_id,{more}");
    assert_eq!(columns(dir.path(), "speed_averages"), speeds);
}

#[test]
fn every_parameter_of_a_point_is_a_column_of_runs_and_of_the_fits() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    for view in ["runs", "stale_runs", "lambda_fits", "speed_averages"] {
        let there = columns(dir.path(), view);
        let missing: Vec<_> = meniscus::parameters::PARAMETERS
            .iter()
            .map(|parameter| parameter.name)
            .filter(|name| !there.split(',').any(|column| column == *name))
            .collect();
        assert!(missing.is_empty(), "{view} lacks {missing:?}");
    }
}

#[test]
fn every_column_of_every_view_declares_one_type_and_that_of_the_parameter() {
    use meniscus::parameters::Domain;
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    for view in ["runs", "all_runs", "lambda_fits", "speed_averages", "clog_events", "shapes", "stability", "failures"]
    {
        for column in csv(dir.path(), &format!("SELECT name, type FROM pragma_table_info('{view}')")) {
            let (name, declared) = column.split_once(',').unwrap();
            assert!(["TEXT", "REAL", "INTEGER", "BLOB"].contains(&declared), "{view}.{column}");
            for parameter in meniscus::parameters::PARAMETERS.iter().filter(|parameter| parameter.name == name) {
                let expected = match parameter.domain {
                    Domain::Text | Domain::Choice(_) => "TEXT",
                    Domain::Number(_) | Domain::NumberOr(..) => "REAL",
                    Domain::Whole(_) => "INTEGER",
                };
                assert_eq!(declared, expected, "{view}.{name}");
            }
        }
    }
}

/// Both models in three arrays that differ in one column each, with two clogs a point, and their fits.
fn fitted(dir: &std::path::Path) -> Store {
    let points: Vec<_> = [soft(1.0), ring(1.0)]
        .into_iter()
        .flat_map(|point| {
            let (mut wider, mut shorter) = (point.clone(), point.clone());
            if let meniscus::parameters::Scene::Obstacles(field) = &mut wider.scene {
                field.box_size = 60.0;
            }
            shorter.limits.distance = Some(20.0);
            [point, wider, shorter]
        })
        .collect();
    let mut store = filled(dir, &points, 5, 1, 10);
    let runs = point_runs(store.connection()).unwrap();
    let fits = meniscus::study::fits::fit_all(&runs);
    let lambdas: Vec<_> = fits.iter().map(|fit| (fit.point.point_id, fit.lambda)).collect();
    let speeds: Vec<_> = fits.iter().map(|fit| (fit.point.point_id, fit.speed)).collect();
    save_fits(&mut store, &lambdas, &speeds).unwrap();
    store
}

#[test]
fn one_column_joins_runs_with_both_fits_and_loses_no_row() {
    let dir = tempfile::tempdir().unwrap();
    drop(fitted(dir.path()));
    let joined = "FROM runs JOIN lambda_fits USING (point_id) JOIN speed_averages USING (point_id)";
    assert_eq!(csv(dir.path(), &format!("SELECT count(*), count(DISTINCT job_id) {joined}")), ["30,30"]);
    let by_key = "SELECT box_size, distance, count(*) FROM lambda_fits GROUP BY 1, 2 ORDER BY 1, 2";
    assert_eq!(csv(dir.path(), by_key), ["60.0,,2", "500.0,,2", "500.0,20.0,2"]);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM lambda_fits WHERE decay_length IS NOT lambda"), ["0"]);
    let shares = "SELECT model, wrap_share, squeeze_share FROM lambda_fits GROUP BY 1, 2, 3";
    assert_eq!(csv(dir.path(), shares), ["DP,1.0,0.0", "SP,,"]);
}

#[test]
fn a_natural_join_that_would_lose_rows_is_refused_with_the_join_to_write() {
    let dir = tempfile::tempdir().unwrap();
    drop(fitted(dir.path()));
    let refused = |sql: &str| query(dir.path(), sql, Format::Csv, &mut Vec::new()).unwrap_err().to_string();
    let told = refused("SELECT count(*) FROM runs NATURAL JOIN lambda_fits");
    assert!(told.contains("runs join lambda_fits using (point_id)"), "{told}");
    assert!(refused("SELECT * FROM speed_averages NATURAL JOIN lambda_fits").contains("using (point_id)"));
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM runs NATURAL JOIN clog_events"), ["12"]);
}

#[test]
fn the_mean_of_a_density_counts_no_word() {
    let dir = tempfile::tempdir().unwrap();
    drop(filled(dir.path(), &[soft(1.0), ring(1.0)], 1, 1, 10));
    let sql = "SELECT avg(density), sum(saturated), count(*) - count(saturated), max(typeof(density)) FROM runs";
    assert_eq!(csv(dir.path(), sql), ["0.35,1,0,real"]);
}

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
    assert_eq!(rows, ["{n: 1, n_2: 0.5, text: \"a\"}", "{n: null, n_2: 3.0, text: \"4\"}"]);
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

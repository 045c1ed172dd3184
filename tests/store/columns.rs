//! The columns of the views: their names and types, what they hold of a campaign, and how they join.

use super::make::*;
use meniscus::campaign::file::Campaign;
use meniscus::parameters::{Domain, PARAMETERS, Scene};
use meniscus::store::{CampaignRecord, Format, PlannedPoint, Store, point_runs, query, save_fits};
use meniscus::study::fits::fit_all;
use std::path::Path;

/// The columns of a view or table, joined by commas.
fn columns(dir: &Path, table: &str) -> String {
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
    let runs = format!("{old},point_id,block,{NEW_KEYS},{places},{limits},dynamics,step_error");
    assert_eq!(columns(dir.path(), "runs"), runs);
    assert_eq!(columns(dir.path(), "stale_runs"), runs);
    assert_eq!(columns(dir.path(), "clog_events"), "job_id,t,r,x,y,ek_ratio,shape,contacts,mechanism");
    assert_eq!(columns(dir.path(), "arrest_events"), "job_id,r,x,y,way_left,energy_left");
    assert_eq!(columns(dir.path(), "pinch_events"), "job_id,t,r,x,y");
    let health = "job_id,energy_rise_max,area_error_max,overlap_max,ek_ratio_min,engulfed_t,refused,error_class";
    assert_eq!(columns(dir.path(), "stability"), health);
    assert_eq!(columns(dir.path(), "samples"), "job_id,t,r,h,y,v_g,ek_ratio,shape,area_error");
    let point = "model,scene,gamma,e_w,w_ob,sigma_ob,density,b0,v_t,k_a,kappa,n_vertices,dt";
    let fit = "runs,clogs,lambda,lambda_low,lambda_high,lambda_least_squares,p_exponential,runs_for_ten_percent";
    let shares = "wrap_share,squeeze_share,hybrid_share";
    let more = format!("{NEW_KEYS},w,{places},integrator,{limits},dynamics,step_error");
    let cut = "by_distance,by_time,beyond_box,lambda_if_stuck,weibull_shape,weibull_low,weibull_high,r_from";
    let fits = format!("{point},{fit},{shares},point_id,decay_length,{more},arrested,{cut}");
    assert_eq!(columns(dir.path(), "lambda_fits"), fits);
    assert_eq!(columns(dir.path(), "survival"), "point_id,r,at_risk,clogs,survival,survival_low,survival_high");
    assert_eq!(columns(dir.path(), "shapes"), "job_id,t,vertices,loads");
    let speeds = format!("{point},runs,flowing,v_g,v_g_low,v_g_high,ca,point_id,{more},by_distance,by_time,arrested");
    assert_eq!(columns(dir.path(), "speed_averages"), speeds);
}

#[test]
fn every_parameter_of_a_point_is_a_column_of_runs_and_of_the_fits() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    for view in ["runs", "stale_runs", "lambda_fits", "speed_averages"] {
        let there = columns(dir.path(), view);
        let missing: Vec<_> = PARAMETERS
            .iter()
            .map(|parameter| parameter.name)
            .filter(|name| !there.split(',').any(|column| column == *name))
            .collect();
        assert!(missing.is_empty(), "{view} lacks {missing:?}");
    }
}

#[test]
fn every_column_of_every_view_declares_one_type_and_that_of_the_parameter() {
    let dir = tempfile::tempdir().unwrap();
    drop(Store::open(dir.path()).unwrap());
    for view in ["runs", "all_runs", "lambda_fits", "speed_averages", "clog_events", "shapes", "stability", "failures"]
    {
        for column in csv(dir.path(), &format!("SELECT name, type FROM pragma_table_info('{view}')")) {
            let (name, declared) = column.split_once(',').unwrap();
            assert!(["TEXT", "REAL", "INTEGER", "BLOB"].contains(&declared), "{view}.{column}");
            for parameter in PARAMETERS.iter().filter(|parameter| parameter.name == name) {
                let expected = match parameter.domain {
                    Domain::Text | Domain::Choice(_) => "TEXT",
                    Domain::Number(_) | Domain::NumberOr(..) => "REAL",
                    Domain::Whole(_) | Domain::WholeOr(..) => "INTEGER",
                };
                assert_eq!(declared, expected, "{view}.{name}");
            }
        }
    }
}

/// Both models in three arrays that differ in one column each, with two clogs a point, and their fits.
fn fitted(dir: &Path) -> Store {
    let points: Vec<_> = [soft(1.0), ring(1.0)]
        .into_iter()
        .flat_map(|point| {
            let (mut wider, mut shorter) = (point.clone(), point.clone());
            if let Scene::Obstacles(field) = &mut wider.scene {
                field.box_size = 60.0;
            }
            shorter.limits.distance = Some(20.0);
            [point, wider, shorter]
        })
        .collect();
    let mut store = filled(dir, &points, 5, 1, 10);
    let runs = point_runs(store.connection()).unwrap();
    let fits = fit_all(&runs, 0.0);
    save_fits(&mut store, &fits).unwrap();
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

/// Registers a campaign given as text; nothing is run.
fn planned(dir: &Path, text: &str) {
    let campaign = Campaign::parse("c.toml", text).unwrap_or_else(|errors| panic!("{}", errors.render(false)));
    let points: Vec<_> = campaign
        .blocks
        .iter()
        .flat_map(|block| {
            let points = block.points.iter().zip(&block.point_ids);
            points.map(|(point, &point_id)| PlannedPoint {
                point,
                point_id,
                seeds: block.seeds.clone(),
                block: &block.name,
            })
        })
        .collect();
    let record = CampaignRecord { name: &campaign.name, text: &campaign.text };
    Store::open(dir).unwrap().register(&record, &points).unwrap();
}

#[test]
fn a_grid_over_any_key_is_grouped_by_that_key() {
    let head = "name = \"c\"\nmodel = \"DP\"\ndynamics = \"vertex\"\nruns_per_point = 1\n";
    let scenes = [
        ("obstacles", "gamma = 1.0, w_ob = 0.2, sigma_ob = 0.3, density = 0.5, box_size = 50.0, distance = 9.0"),
        ("channel", "gamma = 1.0, w = 0.9, angle = 45.0, tip_radius = 0.1, h_start = -3.0, h_end = 2.0"),
        ("disc", "gamma = 1.0, sigma_ob = 0.5, offset = 0.1, h_start = -3.0, h_end = 2.0, shapes_every = 5.0"),
        ("plate", "gamma = 1.0, kappa = 1e-3, k_a = 1e4, n_vertices = 64, e_w = 1e4, delta = 0.012, eps = 0.1"),
        ("plate", "gamma = 1.0, v_t = 0.03, b0 = 0.2, alpha = 1.0, dt = 1e-4, t_max = 100.0, ek_threshold = 1e-12"),
        ("plate", "bond = 1.0, sample_every = 10.0, k_a = 1e4"),
    ];
    for (scene, axes) in scenes {
        let axes: Vec<(&str, f64)> = axes
            .split(", ")
            .map(|axis| axis.split_once(" = ").unwrap())
            .map(|(key, value)| (key, value.parse().unwrap()))
            .collect();
        for (varied, _) in axes.iter().filter(|(key, _)| *key != "n_vertices") {
            let axis = |(key, value): &(&str, f64)| match key == varied {
                true => format!("{key} = [{value:?}, {:?}]", value * 1.1 + 1e-4),
                false if *key == "n_vertices" => format!("{key} = [64]"),
                false => format!("{key} = [{value:?}]"),
            };
            let grid = axes.iter().map(axis).collect::<Vec<_>>().join(", ");
            let dir = scratch();
            planned(dir.path(), &format!("{head}scene = \"{scene}\"\ngrid = {{ {grid} }}\n"));
            let value = axes.iter().find(|(key, _)| key == varied).unwrap().1;
            let mut values = [value, value * 1.1 + 1e-4].map(|value| format!("{value:?},1"));
            values.sort();
            let mut found = csv(dir.path(), &format!("SELECT {varied}, count(*) FROM runs GROUP BY 1"));
            found.sort();
            assert_eq!(found, values, "{varied} in {scene}");
        }
    }
}

#[test]
fn words_of_a_block_and_its_name_are_columns_and_a_shared_job_keeps_the_block_that_brought_it() {
    let dir = scratch();
    let text = "name = \"words\"\nmodel = \"DP\"\ndynamics = \"vertex\"\nscene = \"plate\"\ngamma = 1.0\nruns_per_point = 2\n\
                [[block]]\nname = \"usual\"\n\
                [[block]]\nname = \"literal\"\ncontact = \"vertex\"\ngravity = \"centroid\"\nself_contact = \"off\"\n\
                engulfed = \"record\"\n\
                [[block]]\nname = \"more\"\nruns_per_point = 3\n";
    planned(dir.path(), text);
    let sql = "SELECT block, count(*), contact, gravity, self_contact, engulfed, wall FROM runs GROUP BY block";
    let expected = [
        "literal,2,vertex,centroid,off,record,total",
        "more,1,edge,vertex,auto,fail,total",
        "usual,2,edge,vertex,auto,fail,total",
    ];
    assert_eq!(csv(dir.path(), sql), expected);
    planned(dir.path(), &text.replace("words", "again").replace("usual", "other"));
    assert_eq!(csv(dir.path(), sql), expected, "jobs stay with the campaign and the block that brought them");
}

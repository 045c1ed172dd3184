//! What each column means: its type, its unit, a line about it. The files of samples, exported tables and their
//! manifest say it to those who read them with other programs.
//!
//! Parameters are columns too; what they mean stands in the list of parameters.

use crate::parameters::{Applies, Domain, PARAMETERS, Parameter};
use parquet::file::metadata::KeyValue;
use std::collections::BTreeSet;

/// The type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Text,
    Whole,
    Number,
    Bytes,
}

/// A column and what it means.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::store) struct Column {
    pub kind: Kind,
    /// Empty for words, counts and pure numbers.
    pub unit: String,
    pub meaning: String,
}

use Kind::{Bytes, Number, Text, Whole};

/// A table, a column of it, its type, its unit, its meaning. Where the table is `""`, the column means the same in all
/// tables that have it.
type Row = (&'static str, &'static str, Kind, &'static str, &'static str);

/// The columns that are no parameters.
#[rustfmt::skip]
const COLUMNS: &[Row] = &[
    ("", "job_id", Text, "", "identity of the job: the hash of its point, its seed and the version of the physics"),
    ("", "point_id", Text, "", "identity of the grid point: the hash of its parameters"),
    ("", "campaign", Text, "", "name of the campaign that brought the job"),
    ("", "block", Text, "", "name of the block of the campaign that brought the job"),
    ("", "saturated", Whole, "", "1 where no more obstacles fit (then density is NULL), 0 elsewhere"),
    ("", "seed", Whole, "", "number of the run at its point; it determines the obstacles and the start"),
    ("", "physics_version", Whole, "", "version of the physics that the job belongs to"),

    ("", "state", Text, "", "pending, running, done or failed"),
    ("", "outcome", Text, "", "how the run ended: clogged, time_limit, distance, exited or settled"),
    ("", "r_end", Number, "sigma", "displacement of the centroid along x at the end"),
    ("", "t_end", Number, "t0", "time at the end"),
    ("", "v_g_mean", Number, "V_t", "mean speed along x after the start-up"),
    ("", "ek_ratio_end", Number, "", "E_k/E_t at the end"),
    ("", "shape_max", Number, "", "largest recorded shape parameter perimeter^2/(4 pi area); NULL for SP"),
    ("", "area_error_max", Number, "", "largest recorded |a/a0 - 1|; NULL for SP"),
    ("", "overlap_max", Number, "sigma", "largest recorded overlap with an obstacle"),
    ("", "delta_s", Number, "sigma", "depth that the droplet sank on the plate; NULL elsewhere"),
    ("", "steps", Whole, "", "time steps taken"),
    ("", "wall_s", Number, "s", "time that the run took on one thread"),
    ("", "attempts", Whole, "", "how often the job was begun"),
    ("", "error_class", Text, "", "class of the failure: unstable, engulfed, crossed, panicked, io or bad_input"),
    ("", "error", Text, "", "reason of the failure"),

    ("", "energy_rise_max", Number, "", "largest rise of the total energy above its lowest earlier value"),
    ("", "ek_ratio_min", Number, "", "lowest E_k/E_t at a check after the start"),
    ("", "engulfed_t", Number, "t0", "when an obstacle was first seen inside the ring"),
    ("", "refused", Whole, "", "steps that were refused and taken again in smaller ones"),
    ("failures", "step", Whole, "", "time step at which the failure was noticed"),
    ("failures", "dump", Text, "", "file within the store from which the job can be run again"),

    ("clog_events", "t", Number, "t0", "time of the clog"),
    ("clog_events", "r", Number, "sigma", "displacement of the centroid along x"),
    ("clog_events", "x", Number, "sigma", "x of the centroid, unwrapped"),
    ("clog_events", "y", Number, "sigma", "y of the centroid, unwrapped"),
    ("clog_events", "contacts", Whole, "", "obstacles that carry load"),
    ("clog_events", "mechanism", Text, "", "how the clog holds: wrap, squeeze or hybrid"),

    ("arrest_events", "r", Number, "sigma", "displacement along x of the equilibrium ahead"),
    ("arrest_events", "x", Number, "sigma", "x of its centroid, unwrapped"),
    ("arrest_events", "y", Number, "sigma", "y of its centroid, unwrapped"),
    ("arrest_events", "way_left", Number, "sigma", "way of the centroid to it when the time ran out"),
    ("arrest_events", "energy_left", Number, "M g sigma", "energy that was left to lose then"),

    ("pinch_events", "t", Number, "t0", "when the film closed, to the grid of times at which the droplet is looked at"),
    ("pinch_events", "r", Number, "sigma", "displacement of the centroid along x"),
    ("pinch_events", "x", Number, "sigma", "x of the film, unwrapped"),
    ("pinch_events", "y", Number, "sigma", "y of the film, unwrapped"),

    ("samples", "t", Number, "t0", "time"),
    ("samples", "r", Number, "sigma", "displacement of the centroid along x since gravity came on"),
    ("samples", "h", Number, "sigma", "x of the centroid, unwrapped"),
    ("samples", "y", Number, "sigma", "y of the centroid, unwrapped"),
    ("samples", "v_g", Number, "V_t", "velocity of the centroid along x"),
    ("samples", "area_error", Number, "", "a/a0 - 1; NULL for SP"),
    ("", "ek_ratio", Number, "", "kinetic energy over that of free fall, E_k/E_t"),
    ("", "shape", Number, "", "shape parameter perimeter^2/(4 pi area); NULL for SP"),

    ("shapes", "t", Number, "t0", "time"),
    ("shapes", "vertices", Bytes, "sigma", "f64, little-endian: x of all vertices, then y of all; unwrapped"),
    ("shapes", "loads", Text, "", "JSON: the loads of obstacles, where they act, how far the surface turns"),
    ("outline", "t", Number, "t0", "time"),
    ("outline", "vertex", Whole, "", "number of the vertex, counter-clockwise from 0; SP has one"),
    ("outline", "x", Number, "sigma", "x of the vertex, unwrapped"),
    ("outline", "y", Number, "sigma", "y of the vertex, unwrapped"),
    ("obstacles", "obstacle", Whole, "", "number of the obstacle"),
    ("obstacles", "x", Number, "sigma", "x of its centre, in the coordinates of the droplet"),
    ("obstacles", "y", Number, "sigma", "y of its centre"),
    ("obstacles", "radius", Number, "sigma", "its radius"),

    ("lambda_fits", "runs", Whole, "", "finished runs of the point that got beyond r_from"),
    ("speed_averages", "runs", Whole, "", "finished runs of the point"),
    ("lambda_fits", "clogs", Whole, "", "those of them that clogged, or were arrested at their time limit"),
    ("lambda_fits", "arrested", Whole, "", "those of the clogs that were arrested at their time limit, above the threshold"),
    ("speed_averages", "arrested", Whole, "", "runs that were arrested at their time limit, above the threshold of a clog"),
    ("", "by_distance", Whole, "", "runs that went the whole distance"),
    ("", "by_time", Whole, "", "runs on which time ran out while they were not at rest"),
    ("", "beyond_box", Whole, "", "runs that went beyond one side of the periodic box, where they count as cut off"),
    ("", "r_from", Number, "sigma", "displacement from which on runs count"),
    ("", "lambda_if_stuck", Number, "sigma", "lambda if the runs of by_time had clogged; NULL where there are none"),
    ("", "weibull_shape", Number, "", "shape k of exp(-(r/b)^k), 1 where survival is exponential"),
    ("", "weibull_low", Number, "", "lower end of its 95% interval"),
    ("", "weibull_high", Number, "", "upper end of its 95% interval"),
    ("survival", "r", Number, "sigma", "displacement at which the curve falls"),
    ("survival", "at_risk", Whole, "", "droplets still moving just before"),
    ("survival", "clogs", Whole, "", "those that clog here"),
    ("survival", "survival", Number, "", "share that gets further (Kaplan-Meier), given that it gets to r_from"),
    ("survival", "survival_low", Number, "", "lower end of its 95% band (log-log)"),
    ("survival", "survival_high", Number, "", "upper end of its 95% band"),
    ("", "lambda", Number, "sigma", "decay length of the survival probability exp(-r/lambda), maximum likelihood"),
    ("", "decay_length", Number, "sigma", "lambda under a name that is no keyword of Python or DuckDB"),
    ("", "lambda_low", Number, "sigma", "lower end of its 95% interval, or the lower bound where nothing clogged"),
    ("", "lambda_high", Number, "sigma", "upper end of its 95% interval"),
    ("", "lambda_least_squares", Number, "sigma", "decay length by least squares, as in the paper"),
    ("", "p_exponential", Number, "", "probability of clogs spread as unevenly as these if survival is exponential"),
    ("", "runs_for_ten_percent", Whole, "", "runs that would bring the interval to 10% on either side"),
    ("", "wrap_share", Number, "", "share of the clogs that hold by wrapping"),
    ("", "squeeze_share", Number, "", "share of the clogs that hold by squeezing"),
    ("", "hybrid_share", Number, "", "share of the clogs that hold by both"),
    ("", "flowing", Whole, "", "runs that ended without a clog or an arrest"),
    ("speed_averages", "v_g", Number, "V_t", "mean speed of the runs that neither clogged nor were arrested"),
    ("", "v_g_low", Number, "V_t", "lower end of its 95% interval"),
    ("", "v_g_high", Number, "V_t", "upper end of its 95% interval"),
    ("", "ca", Number, "", "capillary number (v_g/V_t) pi/(4 Gamma); NULL for SP"),
];

/// What the column `name` of `table` means; `None` if there is no such column.
pub(in crate::store) fn column(table: &str, name: &str) -> Option<Column> {
    let row = |wanted: &str| COLUMNS.iter().find(|row| row.0 == wanted && row.1 == name);
    if let Some((_, _, kind, unit, meaning)) = row(table).or_else(|| row("")) {
        return Some(Column { kind: *kind, unit: (*unit).to_owned(), meaning: (*meaning).to_owned() });
    }
    let rows: Vec<&Parameter> = PARAMETERS.iter().filter(|parameter| parameter.name == name).collect();
    let kind = match rows.first()?.domain {
        Domain::Text | Domain::Choice(_) => Text,
        Domain::Whole(_) | Domain::WholeOr(..) => Whole,
        Domain::Number(_) | Domain::NumberOr(..) => Number,
    };
    let (unit, meaning) = (joined(&rows, |row| row.unit), joined(&rows, |row| row.about));
    Some(Column { kind, unit, meaning })
}

/// What the rows of one parameter say, each with where it applies if they differ.
fn joined(rows: &[&Parameter], say: fn(&Parameter) -> &'static str) -> String {
    let first = say(rows[0]);
    if rows.iter().all(|row| say(row) == first) {
        return first.to_owned();
    }
    let with_place = |row: &&Parameter| match row.applies {
        Applies::Always => say(row).to_owned(),
        Applies::Model(place) | Applies::Scene(place) => format!("{} ({place})", say(row)),
    };
    // A set, because rows that say the same in the same place are one.
    let parts: BTreeSet<String> = rows.iter().map(with_place).collect();
    parts.into_iter().collect::<Vec<_>>().join("; ")
}

impl Kind {
    /// Its name in manifests.
    pub(in crate::store) fn name(self) -> &'static str {
        match self {
            Text => "text",
            Whole => "integer",
            Number => "real",
            Bytes => "bytes",
        }
    }

    /// The type that a declaration in SQL stands for, by the rules of SQLite.
    pub(in crate::store) fn declared(text: &str) -> Self {
        let text = text.to_ascii_uppercase();
        let has = |parts: &[&str]| parts.iter().any(|part| text.contains(part));
        match () {
            () if has(&["INT"]) => Whole,
            () if has(&["CHAR", "CLOB", "TEXT"]) => Text,
            () if has(&["BLOB"]) => Bytes,
            () => Number,
        }
    }
}

/// Columns of a table and what they mean, as JSON.
pub(in crate::store) fn described(table: &str, columns: &[(&str, Kind)]) -> serde_json::Value {
    let describe = |(name, kind): &(&str, Kind)| {
        let known = column(table, name);
        let (unit, meaning) = known.map_or_else(Default::default, |column| (column.unit, column.meaning));
        serde_json::json!({ "name": name, "type": kind.name(), "unit": unit, "meaning": meaning })
    };
    columns.iter().map(describe).collect()
}

/// The same for the metadata of a Parquet file, under the key `meniscus_columns`.
pub(in crate::store) fn in_metadata(table: &str, columns: &[(&str, Kind)]) -> KeyValue {
    KeyValue::new("meniscus_columns".to_owned(), described(table, columns).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::schema::MIGRATIONS;
    use rusqlite::Connection;

    /// The views and their columns, each with its declared type.
    fn view_columns() -> Vec<(String, String, Option<String>)> {
        let conn = Connection::open_in_memory().unwrap();
        MIGRATIONS.iter().for_each(|sql| conn.execute_batch(sql).unwrap());
        let mut names = conn.prepare("SELECT name FROM sqlite_master WHERE type = 'view'").unwrap();
        let views: Vec<String> = names.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect();
        let columns = |view: String| {
            let statement = conn.prepare(&format!("SELECT * FROM {view}")).unwrap();
            let columns =
                statement.columns().map(|column| (column.name().to_owned(), column.decl_type().map(str::to_owned)));
            columns.map(|(name, declared)| (view.clone(), name, declared)).collect::<Vec<_>>()
        };
        views.into_iter().flat_map(columns).collect()
    }

    #[test]
    fn every_column_of_every_view_has_a_meaning_and_the_type_that_it_is_declared_with() {
        let all = view_columns();
        assert!(all.len() > 100);
        for (view, name, declared) in all {
            let column = column(&view, &name).unwrap_or_else(|| panic!("{view}.{name} has no meaning"));
            assert!(!column.meaning.is_empty(), "{view}.{name}");
            if let Some(declared) = declared {
                assert_eq!(column.kind, Kind::declared(&declared), "{view}.{name}");
            }
        }
    }

    #[test]
    fn a_parameter_that_means_two_things_says_both() {
        let column = column("runs", "e_w").unwrap();
        assert_eq!(column.unit, "g rho sigma (DP); g rho sigma^3 (SP)");
        assert_eq!(column.meaning, "wall stiffness of the point (SP); wall stiffness of the whole ring (DP)");
    }
}

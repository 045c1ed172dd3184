//! A ladder as a table.

use crate::report::rounding::{significant, to_precision};
use crate::report::text_table::{NOTHING, TextTable};
use crate::study::accuracy::ladder::{Column, Knob, Ladder};
use crate::study::accuracy::order::Order;
use crate::study::accuracy::records::Difference;

/// What the columns of ladders mean.
pub(super) const LADDER_NOTE: &str = "\
error   distance of the value before it from the exact value, or from the value of the finest rung; relative, but in V_t
        for slowest and in sigma for h at rest; +- is its standard error over the arrays, which are the same on every
        rung. For lambda that is at least 1.5/n of n arrays: up to 3 in n droplets may do what none of n did
left    what the finest rung itself is still off by: from the order, or the last difference where the order is not
        clear; for lambda two standard errors are added
order   p of error ~ h^p, from the differences of neighbouring rungs (h = dt, 1/n_vertices, 1/e_w, ...); in brackets the
        range from pair to pair
stat.   standard error of one value over its arrays: the error of having few runs, beside that of coarse rungs
";

/// The ladder as a table.
pub(super) fn ladder(ladder: &Ladder) -> TextTable {
    let mut headers = vec![knob_header(ladder.knob).to_owned(), "ms/t0".to_owned()];
    headers.extend(ladder.columns.iter().flat_map(|column| [column.observable.name.to_owned(), "error".to_owned()]));
    let mut rows: Vec<Vec<String>> = (0..ladder.rungs.len())
        .map(|k| {
            let rung = &ladder.rungs[k];
            let time = rung.ms_per_t0().map_or_else(|| NOTHING.to_owned(), |ms| significant(ms, 3));
            let mut row = vec![significant(ladder.knob.value(&rung.point), 4), time];
            row.extend(ladder.columns.iter().flat_map(|column| cells(ladder, column, k)));
            row
        })
        .collect();
    // A line of the table below the rungs, where any column has something to say there.
    let mut line = |name: &str, text: &dyn Fn(&Column) -> Option<String>| {
        let texts: Vec<_> = ladder.columns.iter().map(text).collect();
        if texts.iter().any(Option::is_some) {
            let pairs = texts.into_iter().flat_map(|text| [String::new(), text.unwrap_or_else(|| NOTHING.to_owned())]);
            rows.push([name.to_owned(), String::new()].into_iter().chain(pairs).collect());
        }
    };
    line("left", &|column| column.left_over.filter(|left| *left > 0.0).map(|left| significant(left, 2)));
    if ladder.knob != Knob::EkThreshold {
        line("order", &|column| column.order.map(order));
    }
    let statistical = |column: &Column| ladder.reference()?.statistical(column.observable);
    line("stat.", &|column| statistical(column).map(|error| significant(error, 2)));
    TextTable { title: format!("{}, {}", ladder.scene.name(), varied(ladder)), headers, rows, names: 0, keys: 1 }
}

fn knob_header(knob: Knob) -> &'static str {
    if knob == Knob::Implicit { "dt" } else { knob.name() }
}

/// What a ladder varies, in words.
fn varied(ladder: &Ladder) -> String {
    let words = match ladder.knob {
        Knob::NVertices => {
            let integrator = ladder.reference().map_or("no run", |finest| finest.point.stepping.integrator.name());
            return format!("n_vertices alone ({integrator}, its automatic step)");
        }
        Knob::Dt => "dt of verlet alone",
        Knob::Implicit => "dt of the implicit integrator",
        Knob::Kappa => "kappa alone",
        Knob::Eps => "eps alone (in l0)",
        Knob::EW => "e_w alone",
        Knob::EkThreshold => "ek_threshold alone",
        Knob::StepError => "step_error alone (in sigma)",
    };
    words.to_owned()
}

/// Value and error of a column at rung `k`.
fn cells(ladder: &Ladder, column: &Column, k: usize) -> [String; 2] {
    let value = column.values[k].map_or_else(|| ladder.rungs[k].excuse(), |value| significant(value, 6));
    [value, column.errors[k].map_or_else(|| NOTHING.to_owned(), difference)]
}

fn difference(error: Difference) -> String {
    if error.spread > 0.0 && error.size < 1e-3 {
        format!("{} ± {}", significant(error.size, 2), significant(error.spread, 2))
    } else if error.spread > 0.0 {
        format!("{} ± {}", to_precision(error.size, error.spread), to_precision(error.spread, error.spread))
    } else {
        significant(error.size, 2)
    }
}

/// An order and its range from pair to pair.
pub(super) fn order(order: Order) -> String {
    let digits = |p: f64| format!("{p:.1}");
    let (p, low, high) = (digits(order.p), digits(order.low), digits(order.high));
    if !order.is_clear() {
        format!("none ({low} .. {high})")
    } else if low == high {
        p
    } else {
        format!("{p} ({low} .. {high})")
    }
}

//! The columns of the tables of decay lengths, each with its cells and with what it means.

use crate::report::rounding::{lower_bound, significant, to_precision, with_interval};
use crate::report::text_table::NOTHING;
use crate::results::fits::LambdaFit;
use crate::results::trajectory::Mechanism;
use crate::study::fits::FittedPoint;

/// Below this probability a row is marked.
pub(super) const DOUBTFUL: f64 = 0.05;

/// A column of the tables of decay lengths.
#[derive(Clone, Copy)]
pub(super) struct Column {
    pub(super) header: &'static str,
    pub(super) cell: fn(&FittedPoint<'_>) -> String,
    /// What it means, in whole lines.
    pub(super) note: &'static str,
}

const USUAL: [Column; 8] = [
    Column { header: "runs", cell: |row| row.lambda.runs.to_string(), note: "" },
    Column { header: "clogs", cell: |row| row.lambda.clogs.to_string(), note: "" },
    Column {
        header: "lambda [95%]",
        cell: |row| lambda_cell(&row.lambda),
        note: "\
lambda     decay length of the survival probability P(r) = exp(-r/lambda), in sigma, by maximum
           likelihood; a run that did not clog counts as cut off at its r
[a, b]     95% profile-likelihood interval: of many such intervals 95% hold the true lambda
> a        nothing clogged; were lambda smaller, the chance of that would be below 5%
",
    },
    Column {
        header: "least sq.",
        cell: |row| least_squares_cell(&row.lambda),
        note: "least sq.  the paper's estimate, exp(-r/lambda) fitted to P(r)\n",
    },
    Column {
        header: "p_exp",
        cell: |row| or_nothing(row.lambda.p_exponential.map(p_text)),
        note: "p_exp      chance of clogs as unevenly spread as these, were P(r) exponential; from 5 clogs on\n",
    },
    Column {
        header: "k [95%]",
        cell: |row| or_nothing(shape_text(&row.lambda)),
        note: "\
k          95% interval of the shape of P(r) = exp(-(r/b)^k). Where it leaves out 1, survival is not
           exponential; above 1 droplets clog the more easily the farther they have come
",
    },
    Column {
        header: "w/s/h [%]",
        cell: |row| or_nothing(shares(row)),
        note: "w/s/h      how the clogs hold: wrap, squeeze, hybrid, in percent\n",
    },
    Column {
        header: "for ±10%",
        cell: |row| or_nothing(row.lambda.runs_for_ten_percent.map(|runs| runs.to_string())),
        note: "for ±10%   runs in total that would narrow the interval to ±10%, at the present share of clogs\n",
    },
];

/// Where the column of arrests stands, if there are any: behind that of the clogs.
const ARRESTED_PLACE: usize = 2;

const ARRESTED: Column = Column {
    header: "arrested",
    cell: |row| row.lambda.arrested.to_string(),
    note: "\
arrested   those of the clogs that t_max cut off at rest, above ek_threshold: each counts as a clog at the
           stable equilibrium ahead of it
",
};

/// The share of runs cut off by time from which on lambda is told for both cases.
const MANY_CUT: f64 = 0.05;

/// The columns where time cut many runs off.
const CUT: [Column; 2] = [
    Column { header: "cut", cell: |row| row.lambda.by_time.to_string(), note: "" },
    Column {
        header: "if stuck",
        cell: |row| or_nothing(row.lambda.lambda_if_stuck.map(|lambda| significant(lambda, 2))),
        note: "\
cut        runs that t_max cut off while they moved. Slow droplets are the ones about to clog, so lambda
           may be too large: `if stuck` is lambda had all of these clogged there. The truth lies between
           both, but for chance, if such runs clog at least as easily as the others. A larger t_max
           narrows it; runs go on from where they ended
",
    },
];

/// The columns that these rows call for: the usual ones, the arrests where there are any, and what t_max does to lambda where
/// it cut many runs off.
pub(super) fn columns(rows: &[&FittedPoint<'_>]) -> Vec<Column> {
    let mut columns = USUAL.to_vec();
    if rows.iter().any(|row| row.lambda.arrested > 0) {
        columns.insert(ARRESTED_PLACE, ARRESTED);
    }
    if rows.iter().any(|row| is_cut_by_time(&row.lambda)) {
        let place = columns.iter().position(|column| column.header == "least sq.").unwrap_or_default();
        columns.splice(place..place, CUT);
    }
    columns
}

/// Whether the data leave lambda nearly open: one or two clogs, or estimates ten times apart.
pub(super) fn is_hardly_known(fit: &LambdaFit) -> bool {
    let apart = fit.lambda.zip(fit.lambda_least_squares).map(|(a, b)| (a / b).max(b / a));
    matches!(fit.clogs, 1 | 2) || apart.is_some_and(|ratio| ratio >= 10.0)
}

fn or_nothing(text: Option<String>) -> String {
    text.unwrap_or_else(|| NOTHING.to_owned())
}

fn lambda_cell(fit: &LambdaFit) -> String {
    match (fit.lambda, fit.lambda_low, fit.lambda_high) {
        (Some(lambda), Some(low), Some(high)) => {
            let mark = if is_hardly_known(fit) { "† " } else { "" };
            format!("{mark}{}", with_interval(lambda, low, high))
        }
        (None, Some(low), _) => lower_bound(low),
        _ => NOTHING.to_owned(),
    }
}

fn least_squares_cell(fit: &LambdaFit) -> String {
    let (Some(lambda), Some(low), Some(high)) = (fit.lambda, fit.lambda_low, fit.lambda_high) else {
        return NOTHING.to_owned();
    };
    let narrower = (lambda - low).min(high - lambda);
    // A value far below the interval still shows digits of its own.
    or_nothing(fit.lambda_least_squares.map(|x| to_precision(x, narrower.min(x))))
}

/// Both endings have the same width, so that the digits stay aligned.
fn p_text(p: f64) -> String {
    let number = if p < 0.001 { "< 0.001".to_owned() } else { format!("{p:.3}") };
    number + if p < DOUBTFUL { " *" } else { "  " }
}

/// `0.92–1.35`.
fn shape_text(fit: &LambdaFit) -> Option<String> {
    let [low, high] = [fit.weibull_low?, fit.weibull_high?].map(|end| significant(end, 2));
    Some(format!("{low}–{high}"))
}

/// Whether time cut off so many runs that lambda depends on what would have become of them.
fn is_cut_by_time(fit: &LambdaFit) -> bool {
    f64::from(fit.by_time) >= MANY_CUT * f64::from(fit.runs.max(1)) && fit.by_time > 0
}

/// `10/85/5`: percentages of the clogs that hold by wrap, squeeze and hybrid, among those whose mechanism is known.
fn shares(row: &FittedPoint) -> Option<String> {
    let known: Vec<Mechanism> = row.point.runs.iter().filter_map(|run| run.mechanism).collect();
    let percent = |wanted| {
        let clogs = known.iter().filter(|&&mechanism| mechanism == wanted).count();
        format!("{:.0}", 100.0 * clogs as f64 / known.len() as f64)
    };
    let all = [Mechanism::Wrap, Mechanism::Squeeze, Mechanism::Hybrid];
    (!known.is_empty()).then(|| all.map(percent).join("/"))
}

//! What accuracy costs, as tables: a ladder each, the settings of each scene, and sentences of what they show.

use crate::report::rounding::{significant, to_precision};
use crate::study::accuracy::front::{Front, Spot};
use crate::study::accuracy::ladder::{Column, Knob, Ladder};
use crate::study::accuracy::order::Order;
use crate::study::accuracy::{Accuracy, Deviation};
use comfy_table::CellAlignment;

/// Lines above and below the table and under its head, none between rows or columns.
const LINES: &str = "  ── ──      ──    ";

const NOTHING: &str = "-";

/// What the columns of ladders mean.
pub const LADDER_NOTE: &str = "\
error   of the value before it, against the exact value or against the finest rung; relative, but for slowest (in V_t) and h at
        rest (in sigma); +- its standard error over the arrays, which are the same on every rung; of lambda at least 1.5/n
        of n arrays, for what none of n droplets does up to 3 in n may do
left    what the finest rung itself is off by, from the order, or the last difference where the order is not clear (of lambda, with two standard errors)
order   p of error ~ h^p, from the differences of neighbouring rungs (h = dt, 1/n_vertices, 1/e_w, ...); in brackets from pair to pair
stat.   standard error of one value over its arrays: what few runs cost, beside what coarse ones do
";

/// What the columns of fronts mean.
pub const FRONT_NOTE: &str = "\
error   largest of the headline observables against the finest ring, with what that is off by and two standard errors added
*       on the front: nothing measured is faster and as accurate (within 2%)
";

/// A table that can be shown in a terminal or on a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sheet {
    /// What it is about.
    pub title: String,
    headers: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Sheet {
    /// For a terminal.
    pub fn text(&self) -> String {
        let mut table = comfy_table::Table::new();
        table.load_preset(LINES).set_header(&self.headers);
        self.rows.iter().for_each(|row| {
            table.add_row(row);
        });
        table.column_iter_mut().for_each(|column| column.set_cell_alignment(CellAlignment::Right));
        format!("{}\n{table}\n", self.title)
    }

    /// For a Markdown page.
    pub fn markdown(&self) -> String {
        let row = |cells: &[String]| format!("| {} |\n", cells.join(" | ").replace('*', "\\*").replace('<', "&lt;"));
        let rule = format!("|{}\n", "---:|".repeat(self.headers.len()));
        let rows: String = self.rows.iter().map(|cells| row(cells)).collect();
        format!("**{}**\n\n{}{rule}{rows}\n", self.title, row(&self.headers))
    }
}

/// The ladder as a table.
pub fn ladder(ladder: &Ladder) -> Sheet {
    let mut headers = vec![knob_header(ladder.knob).to_owned(), "ms/t0".to_owned()];
    headers.extend(ladder.columns.iter().flat_map(|column| [column.observable.name.to_owned(), "error".to_owned()]));
    let mut rows: Vec<Vec<String>> = (0..ladder.rungs.len())
        .map(|k| {
            let rung = &ladder.rungs[k];
            let mut row = vec![significant(ladder.knob.value(&rung.point), 4), time(rung.ms_per_t0())];
            row.extend(ladder.columns.iter().flat_map(|column| cells(ladder, column, k)));
            row
        })
        .collect();
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
    Sheet { title: format!("{}, {}", ladder.study.name(), varied(ladder)), headers, rows }
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
    };
    words.to_owned()
}

fn cells(ladder: &Ladder, column: &Column, k: usize) -> [String; 2] {
    let value = column.values[k].map_or_else(|| ladder.rungs[k].excuse(), |value| significant(value, 6));
    [value, column.errors[k].map_or_else(|| NOTHING.to_owned(), deviation)]
}

fn deviation(error: Deviation) -> String {
    if error.spread > 0.0 && error.size < 1e-3 {
        format!("{} ± {}", significant(error.size, 2), significant(error.spread, 2))
    } else if error.spread > 0.0 {
        format!("{} ± {}", to_precision(error.size, error.spread), to_precision(error.spread, error.spread))
    } else {
        significant(error.size, 2)
    }
}

fn order(order: Order) -> String {
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

fn time(ms: Option<f64>) -> String {
    ms.map_or_else(|| NOTHING.to_owned(), |ms| significant(ms, 3))
}

/// The settings of a scene as a table, the fastest first.
pub fn front(front: &Front) -> Sheet {
    let headers = ["", "n_vertices", "integrator", "dt", "ms/t0", "error", "of"].map(str::to_owned).to_vec();
    let row = |spot: &Spot| {
        let (n_vertices, integrator, dt) = spot.setting;
        let (error, of) = match spot.error {
            Some((error, of)) => (significant(error, 2), of.to_owned()),
            None => (spot.excuse.clone(), NOTHING.to_owned()),
        };
        let default = if Some(spot) == front.default() { "default " } else { "" };
        vec![
            format!("{default}{}", if spot.on_front { "*" } else { "" }),
            n_vertices.to_string(),
            integrator.name().to_owned(),
            dt.map_or_else(|| "auto".to_owned(), |dt| significant(dt, 3)),
            significant(spot.ms_per_t0, 3),
            error,
            of,
        ]
    };
    Sheet {
        title: format!("Error against time, {} ({})", front.study.name(), front.conditions),
        headers,
        rows: front.spots.iter().map(row).collect(),
    }
}

/// Sentences: orders of convergence, and where the default stands.
pub fn findings(accuracy: &Accuracy) -> Vec<String> {
    let orders = accuracy.ladders.iter().filter(|ladder| ladder.knob != Knob::EkThreshold).filter_map(orders_of);
    orders.chain(accuracy.fronts.iter().filter_map(default_of)).collect()
}

fn orders_of(ladder: &Ladder) -> Option<String> {
    let all: Vec<String> = ladder
        .columns
        .iter()
        .filter_map(|column| {
            Some(format!("{} of {}", order(column.order.filter(Order::is_clear)?), column.observable.name))
        })
        .collect();
    (!all.is_empty()).then(|| format!("Order in {}, {}: {}.", ladder.knob.name(), ladder.study.name(), all.join(", ")))
}

fn default_of(front: &Front) -> Option<String> {
    let default = front.default()?;
    let (error, of) = default.error?;
    let place = format!(
        "{}: the default is off by {} ({of}) at {} ms/t0",
        front.study.name(),
        significant(error, 2),
        time(Some(default.ms_per_t0))
    );
    Some(match front.instead_of_default() {
        Some(better) if !default.on_front && better != default => {
            let (n_vertices, integrator, dt) = better.setting;
            let dt = dt.map_or_else(String::new, |dt| format!(", dt = {}", significant(dt, 3)));
            format!(
                "{place}; n_vertices = {n_vertices}, {}{dt} is as accurate in {} of the time.",
                integrator.name(),
                significant(better.ms_per_t0 / default.ms_per_t0, 2)
            )
        }
        _ => format!("{place}, on the front."),
    })
}

/// Everything for a terminal.
pub fn text(accuracy: &Accuracy) -> String {
    let ladders: Vec<String> = accuracy.ladders.iter().map(|one| ladder(one).text()).collect();
    let fronts: Vec<String> = accuracy.fronts.iter().map(|one| front(one).text()).collect();
    let findings = findings(accuracy).join("\n");
    format!("{}{LADDER_NOTE}\n{}{FRONT_NOTE}\n{findings}\n", ladders.join("\n"), fronts.join("\n"))
}

/// What a page says of where it comes from.
#[derive(Clone, Debug)]
pub struct Origin {
    /// Name of the campaign.
    pub campaign: String,
    /// The machine, the day and the commit.
    pub measured: String,
    /// The command that makes the page again.
    pub command: String,
    /// File name of the picture beside the page.
    pub picture: String,
}

/// Everything as a Markdown page.
pub fn page(accuracy: &Accuracy, origin: &Origin) -> String {
    let Origin { campaign, measured, command, picture } = origin;
    let mut out = format!(
        "# What accuracy costs\n\nGenerated by `{command}` from `campaigns/{campaign}.toml`; every number is of a run in its store. \
         Errors do not depend on the machine, times do: {measured}, one thread a run.\n\n\
         <img src=\"{picture}\" alt=\"Error against time for every setting of N_v, dt and integrator\" width=\"720\">\n\n## Findings\n\n"
    );
    out.extend(findings(accuracy).iter().map(|finding| format!("- {}\n", finding.replace('<', "&lt;"))));
    out += THEORY;
    out += "\n## Settings, and the front\n\n";
    out.extend(accuracy.fronts.iter().map(|one| front(one).markdown()));
    out += &format!("```text\n{FRONT_NOTE}```\n\n## One knob at a time\n\n");
    for study in crate::study::accuracy::study::Study::ALL {
        let ladders: Vec<_> = accuracy.ladders.iter().filter(|ladder| ladder.study == study).collect();
        if ladders.is_empty() {
            continue;
        }
        let about = study.observables().iter().map(|o| format!("*{}* is the {}", o.name.replace('<', "&lt;"), o.about));
        out += &format!("### {}\n\n{}. {}.\n\n", study.name(), study.about(), about.collect::<Vec<_>>().join("; "));
        out.extend(ladders.into_iter().map(|one| ladder(one).markdown()));
    }
    out + &format!("```text\n{LADDER_NOTE}```\n\n{TOLERANCE}")
}

const THEORY: &str = "
What theory expects: 2 in dt, of Verlet and of the implicit integrator (BDF2) alike, while forces are smooth; vertices that come to touch a tip between two
steps, and numbers read off at samples, can hide it where errors are below 1e-6. A ring of N_v edges has the area and perimeter of its circle to
order 2, but tips touch it vertex by vertex and eps is a tenth of an edge, so nothing promises more than 1. The time of a passage close to the threshold
magnifies whatever makes the orifice seem narrower: coarse rings, smoothing, and the wall stiffness, on which it depends without a limit in sight.
";

const TOLERANCE: &str = "\
## `tolerance`

`tolerance = 0.01` in a campaign file takes, instead of `n_vertices`, `dt` and `integrator`, the cheapest setting of the table
`src/tolerance/measured.toml` whose error is at most 0.01. That table is written by `meniscus accuracy --record`. The error is the largest relative
error of the headline observables: in channels `A_max - 1` and the transit time (the worse of channel and passage), in arrays whose gaps are as
wide as a droplet `<v_g>`, in narrower ones lambda, of a free droplet its speed, its energy and its fall. A droplet that gets stuck in another place changes lambda by a lot, and a
setting may do that to few of many: so of n arrays 3/n is the least that is granted, and a finer answer takes more arrays. It is that of the
scenes above, and of no other: near a threshold of passing every error grows. `meniscus plan` shows the setting, its error, and its time against that
of the default.
";

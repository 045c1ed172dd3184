//! The plot of error against time: a panel for each scene, both axes logarithmic, the front as a line.

use crate::parameters::Integrator;
use crate::report::svg::{circle, line, points, px, text};
use crate::study::accuracy::front::{Front, Spot};
use std::fmt::Write;

/// Width and height of a panel, in pixels; two stand side by side.
const PANEL: [f64; 2] = [380.0, 270.0];

/// Left, right, above and below the frame of a panel.
const MARGINS: [f64; 4] = [64.0, 14.0, 34.0, 46.0];

/// Height of the legend.
const LEGEND: f64 = 34.0;

/// Verlet, implicit.
const COLOURS: [&str; 2] = ["#0072b2", "#d55e00"];

/// The plot as SVG.
pub fn svg(fronts: &[Front]) -> String {
    let rows = fronts.len().div_ceil(2).max(1);
    let (width, height) = (2.0 * PANEL[0], rows as f64 * PANEL[1] + LEGEND);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
         font-family=\"DejaVu Sans, sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        px(width),
        px(height)
    );
    for (k, front) in fronts.iter().enumerate() {
        out += &panel(front, [(k % 2) as f64 * PANEL[0], (k / 2) as f64 * PANEL[1]]);
    }
    let y = height - LEGEND + 14.0;
    for (k, name) in ["verlet", "implicit"].iter().enumerate() {
        let x = MARGINS[0] + 110.0 * k as f64;
        out += &circle([x, y - 4.0], 3.5, &format!("fill=\"{}\"", COLOURS[k]));
        out += &text([x + 9.0, y], 11.0, "start", "", name);
    }
    out += &circle([MARGINS[0] + 220.0, y - 4.0], 6.5, "fill=\"none\" stroke=\"black\"");
    out += &text([MARGINS[0] + 232.0, y], 11.0, "start", "", "default; numbers are n_vertices, the line is the front");
    out + "</svg>\n"
}

/// A logarithmic axis of whole decades, or of halves where one would be all.
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>) -> Self {
        let ends = values.map(libm::log10).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        let [low, high] = if ends[0] <= ends[1] { ends } else { [0.0, 1.0] };
        let free = 0.08 * (high - low).max(0.5);
        Self { low: low - free, high: high + free }
    }

    /// Where a value lies, from 0 to 1.
    fn share(&self, value: f64) -> f64 {
        (libm::log10(value) - self.low) / (self.high - self.low)
    }

    /// 1, 2, 5 times powers of ten; powers alone over many decades.
    fn ticks(&self) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let wide = self.high - self.low > 3.0;
        // Over tens of decades not every one.
        let every = ((self.high - self.low) / 8.0).ceil().max(1.0) as i32;
        let factors: &[f64] = if wide { &[1.0] } else { &[1.0, 2.0, 5.0] };
        decades
            .filter(|decade| decade.rem_euclid(every) == 0)
            .flat_map(|decade| factors.iter().map(move |factor| factor * libm::exp10(f64::from(decade))))
            .filter(|tick| (0.0..=1.0).contains(&self.share(*tick)))
            .collect()
    }
}

fn panel(front: &Front, [left, top]: [f64; 2]) -> String {
    let seen: Vec<(&Spot, f64)> =
        front.spots.iter().filter_map(|spot| Some((spot, spot.error?.0)).filter(|(_, error)| *error > 0.0)).collect();
    let (x, y) = (Axis::over(seen.iter().map(|seen| seen.0.ms_per_t0)), Axis::over(seen.iter().map(|seen| seen.1)));
    let [x0, y0] = [left + MARGINS[0], top + MARGINS[2]];
    let [wide, high] = [PANEL[0] - MARGINS[0] - MARGINS[1], PANEL[1] - MARGINS[2] - MARGINS[3]];
    let place = |ms: f64, error: f64| [x0 + wide * x.share(ms), y0 + high * (1.0 - y.share(error))];
    let title = format!("{} ({})", front.study.name(), front.conditions);
    let mut out = text([x0, top + 22.0], 11.0, "start", "font-weight=\"bold\"", &title);
    for tick in x.ticks() {
        let [at, _] = place(tick, 1.0);
        out += &line([at, y0], [at, y0 + high], "#e4e4e4", 1.0);
        out += &text([at, y0 + high + 15.0], 10.0, "middle", "", &format!("{tick}"));
    }
    for tick in y.ticks() {
        let [_, at] = place(1.0, tick);
        out += &line([x0, at], [x0 + wide, at], "#e4e4e4", 1.0);
        let short = if tick < 1e-3 { format!("{tick:e}") } else { format!("{tick}") };
        out += &text([x0 - 5.0, at + 3.5], 10.0, "end", "", &short);
    }
    let [fx, fy, fw, fh] = [x0, y0, wide, high].map(px);
    let _ = writeln!(out, "<rect x=\"{fx}\" y=\"{fy}\" width=\"{fw}\" height=\"{fh}\" fill=\"none\" stroke=\"#555\"/>");
    let best = seen.iter().filter(|seen| seen.0.on_front).map(|(spot, error)| place(spot.ms_per_t0, *error));
    let best = points(best);
    let _ = writeln!(
        out,
        "<polyline class=\"front\" points=\"{best}\" fill=\"none\" stroke=\"#888\" stroke-width=\"1.4\"/>"
    );
    for (spot, error) in &seen {
        let at = place(spot.ms_per_t0, *error);
        let colour = COLOURS[usize::from(spot.setting.1 == Integrator::Implicit)];
        out += &circle(at, 3.5, &format!("class=\"setting\" fill=\"{colour}\""));
        if Some(*spot) == front.default() {
            out += &circle(at, 6.5, "fill=\"none\" stroke=\"black\"");
        }
        if spot.on_front {
            out += &text([at[0] + 6.0, at[1] - 5.0], 9.0, "start", "", &spot.setting.0.to_string());
        }
    }
    out += &text([x0 + 0.5 * wide, y0 + high + 32.0], 10.5, "middle", "", "ms of CPU per t0");
    let middle = y0 + 0.5 * high;
    let turned = format!("transform=\"rotate(-90 {} {})\"", px(left + 14.0), px(middle));
    out + &text([left + 14.0, middle], 10.5, "middle", &turned, "error")
}

//! The plot of a fit: speed and shape against the position of the droplet, frames as points, simulations as lines.

use crate::report::rounding::significant;
use crate::report::svg::{circle, line, points, px, text};
use std::fmt::Write;

/// Width of the picture, height of a panel, in pixels.
const SIZE: [f64; 2] = [720.0, 270.0];

/// Left, right, above each panel, and below it, in pixels.
const MARGINS: [f64; 4] = [76.0, 20.0, 34.0, 52.0];

/// Colours that most eyes tell apart; trials take them in turn.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];

/// Share of an axis left free beyond its data on either side.
const FREE: f64 = 0.05;

/// About so many numbers stand along an axis.
const TICKS: f64 = 8.0;

/// One trial of a plot.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// What the legend calls it.
    pub name: String,
    /// Frames: h, v_g, shape.
    pub frames: Vec<[f64; 3]>,
    /// The simulated passage: h, v_g, shape.
    pub curve: Vec<[f64; 3]>,
}

/// The plot as SVG: v_g(h) above, shape(h) below, on the range of h that the frames cover.
pub fn svg(title: &str, series: &[Series]) -> String {
    let [width, height] = SIZE;
    let whole = 2.0 * height + 20.0 * (series.len() + 1) as f64;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
         font-family=\"DejaVu Sans, sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        px(width),
        px(whole)
    );
    out += &text([MARGINS[0], 20.0], 13.0, "start", "font-weight=\"bold\"", title);
    let within = Axis::over(series.iter().flat_map(|one| one.frames.iter().map(|frame| frame[0])));
    for (k, label) in [(1, "speed v_g / V_t"), (2, "shape parameter A")] {
        out += &panel(series, within, k, label, (k - 1) as f64 * height);
    }
    for (k, one) in series.iter().enumerate() {
        let (y, colour) = (2.0 * height + 20.0 * k as f64 + 8.0, COLOURS[k % COLOURS.len()]);
        out += &circle([MARGINS[0] + 4.0, y - 4.0], 3.0, &format!("fill=\"{colour}\""));
        out += &line([MARGINS[0] + 12.0, y - 4.0], [MARGINS[0] + 36.0, y - 4.0], colour, 1.6);
        out += &text([MARGINS[0] + 44.0, y], 12.0, "start", "", &one.name);
    }
    out + "</svg>\n"
}

/// A range of values and where its numbers stand.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    low: f64,
    high: f64,
    step: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>) -> Self {
        let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let [low, high] = if ends[0] <= ends[1] { ends } else { [0.0, 1.0] };
        // A single value has a range of its own size.
        let span = if high > low { high - low } else { low.abs().max(1.0) * 0.1 };
        let (low, high) = (low - FREE * span, high + FREE * span);
        Self { low, high, step: round_step((high - low) / TICKS) }
    }

    /// Where a value lies, from 0 to 1.
    fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        let (first, last) = ((self.low / self.step).ceil() as i64, (self.high / self.step).floor() as i64);
        let step = self.step;
        (first..=last).map(move |k| k as f64 * step)
    }
}

/// The smallest of 1, 2, 5, 10 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    let unit = libm::exp10(libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * unit)
        .into_iter()
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * unit)
}

/// One panel, `top` pixels down: column `k` of all series against their h.
fn panel(series: &[Series], x: Axis, k: usize, label: &str, top: f64) -> String {
    let [left, right, above, below] = MARGINS;
    let [wide, high] = [SIZE[0] - left - right, SIZE[1] - above - below];
    let (x0, y0) = (left, top + above);
    let seen = |row: &&[f64; 3]| (x.low..=x.high).contains(&row[0]);
    let all = series.iter().flat_map(|one| one.frames.iter().chain(one.curve.iter().filter(seen)));
    let y = Axis::over(all.map(|row| row[k]));
    let place = |row: &[f64; 3]| [x0 + wide * x.share(row[0]), y0 + high * (1.0 - y.share(row[k]))];
    let mut out = String::new();
    for tick in x.ticks() {
        let at = x0 + wide * x.share(tick);
        out += &line([at, y0], [at, y0 + high], "#e4e4e4", 1.0);
        out += &text([at, y0 + high + 17.0], 11.0, "middle", "", &significant(tick, 6));
    }
    for tick in y.ticks() {
        let at = y0 + high * (1.0 - y.share(tick));
        out += &line([x0, at], [x0 + wide, at], "#e4e4e4", 1.0);
        out += &text([x0 - 6.0, at + 4.0], 11.0, "end", "", &significant(tick, 6));
    }
    let frame = [x0, y0, wide, high].map(px);
    let [fx, fy, fw, fh] = &frame;
    let _ = writeln!(out, "<rect x=\"{fx}\" y=\"{fy}\" width=\"{fw}\" height=\"{fh}\" fill=\"none\" stroke=\"#555\"/>");
    for (one, colour) in series.iter().zip(COLOURS.iter().cycle()) {
        let curve = points(one.curve.iter().filter(seen).map(place));
        let _ = writeln!(
            out,
            "<polyline class=\"curve\" points=\"{curve}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.6\"/>"
        );
        let style = format!("class=\"frame\" fill=\"{colour}\" fill-opacity=\"0.55\"");
        out.extend(one.frames.iter().map(|row| circle(place(row), 2.8, &style)));
    }
    out += &text([x0 + 0.5 * wide, y0 + high + 36.0], 12.0, "middle", "", "centroid position h / σ");
    let middle = y0 + 0.5 * high;
    let turned = format!("transform=\"rotate(-90 18 {})\"", px(middle));
    out + &text([18.0, middle], 12.0, "middle", &turned, label)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_an_axis_are_round_and_within_it() {
        let axis = Axis::over([-1.5, 1.4].into_iter());
        let ticks: Vec<f64> = axis.ticks().collect();
        assert_eq!(ticks, [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5]);
        assert_eq!([0.013, 0.05, 2.1, 70.0].map(round_step), [0.02, 0.05, 5.0, 100.0]);
        let flat = Axis::over([1.0].into_iter());
        assert!(flat.low < 1.0 && flat.high > 1.0 && flat.ticks().count() > 1);
    }
}

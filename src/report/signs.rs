//! Signs in the corners of a picture: gravity, the scale bar, and what the arrows mean.

use crate::report::colours::{FORCE, INK, WEIGHT};
use crate::report::svg::{arrow, px, text};
use crate::report::view::View;

/// All signs.
pub(super) fn signs(view: &View) -> String {
    let [width, height] = view.size();
    let dark = format!("fill=\"{INK}\"");
    let mut out = plate(width - 48.0, 8.0, 40.0, 62.0);
    out += &arrow([width - 36.0, 18.0], [width - 36.0, 60.0], 2.4, 13.0, INK);
    out += &text([width - 26.0, 43.0], 15.0, "start", &format!("{dark} font-style=\"italic\""), "g");
    out += &scale_bar(view.scale, height, &dark);
    out += &plate(width - 138.0, height - 50.0, 130.0, 42.0);
    for (row, (colour, label)) in [(FORCE, "contact force"), (WEIGHT, "weight")].into_iter().enumerate() {
        let y = height - 35.0 + 18.0 * row as f64;
        out += &arrow([width - 130.0, y], [width - 106.0, y], 2.4, 9.0, colour);
        out += &text([width - 100.0, y + 4.0], 12.0, "start", &dark, label);
    }
    out
}

/// A bar one sigma long, or ten where one is too small to see.
fn scale_bar(scale: f64, height: f64, style: &str) -> String {
    let (bar, label) = if scale >= 24.0 { (scale, "1 σ") } else { (10.0 * scale, "10 σ") };
    let (left, right, base) = (px(18.0), px(18.0 + bar), height - 18.0);
    let (low, high, middle) = (px(base - 4.0), px(base + 4.0), px(base));
    let bar_drawn = format!(
        "<path d=\"M{left},{low}V{high}M{left},{middle}H{right}M{right},{low}V{high}\" fill=\"none\" stroke=\"{INK}\" \
         stroke-width=\"2\"/>\n"
    );
    let name = text([18.0 + 0.5 * bar, height - 25.0], 13.0, "middle", style, label);
    plate(8.0, height - 42.0, bar + 20.0, 34.0) + &bar_drawn + &name
}

/// A pale background on which signs can be read.
fn plate(x: f64, y: f64, width: f64, height: f64) -> String {
    let [x, y, width, height] = [x, y, width, height].map(px);
    format!(
        "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"5\" fill=\"#ffffff\" \
         fill-opacity=\"0.86\"/>\n"
    )
}

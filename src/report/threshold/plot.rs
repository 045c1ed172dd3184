//! The plot of a droplet's way through throats: its least perimeter P(h) above, and dP/dh below with the pull of its
//! weight, M/gamma, for the tensions of the campaign. A droplet stops where its line meets the curve.

use crate::parameters::MASS;
use crate::report::axes::LinearAxis;
use crate::report::panel::Panel;
use crate::report::rounding::significant;
use crate::report::svg::{circle, curve, line, plot, text};
use crate::study::threshold::{Held, ThroatScene};
use std::f64::consts::PI;

/// Width of the picture, height of a panel, in pixels.
const SIZE: [f64; 2] = [720.0, 300.0];

/// Left, right, above each panel, and below it, in pixels.
const MARGINS: [f64; 4] = [76.0, 92.0, 34.0, 52.0];

/// Colours that most eyes tell apart; throats take them in turn.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];

/// The most lines for tensions; more would hide the curves.
const MOST_LINES: usize = 12;

/// The least distance of two numbers beside the frame, in pixels.
const NUMBERS_APART: f64 = 11.0;

/// Height of a line of the legend.
const LEGEND: f64 = 20.0;

/// The plot as SVG; throats that touch nothing, or let nothing pass, stand in the legend only.
pub(crate) fn svg(title: &str, scenes: &[ThroatScene]) -> String {
    let [width, height] = SIZE;
    let x = LinearAxis::over(paths(scenes).flatten().map(|held| held.h).chain([0.0]));
    let mut out = text([MARGINS[0], 20.0], 13.0, "start", "font-weight=\"bold\"", title);
    let perimeters = |held: &Held| held.perimeter / PI;
    let first = panel(0.0);
    let y = LinearAxis::over(paths(scenes).flatten().map(perimeters).chain([1.0]));
    out += &grid(&first, x, y, "perimeter P / π");
    out += &curves(&first, scenes, x, y, perimeters);
    let slopes = |held: &Held| held.slope;
    let second = panel(height);
    let y = LinearAxis::over(paths(scenes).flatten().map(slopes).chain([0.0]));
    out += &grid(&second, x, y, "slope dP/dh");
    out += &pulls(&second, scenes, y);
    out += &curves(&second, scenes, x, y, slopes);
    for (k, scene) in scenes.iter().enumerate() {
        let (y, colour) = (2.0 * height + LEGEND * k as f64 + 8.0, COLOURS[k % COLOURS.len()]);
        out += &line([MARGINS[0], y - 4.0], [MARGINS[0] + 28.0, y - 4.0], colour, 1.8);
        out += &text([MARGINS[0] + 36.0, y], 12.0, "start", "", &name(scene));
    }
    plot([width, 2.0 * height + LEGEND * (scenes.len() + 1) as f64], &out)
}

fn name(scene: &ThroatScene) -> String {
    let gamma_c = scene.passage.gamma_c();
    let threshold = if gamma_c.is_finite() { significant(gamma_c, 4) } else { "any".to_owned() };
    format!("{}: Γ_c = {threshold}", scene.label())
}

fn paths(scenes: &[ThroatScene]) -> impl Iterator<Item = &[Held]> {
    scenes.iter().map(|scene| scene.passage.path.as_slice())
}

/// A panel, `top` pixels down.
fn panel(top: f64) -> Panel {
    let [left, right, above, below] = MARGINS;
    Panel {
        corner: [left, top + above],
        size: [SIZE[0] - left - right, SIZE[1] - above - below],
        numbers: 11.0,
        numbers_off: [17.0, 6.0],
        drop: 4.0,
        names: 12.0,
        names_off: [36.0, 58.0],
    }
}

fn grid(panel: &Panel, x: LinearAxis, y: LinearAxis, label: &str) -> String {
    let mut out = String::new();
    out.extend(x.ticks().map(|tick| panel.grid_x(x.share(tick), &significant(tick, 6))));
    out.extend(y.ticks().map(|tick| panel.grid_y(y.share(tick), &significant(tick, 6))));
    out + &panel.frame() + &panel.axis_names("centroid position h / σ", label)
}

/// A curve for each throat, from the left end of the axis on, with a dot where the slope is largest.
fn curves(panel: &Panel, scenes: &[ThroatScene], x: LinearAxis, y: LinearAxis, value: fn(&Held) -> f64) -> String {
    let mut out = String::new();
    for (scene, colour) in scenes.iter().zip(COLOURS.iter().cycle()) {
        let passage = &scene.passage;
        let (Some(first), Some(steepest)) = (passage.path.first(), passage.steepest) else { continue };
        let place = |held: &Held| panel.place(x.share(held.h), y.share(value(held)));
        let before = Held { h: x.low, ..*first };
        let way = std::iter::once(&before).chain(&passage.path).map(place);
        out += &curve("curve", way, &format!("stroke=\"{colour}\" stroke-width=\"1.8\""));
        out += &circle(place(&steepest), 3.4, &format!("class=\"steepest\" fill=\"{colour}\""));
    }
    out
}

/// The lines of the pull M/gamma, with the tension beside the frame where there is room.
fn pulls(panel: &Panel, scenes: &[ThroatScene], y: LinearAxis) -> String {
    let mut gammas: Vec<f64> = scenes.iter().flat_map(|scene| scene.gammas.iter().copied()).collect();
    gammas.sort_by(f64::total_cmp);
    gammas.dedup();
    gammas.retain(|gamma| MASS / gamma < y.high);
    if gammas.len() > MOST_LINES {
        return String::new();
    }
    let (mut out, mut last) = (String::new(), f64::NEG_INFINITY);
    for gamma in gammas {
        let [from, to] = [0.0, 1.0].map(|share| panel.place(share, y.share(MASS / gamma)));
        out += &curve("pull", [from, to].into_iter(), "stroke=\"#555\" stroke-width=\"1\" stroke-dasharray=\"5 4\"");
        // Lines come from above, as the tension rises.
        if to[1] - last >= NUMBERS_APART {
            let label = format!("Γ = {}", significant(gamma, 4));
            out += &text([to[0] + 6.0, to[1] + 4.0], 10.5, "start", "", &label);
            last = to[1];
        }
    }
    out
}

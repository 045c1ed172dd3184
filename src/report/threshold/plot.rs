//! The plot of a droplet's way through throats: its least perimeter P(h) above, and dP/dh below with the pull of its
//! weight, M/gamma, for the tensions of the campaign. A droplet stops where its line meets the curve.

use crate::parameters::MASS;
use crate::report::axes::LinearAxis;
use crate::report::colours::CURVES;
use crate::report::panel::{Panel, Sheet};
use crate::report::rounding::significant;
use crate::report::svg::{circle, curve, line, plot, text};
use crate::study::threshold::{Held, ThroatScene};
use std::f64::consts::PI;

/// Two panels, with room on the right for the tensions.
const SHEET: Sheet = Sheet { width: 720.0, panel_height: 300.0, right: 92.0 };

/// The most lines for tensions; more would hide the curves.
const MOST_LINES: usize = 12;

/// The least distance of two numbers beside the frame, in pixels.
const NUMBERS_APART: f64 = 11.0;

/// The plot as SVG; throats that touch nothing, or let nothing pass, stand in the legend only.
pub(crate) fn svg(title: &str, scenes: &[ThroatScene]) -> String {
    let x = LinearAxis::over(paths(scenes).flatten().map(|held| held.h).chain([0.0]));
    let mut out = SHEET.title(title);
    let perimeters = |held: &Held| held.perimeter / PI;
    let first = SHEET.panel(0);
    let y = LinearAxis::over(paths(scenes).flatten().map(perimeters).chain([1.0]));
    out += &first.grid(x, y, "centroid position h / σ", "perimeter P / π");
    out += &curves(&first, scenes, x, y, perimeters);
    let slopes = |held: &Held| held.slope;
    let second = SHEET.panel(1);
    let y = LinearAxis::over(paths(scenes).flatten().map(slopes).chain([0.0]));
    out += &second.grid(x, y, "centroid position h / σ", "slope dP/dh");
    out += &pulls(&second, scenes, y);
    out += &curves(&second, scenes, x, y, slopes);
    for (k, scene) in scenes.iter().enumerate() {
        let ([x, y], colour) = (SHEET.legend(2, k), CURVES[k % CURVES.len()]);
        out += &line([x, y - 4.0], [x + 28.0, y - 4.0], colour, 1.8);
        out += &text([x + 36.0, y], 12.0, "start", "", &name(scene));
    }
    plot(SHEET.size(2, scenes.len()), &out)
}

fn name(scene: &ThroatScene) -> String {
    let gamma_c = scene.passage.gamma_c();
    let threshold = if gamma_c.is_finite() { significant(gamma_c, 4) } else { "any".to_owned() };
    format!("{}: Γ_c = {threshold}", scene.label())
}

fn paths(scenes: &[ThroatScene]) -> impl Iterator<Item = &[Held]> {
    scenes.iter().map(|scene| scene.passage.path.as_slice())
}

/// A curve for each throat, from the left end of the axis on, with a dot where the slope is largest.
fn curves(panel: &Panel, scenes: &[ThroatScene], x: LinearAxis, y: LinearAxis, value: fn(&Held) -> f64) -> String {
    let mut out = String::new();
    for (scene, colour) in scenes.iter().zip(CURVES.iter().cycle()) {
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

//! The plot of a fit: speed and shape against the position of the droplet, frames as points, simulations as lines.

use crate::report::axes::LinearAxis;
use crate::report::colours::CURVES;
use crate::report::panel::{Panel, Sheet};
use crate::report::svg::{circle, curve, line, plot, text};
use crate::study::calibrate::TrialFit;
use crate::study::calibrate::deviation::Deviation;
use crate::study::calibrate::frames::Trial;
use crate::study::calibrate::profile::Parameters;

/// Two panels over the whole width.
const SHEET: Sheet = Sheet { width: 720.0, panel_height: 270.0, right: 20.0 };

/// What a plot shows of one trial.
#[derive(Clone, Debug)]
pub(crate) struct TrialPlot {
    /// What the legend calls it.
    name: String,
    /// Frames: h, v_g, shape.
    frames: Vec<[f64; 3]>,
    /// The simulated passage: h, v_g, shape.
    curve: Vec<[f64; 3]>,
}

impl TrialPlot {
    /// The trial of that name and its fit.
    pub(crate) fn of(name: &str, trial: &Trial, fit: &TrialFit) -> Self {
        let TrialFit { parameters: Parameters { gamma, b0 }, deviation: Deviation { v_g, shape, .. }, profile } = fit;
        let (h, speeds, shapes) = (&profile.h, &profile.v_g, &profile.shape);
        Self {
            name: format!("{name}: gamma* = {gamma:.4}, b0* = {b0:.4}, Delta_v = {v_g:.4}, Delta_A = {shape:.4}"),
            frames: trial.frames.iter().map(|frame| [frame.h, frame.v_g, frame.shape]).collect(),
            curve: (0..h.len()).map(|k| [h[k], speeds[k], shapes[k]]).collect(),
        }
    }
}

/// The plot as SVG: v_g(h) above, shape(h) below, on the range of h that the frames cover.
pub(crate) fn svg(title: &str, trials: &[TrialPlot]) -> String {
    let mut out = SHEET.title(title);
    let h = LinearAxis::over(trials.iter().flat_map(|trial| trial.frames.iter().map(|frame| frame[0])));
    for (k, label) in [(1, "speed v_g / V_t"), (2, "shape parameter A")] {
        out += &draw(&SHEET.panel(k - 1), trials, h, k, label);
    }
    for (k, trial) in trials.iter().enumerate() {
        let ([x, y], colour) = (SHEET.legend(2, k), CURVES[k % CURVES.len()]);
        out += &circle([x + 4.0, y - 4.0], 3.0, &format!("fill=\"{colour}\""));
        out += &line([x + 12.0, y - 4.0], [x + 36.0, y - 4.0], colour, 1.6);
        out += &text([x + 44.0, y], 12.0, "start", "", &trial.name);
    }
    plot(SHEET.size(2, trials.len()), &out)
}

/// What a panel shows: column `k` of all trials against their h.
fn draw(panel: &Panel, trials: &[TrialPlot], x: LinearAxis, k: usize, label: &str) -> String {
    let seen = |row: &&[f64; 3]| (x.low..=x.high).contains(&row[0]);
    let all = trials.iter().flat_map(|trial| trial.frames.iter().chain(trial.curve.iter().filter(seen)));
    let y = LinearAxis::over(all.map(|row| row[k]));
    let place = |row: &[f64; 3]| panel.place(x.share(row[0]), y.share(row[k]));
    let mut out = panel.grid(x, y, "centroid position h / σ", label);
    for (trial, colour) in trials.iter().zip(CURVES.iter().cycle()) {
        let passage = trial.curve.iter().filter(seen).map(place);
        out += &curve("curve", passage, &format!("stroke=\"{colour}\" stroke-width=\"1.6\""));
        let style = format!("class=\"frame\" fill=\"{colour}\" fill-opacity=\"0.55\"");
        out.extend(trial.frames.iter().map(|row| circle(place(row), 2.8, &style)));
    }
    out
}

//! The plot of a fit: speed and shape against the position of the droplet, frames as points, simulations as lines.

use crate::report::axes::LinearAxis;
use crate::report::panel::Panel;
use crate::report::rounding::significant;
use crate::report::svg::{circle, curve, line, plot, text};
use crate::study::calibrate::TrialFit;
use crate::study::calibrate::deviation::Deviation;
use crate::study::calibrate::frames::Trial;
use crate::study::calibrate::profile::Parameters;

/// Width of the picture, height of a panel, in pixels.
const SIZE: [f64; 2] = [720.0, 270.0];

/// Left, right, above each panel, and below it, in pixels.
const MARGINS: [f64; 4] = [76.0, 20.0, 34.0, 52.0];

/// Colours that most eyes tell apart; trials take them in turn.
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];

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
    let [width, height] = SIZE;
    let mut out = text([MARGINS[0], 20.0], 13.0, "start", "font-weight=\"bold\"", title);
    let h = LinearAxis::over(trials.iter().flat_map(|trial| trial.frames.iter().map(|frame| frame[0])));
    for (k, label) in [(1, "speed v_g / V_t"), (2, "shape parameter A")] {
        out += &panel(trials, h, k, label, (k - 1) as f64 * height);
    }
    for (k, trial) in trials.iter().enumerate() {
        let (y, colour) = (2.0 * height + 20.0 * k as f64 + 8.0, COLOURS[k % COLOURS.len()]);
        out += &circle([MARGINS[0] + 4.0, y - 4.0], 3.0, &format!("fill=\"{colour}\""));
        out += &line([MARGINS[0] + 12.0, y - 4.0], [MARGINS[0] + 36.0, y - 4.0], colour, 1.6);
        out += &text([MARGINS[0] + 44.0, y], 12.0, "start", "", &trial.name);
    }
    plot([width, 2.0 * height + 20.0 * (trials.len() + 1) as f64], &out)
}

/// One panel, `top` pixels down: column `k` of all trials against their h.
fn panel(trials: &[TrialPlot], x: LinearAxis, k: usize, label: &str, top: f64) -> String {
    let [left, right, above, below] = MARGINS;
    let panel = Panel {
        corner: [left, top + above],
        size: [SIZE[0] - left - right, SIZE[1] - above - below],
        numbers: 11.0,
        numbers_off: [17.0, 6.0],
        drop: 4.0,
        names: 12.0,
        names_off: [36.0, 58.0],
    };
    let seen = |row: &&[f64; 3]| (x.low..=x.high).contains(&row[0]);
    let all = trials.iter().flat_map(|trial| trial.frames.iter().chain(trial.curve.iter().filter(seen)));
    let y = LinearAxis::over(all.map(|row| row[k]));
    let place = |row: &[f64; 3]| panel.place(x.share(row[0]), y.share(row[k]));
    let mut out = String::new();
    out.extend(x.ticks().map(|tick| panel.grid_x(x.share(tick), &significant(tick, 6))));
    out.extend(y.ticks().map(|tick| panel.grid_y(y.share(tick), &significant(tick, 6))));
    out += &panel.frame();
    for (trial, colour) in trials.iter().zip(COLOURS.iter().cycle()) {
        let passage = trial.curve.iter().filter(seen).map(place);
        out += &curve("curve", passage, &format!("stroke=\"{colour}\" stroke-width=\"1.6\""));
        let style = format!("class=\"frame\" fill=\"{colour}\" fill-opacity=\"0.55\"");
        out.extend(trial.frames.iter().map(|row| circle(place(row), 2.8, &style)));
    }
    out + &panel.axis_names("centroid position h / σ", label)
}

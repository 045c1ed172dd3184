//! The plot of error against time: a panel for each scene, both axes logarithmic, the front as a line.

use crate::parameters::Integrator;
use crate::report::axes::LogAxis;
use crate::report::colours::CURVES;
use crate::report::panel::Panel;
use crate::report::svg::{circle, curve, plot, text};
use crate::study::accuracy::front::{ParetoFront, Spot};

/// Width and height of a panel, in pixels; two stand side by side.
const PANEL: [f64; 2] = [380.0, 270.0];

/// Left, right, above and below the frame of a panel.
const MARGINS: [f64; 4] = [64.0, 14.0, 34.0, 46.0];

/// Height of the legend.
const LEGEND: f64 = 34.0;

/// The integrators in the order of the colours of curves.
const INTEGRATORS: [Integrator; 3] = [Integrator::Verlet, Integrator::Implicit, Integrator::Adaptive];

/// The colour of an integrator.
fn colour(integrator: Integrator) -> &'static str {
    CURVES[INTEGRATORS.iter().position(|other| *other == integrator).unwrap_or_default()]
}

/// The ring round the default setting.
const RING: &str = "fill=\"none\" stroke=\"black\"";

/// The plot as SVG.
pub(crate) fn svg(fronts: &[ParetoFront]) -> String {
    let rows = fronts.len().div_ceil(2).max(1);
    let (width, height) = (2.0 * PANEL[0], rows as f64 * PANEL[1] + LEGEND);
    let mut out = String::new();
    for (k, front) in fronts.iter().enumerate() {
        out += &panel(front, [(k % 2) as f64 * PANEL[0], (k / 2) as f64 * PANEL[1]]);
    }
    let y = height - LEGEND + 14.0;
    for (k, integrator) in INTEGRATORS.into_iter().enumerate() {
        let x = MARGINS[0] + 80.0 * k as f64;
        out += &circle([x, y - 4.0], 3.5, &format!("fill=\"{}\"", colour(integrator)));
        out += &text([x + 9.0, y], 11.0, "start", "", integrator.name());
    }
    out += &circle([MARGINS[0] + 250.0, y - 4.0], 6.5, RING);
    out += &text([MARGINS[0] + 262.0, y], 11.0, "start", "", "default; numbers are n_vertices, the line is the front");
    plot([width, height], &out)
}

fn panel(front: &ParetoFront, [left, top]: [f64; 2]) -> String {
    let panel = Panel {
        corner: [left + MARGINS[0], top + MARGINS[2]],
        size: [PANEL[0] - MARGINS[0] - MARGINS[1], PANEL[1] - MARGINS[2] - MARGINS[3]],
        numbers: 10.0,
        numbers_off: [15.0, 5.0],
        drop: 3.5,
        names: 10.5,
        names_off: [32.0, 50.0],
    };
    let seen: Vec<(&Spot, f64)> =
        front.spots.iter().filter_map(|spot| Some((spot, spot.error?.0)).filter(|(_, error)| *error > 0.0)).collect();
    let x = LogAxis::over(seen.iter().map(|(spot, _)| spot.ms_per_t0));
    let y = LogAxis::over(seen.iter().map(|(_, error)| *error));
    let place = |(spot, error): &(&Spot, f64)| panel.place(x.share(spot.ms_per_t0), y.share(*error));
    let title = format!("{} ({})", front.scene.name(), front.conditions);
    let mut out = text([panel.corner[0], top + 22.0], 11.0, "start", "font-weight=\"bold\"", &title);
    out.extend(x.ticks().into_iter().map(|tick| panel.grid_x(x.share(tick), &format!("{tick}"))));
    let short = |tick: f64| if tick < 1e-3 { format!("{tick:e}") } else { format!("{tick}") };
    out.extend(y.ticks().into_iter().map(|tick| panel.grid_y(y.share(tick), &short(tick))));
    out += &panel.frame();
    let best = seen.iter().filter(|(spot, _)| spot.on_front).map(place);
    out += &curve("front", best, "stroke=\"#888\" stroke-width=\"1.4\"");
    for one in &seen {
        let (at, spot) = (place(one), one.0);
        let colour = colour(spot.setting.1);
        out += &circle(at, 3.5, &format!("class=\"setting\" fill=\"{colour}\""));
        if Some(spot) == front.default() {
            out += &circle(at, 6.5, RING);
        }
        if spot.on_front {
            out += &text([at[0] + 6.0, at[1] - 5.0], 9.0, "start", "", &spot.setting.0.to_string());
        }
    }
    out + &panel.axis_names("ms of CPU per t0", "error")
}

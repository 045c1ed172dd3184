//! The forces on a droplet as arrows.
//!
//! An arrow ends where an obstacle pushes and is as long as the force is strong. The dark one is the weight of the
//! droplet on the same scale, so at a clog the red ones add up to its opposite.

use crate::parameters::MASS;
use crate::report::colours::{FORCE, WEIGHT};
use crate::report::svg::{arrow, circle};
use crate::report::view::View;
use crate::results::outline::{LoadRecord, Outline};

/// Length of the arrow of one weight, and the most that the strongest force gets, in sigma.
const ARROW: [f64; 2] = [0.45, 0.8];

/// Forces below this share of the weight get a dot and no arrow.
const WEAK: f64 = 0.01;

/// Whether a load is drawn as an arrow.
pub(super) fn is_strong(load: &LoadRecord) -> bool {
    strength(load) >= WEAK
}

/// The force of a load over the weight of the droplet.
fn strength(load: &LoadRecord) -> f64 {
    (load.fx * load.fx + load.fy * load.fy).sqrt() / MASS
}

/// The arrows of the weight and of the loads.
pub(super) fn forces(outline: &Outline, view: &View) -> String {
    let strongest = outline.loads.iter().map(strength).fold(1.0, f64::max);
    // Sigma per weight.
    let length = ARROW[0].min(ARROW[1] / strongest);
    let (width, head) = ((0.02 * view.scale).clamp(1.0, 4.0), (0.11 * view.scale).clamp(4.0, 20.0));
    let mut out = "<g class=\"forces\">\n".to_owned();
    let [x, y] = outline.centroid();
    out += &arrow(view.place(x, y), view.place(x + length, y), width, head, WEIGHT);
    out += &circle(view.place(x, y), 1.1 * width, &format!("fill=\"{WEIGHT}\""));
    for load in &outline.loads {
        let (to, scale) = (view.place(load.x, load.y), length / MASS);
        if is_strong(load) {
            let from = view.place(load.x - scale * load.fx, load.y - scale * load.fy);
            out += &arrow(from, to, width, head, FORCE);
        } else {
            out += &circle(to, width, &format!("fill=\"{FORCE}\""));
        }
    }
    out + "</g>\n"
}

//! What stands around a droplet, made again from the job's scene and seed, and drawn.

use super::svg::circle;
use super::view::View;
use crate::job::{Point, Scene};
use crate::scene::obstacles::ObstacleArray;
use crate::shape::ShapeRecord;
use crate::trajectory::Failure;

const OBSTACLE: &str = "#c3cad4";
const OBSTACLE_EDGE: &str = "#9aa4b2";
const LOADED: &str = "#8791a0";

/// The walls of a scene. A new scene is a variant, made in [`Surroundings::of`] and drawn in [`Surroundings::draw`].
#[derive(Clone, Debug)]
pub enum Surroundings {
    /// Discs in a periodic box.
    Discs(ObstacleArray),
}

impl Surroundings {
    /// Those of the run `seed` of a point.
    ///
    /// # Errors
    /// Where the scene cannot be made; its run failed likewise.
    pub fn of(point: &Point, seed: u64) -> Result<Self, Failure> {
        match &point.scene {
            Scene::Obstacles(field) => ObstacleArray::generate(field, seed).map(Self::Discs),
        }
    }

    /// Everything in view; what bears a load of `shape` is darker.
    pub(super) fn draw(&self, view: &View, shape: &ShapeRecord) -> String {
        match self {
            Self::Discs(array) => draw_discs(array, view, shape),
        }
    }
}

fn draw_discs(array: &ObstacleArray, view: &View, shape: &ShapeRecord) -> String {
    let [x0, x1, y0, y1] = view.bounds();
    let radius = array.radius;
    let mut discs = Vec::new();
    // Periodic images are drawn where the droplet is.
    array.for_each_in([0.0; 2], [x0 - radius, x1 + radius, y0 - radius, y1 + radius], |disc| discs.push(disc));
    discs.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let draw = |disc: &crate::scene::obstacles::Disc| {
        let reach = radius + 0.6;
        let bears = |load: &crate::shape::LoadRecord| {
            load.obstacle == disc.id && (load.x - disc.x).abs() < reach && (load.y - disc.y).abs() < reach
        };
        let style = if shape.loads.iter().any(bears) { format!("fill=\"{LOADED}\"") } else { String::new() };
        circle(view.place(disc.x, disc.y), radius * view.scale, &style)
    };
    let width = (0.006 * view.scale).clamp(0.2, 1.2);
    let drawn: String = discs.iter().map(draw).collect();
    format!(
        "<g class=\"obstacles\" fill=\"{OBSTACLE}\" stroke=\"{OBSTACLE_EDGE}\" stroke-width=\"{width:.2}\">\n{drawn}</g>\n"
    )
}

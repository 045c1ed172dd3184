//! The walls around a droplet, made again from the scene and the seed of its job, and drawn.

use crate::parameters::{Channel, Point, Scene};
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::physics::walls::disc::Disc;
use crate::report::colours::{LOADED, OBSTACLE, OBSTACLE_EDGE};
use crate::report::svg::circle;
use crate::report::view::View;
use crate::results::outline::{LoadRecord, Outline};
use crate::results::trajectory::Failure;

/// The walls of a scene. A new scene takes a new variant, which [`Surroundings::of`] makes and [`Surroundings::draw`]
/// draws.
#[derive(Debug)]
pub(crate) enum Surroundings {
    /// Discs in a periodic box.
    Discs(ObstacleArray),
    /// Two wedges.
    Wedges(Channel),
    /// A flat wall at x = 0.
    Plate,
}

impl Surroundings {
    /// The walls that the run `seed` of a point met.
    ///
    /// # Errors
    /// If the scene cannot be made; its run failed for the same reason.
    pub(crate) fn of(point: &Point, seed: u64) -> Result<Self, Failure> {
        match &point.scene {
            Scene::Obstacles(field) => ObstacleArray::generate(field, seed).map(Self::Discs),
            Scene::Channel(channel) => Ok(Self::Wedges(channel.clone())),
            Scene::Plate => Ok(Self::Plate),
            Scene::Disc(disc) => Ok(Self::Discs(ObstacleArray::lone(0.5 * disc.sigma_ob))),
        }
    }

    /// Whether all that is in view can be found.
    pub(crate) fn can_fill(&self, view: &View) -> bool {
        let [x0, x1, y0, y1] = view.bounds();
        let finite = [x0, x1, y0, y1].iter().all(|c| c.is_finite());
        match self {
            Self::Discs(array) => {
                finite && array.can_look([x1 - x0 + 2.0 * array.radius, y1 - y0 + 2.0 * array.radius])
            }
            Self::Wedges(_) | Self::Plate => finite,
        }
    }

    /// Everything in view; what bears a load of `outline` is darker.
    pub(super) fn draw(&self, view: &View, outline: &Outline) -> String {
        match self {
            Self::Discs(array) => draw_discs(array, view, outline),
            Self::Wedges(channel) => draw_wedges(channel, view),
            Self::Plate => draw_plate(view),
        }
    }
}

/// The plate as far as the view goes.
fn draw_plate(view: &View) -> String {
    let [_, x1, y0, y1] = view.bounds();
    let (low, left, right) = (x1.max(0.0) + 1.0, y0 - 1.0, y1 + 1.0);
    polygons(&[vec![[0.0, left], [low, left], [low, right], [0.0, right]]], view)
}

/// Both wedges as far as the view goes, in a hundred steps, so that their tips look round.
fn draw_wedges(channel: &Channel, view: &View) -> String {
    let [x0, x1, y0, y1] = view.bounds();
    let (sin, cos) = libm::sincos(channel.angle.to_radians());
    let radius = channel.tip_radius;
    let far = y0.abs().max(y1.abs()) + channel.w + 1.0;
    let surface = |x: f64| {
        let x = x.abs();
        let tip = 0.5 * channel.w + radius;
        let rounded = x < radius * sin;
        if rounded { tip - (radius * radius - x * x).sqrt() } else { tip - radius / cos + x * sin / cos }
    };
    let mut places: Vec<f64> = (0..=100).map(|k| x0 - 1.0 + (x1 - x0 + 2.0) * f64::from(k) / 100.0).collect();
    places.push(0.0);
    places.sort_by(f64::total_cmp);
    let wedge = |side: f64| {
        let mut outline: Vec<[f64; 2]> = places.iter().map(|&x| [x, side * surface(x).min(far)]).collect();
        outline.extend([[x1 + 1.0, side * far], [x0 - 1.0, side * far]]);
        outline
    };
    polygons(&[wedge(1.0), wedge(-1.0)], view)
}

/// Walls with straight sides.
fn polygons(outlines: &[Vec<[f64; 2]>], view: &View) -> String {
    let draw = |outline: &Vec<[f64; 2]>| {
        let points = outline.iter().map(|&[x, y]| view.place(x, y)).map(|[u, v]| format!("{u:.2},{v:.2}"));
        format!("<polygon points=\"{}\"/>\n", points.collect::<Vec<_>>().join(" "))
    };
    let drawn: String = outlines.iter().map(draw).collect();
    format!("<g class=\"obstacles\" fill=\"{OBSTACLE}\" stroke=\"{OBSTACLE_EDGE}\">\n{drawn}</g>\n")
}

fn draw_discs(array: &ObstacleArray, view: &View, outline: &Outline) -> String {
    let [x0, x1, y0, y1] = view.bounds();
    let radius = array.radius;
    let mut discs = Vec::new();
    // The array is periodic: this finds the images that are in view.
    array.for_each_in([0.0; 2], [x0 - radius, x1 + radius, y0 - radius, y1 + radius], |disc| discs.push(disc));
    discs.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let draw = |disc: &Disc| {
        let reach = radius + 0.6;
        let bears = |load: &LoadRecord| {
            load.obstacle == disc.id && (load.x - disc.x).abs() < reach && (load.y - disc.y).abs() < reach
        };
        let style = if outline.loads.iter().any(bears) { format!("fill=\"{LOADED}\"") } else { String::new() };
        circle(view.place(disc.x, disc.y), radius * view.scale, &style)
    };
    let width = (0.006 * view.scale).clamp(0.2, 1.2);
    let drawn: String = discs.iter().map(draw).collect();
    format!(
        "<g class=\"obstacles\" fill=\"{OBSTACLE}\" stroke=\"{OBSTACLE_EDGE}\" stroke-width=\"{width:.2}\">\n\
         {drawn}</g>\n"
    )
}

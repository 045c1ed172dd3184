//! How the droplet looks at one instant: its outline, and the loads on it.

use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::{Evaluation, Potential};
use crate::physics::liquid::taut::Taut;
use crate::physics::motion::darcy::{DarcyMotion, loads};
use crate::physics::walls::wall::{Obstacle, Walls};
use crate::results::outline::Outline;

impl<W: Walls> DarcyMotion<W> {
    /// The shape at time `t`, between the last two.
    fn shape_at(&self, t: f64) -> Polygon {
        let [from, to] = [self.readings[0].t, self.readings[1].t];
        let [now, before, _] = &self.shapes.last;
        let share = if to > from { ((t - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
        let mut shape = now.clone();
        for i in 0..now.len() {
            shape.x[i] = before.x[i] + share * (now.x[i] - before.x[i]);
            shape.y[i] = before.y[i] + share * (now.y[i] - before.y[i]);
        }
        shape
    }

    /// Which walls are near `shape`, and its evaluation without self-contact.
    fn seen(&self, shape: &Polygon) -> (Nearby<W::Obstacle>, Evaluation) {
        let Potential { walls, reach, .. } = &self.potential;
        let (mut nearby, mut seen) = (Nearby::none(), Evaluation::default());
        nearby.list(walls.as_ref(), self.shapes.origin, shape, *reach, None);
        self.potential.evaluate(shape, &nearby, &mut seen);
        (nearby, seen)
    }

    pub(super) fn outline_at(&self, t: f64) -> Outline {
        let shape = self.shape_at(t);
        let (nearby, seen) = self.seen(&shape);
        let [x0, y0] = self.shapes.origin;
        let outline = bent_outline(&shape, &seen.strings);
        let (x, y) = outline.x.iter().zip(&outline.y).map(|(x, y)| (x + x0, y + y0)).unzip();
        let loads = loads::of(&self.potential, &shape, &nearby, &seen, self.shapes.origin);
        Outline { t, x, y, loads }
    }

    /// World position of an obstacle inside the droplet, if there is one.
    pub(super) fn engulfed_now(&self) -> Option<[f64; 2]> {
        let shape = self.shape_at(self.now());
        let (_, seen) = self.seen(&shape);
        let outline = bent_outline(&shape, &seen.strings);
        let [x0, y0] = self.shapes.origin;
        let mut found = None;
        self.potential.walls.for_each_near(self.shapes.origin, shape.bounds(), |obstacle| {
            let inside = obstacle.inner_point().filter(|&point| outline.contains(point));
            found = found.or(inside.map(|[x, y]| [x + x0, y + y0]));
        });
        found
    }
}

/// Whether a listed obstacle lies inside of the outline: a step that is too long may leap over it.
pub(super) fn swallows<O: Obstacle>(shape: &Polygon, strings: &[Taut], nearby: &Nearby<O>) -> bool {
    let mut outline = None;
    nearby.obstacles.iter().filter_map(|near| near.obstacle.inner_point()).any(|point| {
        let outline = outline.get_or_insert_with(|| bent_outline(shape, strings));
        outline.contains(point)
    })
}

/// The outline with the points where its edges meet walls and leave them.
fn bent_outline(shape: &Polygon, strings: &[Taut]) -> Polygon {
    let mut outline = Polygon { x: Vec::new(), y: Vec::new() };
    for i in 0..shape.len() {
        outline.x.push(shape.x[i]);
        outline.y.push(shape.y[i]);
        for string in strings.iter().filter(|string| string.edge == i) {
            for [x, y] in string.touching().into_iter().flatten() {
                outline.x.push(string.centre[0] + x);
                outline.y.push(string.centre[1] + y);
            }
        }
    }
    outline
}

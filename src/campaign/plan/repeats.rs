//! Whether droplets may go further than one side of the periodic box, where they meet the same obstacles again.

use crate::parameters::{Point, Scene};
use std::sync::Arc;

/// Points at which a run may go further than the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeats {
    /// How many points of the block.
    pub points: usize,
    /// The way that a run may go at the point where it is longest, in sigma.
    pub way: f64,
    /// The side of the box there, in sigma.
    pub box_size: f64,
}

/// The points of a block at which obstacles may repeat; `None` if there are none.
pub(super) fn repeats(points: &[Arc<Point>]) -> Option<Repeats> {
    let beyond = |point: &Arc<Point>| {
        let Scene::Obstacles(array) = &point.scene else { return None };
        let way = (point.v_t * point.limits.t_max).min(point.limits.distance.unwrap_or(f64::INFINITY));
        (way > array.box_size).then_some(Repeats { points: 0, way, box_size: array.box_size })
    };
    let found: Vec<Repeats> = points.iter().filter_map(beyond).collect();
    let longest = found.iter().copied().max_by(|a, b| a.way.total_cmp(&b.way))?;
    Some(Repeats { points: found.len(), ..longest })
}

//! Whether t_max leaves a droplet time to flow its way and to come to rest after it.
//!
//! This matters in arrays of obstacles, where clogs are counted. A droplet that flows takes `way/(0.7 V_t)` for the
//! distance that a campaign asks for. If it is arrested at the end of that, E_k/E_t falls exponentially: to 1e-17 in
//! 500 to 1500 t0 at V_t = 0.03, that is, in the time of at most 45 sigma of free fall, and to another threshold in
//! proportion to its logarithm. A run with less time than both together may end above the threshold. It then counts as
//! a clog only if its rest can be seen from there. Near-wall drag is left out, which makes both times many times as
//! long.

use crate::parameters::{Point, Scene};
use std::sync::Arc;

/// The longest time from an arrest to E_k/E_t = 1e-17, in sigma of free fall.
const ARREST: f64 = 45.0;

/// The mean speed of a slow droplet that does not clog, in V_t. It turns a distance into a time.
const FLOWING_SPEED: f64 = 0.7;

/// Points whose time limit is short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortTime {
    /// How many points of the block.
    pub points: usize,
    /// The time limit at the point that lacks most, in t0.
    pub t_max: f64,
    /// The time that a droplet may need there, in t0.
    pub needed: f64,
}

/// The points of a block whose time limit is short; `None` if there are none.
pub(super) fn short(points: &[Arc<Point>]) -> Option<ShortTime> {
    let lacks = |point: &Arc<Point>| {
        let (t_max, needed) = (point.limits.t_max, needed(point)?);
        (t_max < needed).then_some(ShortTime { points: 0, t_max, needed })
    };
    let short: Vec<ShortTime> = points.iter().filter_map(lacks).collect();
    let lack = |short: &ShortTime| short.needed / short.t_max;
    let worst = short.iter().copied().max_by(|a, b| lack(a).total_cmp(&lack(b)))?;
    Some(ShortTime { points: short.len(), ..worst })
}

/// The time that a droplet may need to flow its way and to come to rest, in t0; `None` where no clogs are counted, and
/// where the campaign asks for no distance.
fn needed(point: &Point) -> Option<f64> {
    if !matches!(point.scene, Scene::Obstacles(_)) {
        return None;
    }
    let way = point.limits.distance?;
    Some((way / FLOWING_SPEED + to_threshold(point, ARREST)) / point.v_t)
}

/// The time from an arrest to the threshold of a point, in sigma of free fall, where it is `to_1e_17` to E_k/E_t = 1e-17.
pub(super) fn to_threshold(point: &Point, to_1e_17: f64) -> f64 {
    to_1e_17 * -libm::log10(point.limits.ek_threshold) / 17.0
}

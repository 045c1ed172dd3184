//! How far a droplet is likely to get, and how long its run lasts: a guess from what was measured before.
//!
//! Among obstacles whose gaps are narrower than the droplet it clogs after a way that is distributed exponentially, with
//! a decay length of about
//!
//! ```text
//! lambda = 7 sigma (0.39/density)^2 [1 + (s*/s)^p],   s = Gamma or E_w
//! ```
//!
//! It was fitted by eye to runs at density 0.39 and 0.7, w_ob = 0.2 to 0.5, sigma_ob = 0.3, and is right within a factor
//! of two there: 8 sigma for stiff droplets at 0.39, 26 at Gamma = 1 (16 for the liquid), and far more than that below
//! Gamma = 0.5. The liquid pinches off below Gamma = 0.2. In wider gaps droplets flow on.

use crate::campaign::plan::time::to_threshold;
use crate::parameters::{Dynamics, Model, ObstacleField, Point, Scene};

/// Typical mean speed of a droplet that does not clog, in V_t.
const SPEED: f64 = 0.8;

/// By how much near-wall drag slows a droplet among walls down, for b0 = 1.
const SLOWED: f64 = 15.0;

/// Gaps at least as wide as this do not clog, in sigma.
const WIDE: f64 = 0.8;

/// The time from the arrest of a ring of springs to E_k/E_t = 1e-17, in sigma of free fall.
const REST: f64 = 64.0;

/// That of a liquid droplet, and of a soft particle.
const REST_OF_OTHERS: f64 = 10.0;

/// What is expected of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expectation {
    /// How far the droplet gets, in sigma.
    pub(super) way: f64,
    /// How likely it is to come to rest.
    pub(super) rests: f64,
    /// How long the run lasts, in t0.
    pub(super) time: f64,
}

impl Expectation {
    pub(super) fn of(point: &Point) -> Self {
        let falls = SPEED * point.v_t / (1.0 + SLOWED * point.b0);
        let farthest = (falls * point.limits.t_max).min(longest_way(point));
        let (way, rests) = match &point.scene {
            Scene::Obstacles(field) => match decay_length(&point.model, field) {
                Some(lambda) => {
                    let clogs = -libm::expm1(-farthest / lambda);
                    (lambda * clogs, clogs)
                }
                None => (farthest, 0.0),
            },
            Scene::Channel(_) | Scene::Disc(_) => (farthest, 0.0),
            Scene::Plate => (0.0, 1.0),
        };
        let is_ring = matches!(&point.model, Model::Deformable(ring) if ring.dynamics == Dynamics::Vertex);
        let rest = to_threshold(point, if is_ring { REST } else { REST_OF_OTHERS }) / point.v_t;
        Self { way, rests, time: (way / falls + rests * rest).min(point.limits.t_max) }
    }
}

/// The way after which a run ends at the latest, in sigma.
fn longest_way(point: &Point) -> f64 {
    match &point.scene {
        Scene::Channel(channel) => channel.h_end - channel.h_start,
        Scene::Disc(disc) => disc.h_end - disc.h_start,
        Scene::Obstacles(_) | Scene::Plate => point.limits.distance.unwrap_or(f64::INFINITY),
    }
}

/// The decay length; `None` where droplets flow on.
fn decay_length(model: &Model, field: &ObstacleField) -> Option<f64> {
    if field.w_ob >= WIDE {
        return None;
    }
    let density = field.number_density();
    let softness = |measure: f64, half: f64, power: f64| libm::pow(half / measure, power);
    let softer = match model {
        Model::Deformable(ring) if ring.dynamics == Dynamics::Darcy && ring.gamma < 0.2 => 0.0,
        Model::Deformable(ring) if ring.dynamics == Dynamics::Darcy => softness(ring.gamma, 1.0, 2.9),
        Model::Deformable(ring) => softness(ring.gamma, 1.2, 6.0),
        Model::Soft(soft) => softness(soft.e_w, 4.4, 1.5),
    };
    Some(7.0 * (0.39 / density) * (0.39 / density) * (1.0 + softer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::file::Campaign;

    fn expected(keys: &str) -> Expectation {
        let text = format!("name = \"c\"\nruns_per_point = 1\nv_t = 0.03\n{keys}");
        Expectation::of(&Campaign::parse("c.toml", &text).unwrap().blocks[0].points[0])
    }

    const ARRAY: &str = "scene = \"obstacles\"\nsigma_ob = 0.3\nlimits.distance = 240.0\n";

    #[test]
    fn a_run_lasts_until_a_clog_or_until_its_limits() {
        let narrow = "w_ob = 0.2\ndensity = 0.39\nmodel = \"SP\"";
        let stiff = expected(&format!("{ARRAY}{narrow}\ne_w = 100.0"));
        assert!((5.0..10.0).contains(&stiff.way) && stiff.rests > 0.99, "{stiff:?}");
        let soft = expected(&format!("{ARRAY}{narrow}\ne_w = 0.1"));
        assert!(soft.way > 200.0 && soft.rests < 0.2, "{soft:?}");
        let wide = expected(&format!("{ARRAY}w_ob = 1.0\ndensity = \"saturated\"\nmodel = \"SP\"\ne_w = 100.0"));
        assert_eq!((wide.way, wide.rests, wide.time), (240.0, 0.0, 240.0 / 0.8 / 0.03));
        let short = expected(&format!(
            "{ARRAY}w_ob = 1.0\ndensity = \"saturated\"\nmodel = \"SP\"\ne_w = 1.0\nlimits.t_max = 100.0"
        ));
        assert_eq!(short.time, 100.0);
        let channel =
            expected("scene = \"channel\"\nw = 0.7\ngamma = 0.5\nmodel = \"DP\"\nh_start = -1.0\nh_end = 2.0");
        assert_eq!(channel.way, 3.0);
    }
}

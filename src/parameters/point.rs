//! A grid point: everything that decides a trajectory except the seed.
//!
//! The JSON form of a [`Point`] is canonical (fixed field order, shortest floats that read back the same), so its hash
//! is the identity of the point. A field that is added later carries `#[serde(default, skip_serializing_if = ...)]`
//! with the value that means "as before": old points then keep their hashes, and nothing is computed twice.

use crate::parameters::{Integrator, Model, PointId, Scene};
use serde::{Deserialize, Serialize};

/// The exponent of the near-wall drag of [C24].
pub(crate) const PAPER_ALPHA: f64 = 4.0 / 3.0;

/// One grid point: everything that decides a trajectory except the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The droplet.
    pub model: Model,
    /// Where it moves.
    pub scene: Scene,
    /// Terminal speed of the free droplet, `V_t = M/b_inf`, in `sqrt(g sigma)`.
    pub v_t: f64,
    /// Strength of the near-wall drag, `b0/b_inf` ([C24] eq. 6); zero switches it off.
    #[serde(default, skip_serializing_if = "is_default")]
    pub b0: f64,
    /// Exponent of the near-wall drag; `None` is the paper's 4/3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// How time advances.
    pub stepping: Stepping,
    /// When the trajectory ends.
    pub limits: Limits,
    /// Time between two recorded samples, in t0.
    pub sample_every: f64,
    /// Time between two kept outlines, in t0; `None` keeps only the last one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shapes_every: Option<f64>,
}

/// How time advances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stepping {
    /// The integrator.
    pub integrator: Integrator,
    /// Time step, in t0.
    pub dt: f64,
}

/// When a trajectory ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Longest simulated time, in t0.
    pub t_max: f64,
    /// Displacement along +x after which the trajectory ends, in sigma.
    pub distance: Option<f64>,
    /// A droplet that has once moved is clogged when E_k/E_t falls below this ([C24] App. C).
    pub ek_threshold: f64,
}

impl Point {
    /// A droplet in a scene, with the defaults of campaign files. Only its stepping is not chosen: it is Verlet with
    /// steps of 1e-3.
    pub fn new(model: Model, scene: Scene) -> Self {
        Self {
            model,
            scene,
            v_t: 0.03,
            b0: 0.0,
            alpha: None,
            stepping: Stepping { integrator: Integrator::Verlet, dt: 1e-3 },
            limits: Limits { t_max: 2e5, distance: None, ek_threshold: 1e-17 },
            sample_every: 10.0,
            shapes_every: None,
        }
    }

    /// The canonical text of this point, which is hashed and stored.
    ///
    /// Its numbers must be finite, as a validated campaign guarantees; JSON writes others as `null`.
    pub fn canonical(&self) -> String {
        serde_json::to_string(self).expect("a point holds only plain numbers and names")
    }

    /// Identity of the course of its droplets, which time limit and distance only cut off: points that differ in
    /// nothing else share it.
    pub(crate) fn course(&self) -> PointId {
        let limits = Limits { t_max: 0.0, distance: None, ..self.limits.clone() };
        Self { limits, ..self.clone() }.id()
    }

    /// Identity of this grid point.
    pub fn id(&self) -> PointId {
        PointId::of_canonical(&self.canonical())
    }
}

/// Whether a field has its default, which the canonical text leaves out.
pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, JobId, ObstacleField, Soft};

    fn point() -> Point {
        let density = Density::Number(0.35);
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density, box_size: 500.0 };
        Point::new(Model::Soft(Soft { e_w: 10.0 }), Scene::Obstacles(field))
    }

    #[test]
    fn a_point_survives_its_canonical_form() {
        let text = point().canonical();
        let back: Point = serde_json::from_str(&text).unwrap();
        assert_eq!(back, point());
        assert_eq!(back.canonical(), text);
    }

    #[test]
    fn points_that_differ_in_time_limit_and_distance_alone_share_their_course() {
        let mut longer = point();
        longer.limits = Limits { t_max: 7.0, distance: Some(3.0), ..longer.limits };
        assert_eq!(longer.course(), point().course());
        longer.limits.ek_threshold = 1e-12;
        assert_ne!(longer.course(), point().course());
    }

    #[test]
    fn identities_differ_with_any_parameter_and_with_the_seed() {
        let mut other = point();
        other.v_t = 0.030_000_000_000_000_002;
        assert_ne!(point().id(), other.id());
        assert_ne!(JobId::new(point().id(), 0), JobId::new(point().id(), 1));
    }
}

//! A value for every key of a block, and the grid point that they make.

use crate::campaign::choose::stepping;
use crate::campaign::choose::tolerance;
use crate::campaign::file::keys::Key;
use crate::campaign::file::{Estimate, Until};
use crate::parameters::{Dynamics, GravityForm, Integrator, IntegratorChoice, Model, Point, Scene, Soft, Value};
use crate::physics::simulate::stability::{StabilityLimit, vertices_pile_up};

/// The default of e_w under `dynamics = "darcy"`, up to Gamma = 1, and in proportion above: a contact then gives way by
/// 1e-5 sigma. In channels it is five times as much, because the threshold of an orifice depends on a sharp tip.
const HARD_WALL: f64 = 1e7;

/// The largest e_w.
const HARDEST: f64 = 1e8;

/// The number of vertices under `dynamics = "darcy"`. Soft droplets drape themselves over obstacles, and their outline
/// becomes several times as long; edges must stay short against an obstacle.
fn darcy_vertices(gamma: f64, hangs: bool) -> usize {
    match gamma {
        gamma if !hangs || gamma >= 0.3 => tolerance::LIQUID_VERTICES,
        gamma if gamma >= 0.1 => 96,
        gamma if gamma >= 0.03 => 128,
        _ => 192,
    }
}

/// A value for every key that means something in a block. It is complete before a point is made of it.
#[derive(Clone, Default)]
pub(super) struct Draft(Vec<(&'static Key, Value)>);

impl Draft {
    /// Adds a key, and returns its place for [`Draft::put`].
    pub(super) fn push(&mut self, key: &'static Key, value: Value) -> usize {
        self.0.push((key, value));
        self.0.len() - 1
    }

    /// Gives the key at this place another value.
    pub(super) fn put(&mut self, place: usize, value: Value) {
        self.0[place].1 = value;
    }

    fn value(&self, name: &str) -> Option<Value> {
        self.0.iter().find(|(key, _)| key.name == name).map(|(_, value)| *value)
    }

    /// The number of a key; `None` for a word.
    fn maybe(&self, name: &str) -> Option<f64> {
        self.value(name)?.number()
    }

    /// The number of a key that holds no words.
    pub(super) fn number(&self, name: &str) -> f64 {
        self.maybe(name).expect("a block gives every key that means something a value")
    }

    fn word(&self, name: &str) -> &'static str {
        self.value(name).and_then(Value::word).unwrap_or_default()
    }

    /// The keys that the file leaves to the campaign.
    pub(super) fn open(&self) -> Vec<&'static str> {
        let is_open = |key: &Key, value| key.parameter.is_some_and(|parameter| parameter.is_open(value));
        self.0.iter().filter(|(key, value)| is_open(key, *value)).map(|(key, _)| key.name).collect()
    }

    /// Whether the file leaves the value of a key to the campaign.
    fn is_open(&self, name: &str) -> bool {
        self.word(name) == "auto"
    }

    /// The integrator that is asked for.
    pub(super) fn integrator(&self) -> IntegratorChoice {
        IntegratorChoice::from_name(self.word("integrator")).unwrap_or_default()
    }

    /// When seeds are added, if they are.
    pub(super) fn until(&self) -> Option<Until> {
        let estimate = if self.word("estimate") == "v_g" { Estimate::Speed } else { Estimate::Lambda };
        let max_runs = self.number("max_runs") as u64;
        let from = self.number("fit_from");
        self.maybe("relative_error").map(|relative_error| Until { estimate, relative_error, max_runs, from })
    }

    /// The tolerance that chooses vertices and stepping; `None` where they are given, and for a soft particle.
    pub(super) fn tolerance(&self) -> Option<f64> {
        self.maybe("tolerance")
    }

    /// The grid point, and the stability limit that it is held against.
    pub(super) fn point(&self) -> (Point, StabilityLimit) {
        let mut point = self.as_given();
        self.choose_stiffness(&mut point);
        self.choose_vertices(&mut point);
        let limit = StabilityLimit::of(&point);
        point.stepping = stepping::choose(self.integrator(), self.maybe("dt"), &point, &limit);
        let chosen = self.tolerance().and_then(|tolerance| tolerance::table().choose(tolerance, &point).ok());
        let (mut point, limit) = match chosen {
            None => (point, limit),
            Some(choice) => {
                let mut point = tolerance::with_vertices(&point, choice.setting.n_vertices);
                point.stepping = choice.stepping;
                let limit = StabilityLimit::of(&point);
                (point, limit)
            }
        };
        forget_unused_error(&mut point);
        (point, limit)
    }

    /// The point with all that the file gives; model and scene, which stand first in the list, settle its parts.
    fn as_given(&self) -> Point {
        let mut point = Point::new(Model::Soft(Soft { e_w: f64::NAN }), Scene::Plate);
        for &(key, value) in &self.0 {
            if let Some(parameter) = key.parameter.filter(|parameter| !parameter.is_open(value)) {
                parameter.set(&mut point, value);
            }
        }
        if point.b0 == 0.0 {
            // An exponent that changes nothing must not give the point another identity.
            point.alpha = None;
        }
        point
    }

    /// The number of vertices, if the file leaves it open.
    fn choose_vertices(&self, point: &mut Point) {
        let hangs = matches!(point.scene, Scene::Obstacles(_) | Scene::Disc(_));
        let Model::Deformable(ring) = &mut point.model else { return };
        if self.is_open("n_vertices") {
            ring.n_vertices = match ring.dynamics {
                Dynamics::Vertex => tolerance::DEFAULT_VERTICES,
                Dynamics::Darcy => darcy_vertices(ring.gamma, hangs),
            };
        }
    }

    /// The stiffnesses that the file leaves open.
    fn choose_stiffness(&self, point: &mut Point) {
        let Model::Deformable(ring) = &mut point.model else { return };
        if self.is_open("e_w") {
            ring.e_w = match (ring.dynamics, &point.scene) {
                (Dynamics::Darcy, Scene::Channel(_)) => (5.0 * HARD_WALL * ring.gamma.max(1.0)).min(HARDEST),
                (Dynamics::Darcy, _) => (HARD_WALL * ring.gamma.max(1.0)).min(HARDEST),
                (Dynamics::Vertex, Scene::Channel(_)) => 1e6,
                (Dynamics::Vertex, _) => 1e4,
            };
        }
        if ring.dynamics == Dynamics::Darcy {
            // Constant tension, hydrostatic weight, and contact of edges are what this dynamics is.
            (ring.kappa, ring.gravity) = (0.0, GravityForm::Centroid);
            return;
        }
        // A passage through a channel is over before vertices have slid far; among obstacles a droplet may hang for
        // good.
        let hangs = matches!(point.scene, Scene::Obstacles(_) | Scene::Disc(_));
        if self.is_open("kappa") && hangs && vertices_pile_up(ring) {
            ring.kappa = ring.linear_kappa();
        }
    }
}

/// Steps of fixed length do not ask for the error of a step, so it is no part of what the point is.
fn forget_unused_error(point: &mut Point) {
    if let (Model::Deformable(ring), false) = (&mut point.model, point.stepping.integrator == Integrator::Adaptive) {
        ring.step_error = None;
    }
}

//! A value for every key, and the grid point it makes.

use crate::campaign::choose::stepping;
use crate::campaign::choose::tolerance;
use crate::campaign::file::keys::{Id, Value};
use crate::campaign::file::{Estimate, Until};
use crate::parameters::{
    Channel, ContactKind, Deformable, Density, Engulfed, GravityForm, Integrator, IntegratorChoice, Limits, LoneDisc,
    Model, ObstacleField, PAPER_KAPPA, Point, Scene, SelfContact, Soft, Stepping, WallStiffness,
};
use crate::physics::simulate::stability::{StabilityLimit, vertices_pile_up};

/// A value for every key that means something; made whole before a point is taken from it.
#[derive(Clone)]
pub(super) struct Draft([Option<Value>; Id::COUNT]);

impl Draft {
    pub(super) fn new() -> Self {
        Self([None; Id::COUNT])
    }

    pub(super) fn set(&mut self, id: Id, value: Value) {
        self.0[id as usize] = Some(value);
    }

    /// The number of a key; `None` for a word.
    fn maybe(&self, id: Id) -> Option<f64> {
        match self.0[id as usize] {
            Some(Value::Number(number)) => Some(number),
            Some(Value::Word(_)) | None => None,
        }
    }

    /// The number of a key that holds no words.
    pub(super) fn number(&self, id: Id) -> f64 {
        self.maybe(id).expect("the table of keys gives every key that means something a value")
    }

    fn word(&self, id: Id) -> &'static str {
        match self.0[id as usize] {
            Some(Value::Word(word)) => word,
            Some(Value::Number(_)) | None => "",
        }
    }

    /// The integrator that is asked for.
    pub(super) fn integrator(&self) -> IntegratorChoice {
        IntegratorChoice::from_name(self.word(Id::Integrator)).unwrap_or_default()
    }

    /// When seeds are added, if they are.
    pub(super) fn until(&self) -> Option<Until> {
        let estimate = if self.word(Id::Estimate) == "v_g" { Estimate::Speed } else { Estimate::Lambda };
        let max_runs = self.number(Id::MaxRuns) as u64;
        self.maybe(Id::RelativeError).map(|relative_error| Until { estimate, relative_error, max_runs })
    }

    /// The tolerance that chooses vertices and stepping; `None` where they are given, and of a soft particle.
    pub(super) fn tolerance(&self) -> Option<f64> {
        self.maybe(Id::Tolerance)
    }

    /// The grid point, and the stability limit it was held against.
    pub(super) fn point(&self) -> (Point, StabilityLimit) {
        let mut point = Point {
            model: self.model(),
            scene: self.scene(),
            v_t: self.number(Id::VT),
            b0: self.number(Id::B0),
            // Left out where it changes nothing.
            alpha: (self.number(Id::B0) > 0.0).then(|| self.number(Id::Alpha)),
            stepping: Stepping { integrator: Integrator::Verlet, dt: 0.0 },
            limits: Limits {
                t_max: self.number(Id::TMax),
                distance: self.maybe(Id::Distance),
                ek_threshold: self.number(Id::EkThreshold),
            },
            sample_every: self.number(Id::SampleEvery),
            shapes_every: self.maybe(Id::ShapesEvery),
        };
        let limit = StabilityLimit::of(&point);
        point.stepping = stepping::choose(self.integrator(), self.maybe(Id::Dt), &point, &limit);
        let Some(choice) = self.tolerance().and_then(|tolerance| tolerance::table().choose(tolerance, &point).ok())
        else {
            return (point, limit);
        };
        let mut point = tolerance::with_vertices(&point, choice.setting.n_vertices);
        point.stepping = choice.stepping;
        let limit = StabilityLimit::of(&point);
        (point, limit)
    }

    fn model(&self) -> Model {
        if self.word(Id::Model) == "SP" {
            return Model::Soft(Soft { e_w: self.number(Id::EW) });
        }
        let mut ring = Deformable {
            gamma: self.number(Id::Gamma),
            kappa: self.maybe(Id::Kappa).unwrap_or(PAPER_KAPPA),
            k_a: self.number(Id::KA),
            n_vertices: self.number(Id::NVertices) as usize,
            e_w: self.maybe(Id::EW).unwrap_or(if self.word(Id::Scene) == "channel" { 1e6 } else { 1e4 }),
            delta: self.number(Id::Delta),
            eps: self.number(Id::Eps),
            wall: WallStiffness::from_name(self.word(Id::Wall)).unwrap_or_default(),
            contact: ContactKind::from_name(self.word(Id::Contact)).unwrap_or_default(),
            gravity: GravityForm::from_name(self.word(Id::Gravity)).unwrap_or_default(),
            self_contact: SelfContact::from_name(self.word(Id::SelfContact)).unwrap_or_default(),
            engulfed: Engulfed::from_name(self.word(Id::Engulfed)).unwrap_or_default(),
        };
        // A passage through a channel is over before vertices have slid far; among obstacles a droplet may hang for good.
        let hangs = matches!(self.word(Id::Scene), "obstacles" | "disc");
        if self.maybe(Id::Kappa).is_none() && hangs && vertices_pile_up(&ring) {
            ring.kappa = ring.linear_kappa();
        }
        Model::Deformable(ring)
    }

    fn scene(&self) -> Scene {
        match self.word(Id::Scene) {
            "channel" => Scene::Channel(Channel {
                w: self.number(Id::W),
                angle: self.number(Id::Angle),
                tip_radius: self.number(Id::TipRadius),
                h_start: self.number(Id::HStart),
                h_end: self.number(Id::HEnd),
            }),
            "plate" => Scene::Plate,
            "disc" => Scene::Disc(LoneDisc {
                sigma_ob: self.number(Id::SigmaOb),
                offset: self.number(Id::Offset),
                h_start: self.number(Id::HStart),
                h_end: self.number(Id::HEnd),
            }),
            _ => Scene::Obstacles(self.obstacles()),
        }
    }

    fn obstacles(&self) -> ObstacleField {
        ObstacleField {
            w_ob: self.number(Id::WOb),
            sigma_ob: self.number(Id::SigmaOb),
            density: self.maybe(Id::Density).map_or(Density::Saturated, Density::Number),
            box_size: self.number(Id::BoxSize),
        }
    }
}

//! `tolerance = 0.01`: the cheapest measured setting of N_v, dt and integrator whose error is at most the tolerance.
//!
//! The settings and their errors stand in `measured.toml`, which `meniscus accuracy --record` writes. The error of a
//! setting is the largest relative error of the headline observables of its kind of scene. It includes what the
//! measurement could not resolve.
//!
//! | kind | observables |
//! |---|---|
//! | channel | `A_max - 1`, transit time from h = -1 to 1 |
//! | flow: arrays whose gaps are at least as wide as the droplet | `<v_g>` |
//! | clog: arrays of narrower gaps | lambda |
//! | free | V_t, E_k/E_t, the way fallen |
//!
//! All settings were measured in the same arrays, so the errors are those of discretisation and not of the small number
//! of arrays. Each kind was measured at one tension, which the table names. Errors are largest near the tension at
//! which a droplet just passes.
//!
//! At a point whose stability limit is lower, a measured dt is reduced to 0.8 of that limit; the smaller step is no
//! less accurate.

use crate::campaign::choose::stepping;
use crate::parameters::{Integrator, IntegratorChoice, Model, Point, Scene, Stepping};
use crate::physics::simulate::stability::{AUTO_SHARE, StabilityLimit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The default of `n_vertices` under `dynamics = "darcy"`, but for soft droplets among obstacles.
pub(crate) const LIQUID_VERTICES: usize = 64;

/// The default of `n_vertices` under `dynamics = "vertex"`.
pub(crate) const DEFAULT_VERTICES: usize = 256;

/// N_v, the integrator, and its step; `None` is the automatic step.
pub(crate) type Knobs = (usize, Integrator, Option<f64>);

/// A kind of scene that settings were measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A droplet that touches nothing.
    Free,
    /// A droplet that passes a constriction.
    Channel,
    /// An array whose gaps are at least as wide as the droplet.
    Flow,
    /// An array of narrower gaps.
    Clog,
}

impl Kind {
    pub(crate) const ALL: [Self; 4] = [Self::Free, Self::Channel, Self::Flow, Self::Clog];

    /// The kind of a deformable droplet's scene; `None` where nothing was measured.
    pub(crate) fn of(point: &Point) -> Option<Self> {
        let Model::Deformable(ring) = &point.model else { return None };
        let radius = 0.5 * (1.0 + ring.delta);
        match &point.scene {
            Scene::Channel(channel) if channel.first_contact(radius) == 0.0 => Some(Self::Free),
            Scene::Channel(_) => Some(Self::Channel),
            Scene::Obstacles(field) if field.w_ob >= 1.0 => Some(Self::Flow),
            Scene::Obstacles(_) => Some(Self::Clog),
            Scene::Disc(disc) if disc.offset.abs() > radius + 0.5 * disc.sigma_ob => Some(Self::Free),
            Scene::Disc(_) | Scene::Plate => None,
        }
    }

    /// The kind in words that follow "measured".
    pub(crate) const fn place(self) -> &'static str {
        match self {
            Self::Free => "in free flight",
            Self::Channel => "in channels",
            Self::Flow => "in arrays of gaps as wide as a droplet",
            Self::Clog => "in arrays that clog",
        }
    }
}

/// A setting, its cost and its error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setting {
    /// Vertices of the ring.
    pub n_vertices: usize,
    /// The integrator.
    pub integrator: Integrator,
    /// Its step, in t0; `None` is the automatic one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dt: Option<f64>,
    /// The step at which it was measured, in t0.
    pub step: f64,
    /// Milliseconds of CPU per t0 on the machine of the table.
    pub ms_per_t0: f64,
    /// The largest relative error of its headline observables.
    pub error: f64,
    /// The observable that has this error.
    pub of: String,
}

/// What was measured in one kind of scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// The scenes in words, with their parameters.
    pub scenes: String,
    /// The settings.
    pub settings: Vec<Setting>,
}

/// The table in `measured.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Machine, day and commit of the measurement.
    pub measured: String,
    /// What was measured, by kind.
    pub kinds: BTreeMap<Kind, Measured>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Choice<'t> {
    pub(crate) setting: &'t Setting,
    /// Integrator and step at the point.
    pub(crate) stepping: Stepping,
    /// Its cost over that of the default setting; `None` if that was not measured.
    pub(crate) over_default: Option<f64>,
    /// The default setting, if it was measured.
    pub(crate) default: Option<&'t Setting>,
    pub(crate) scenes: &'t str,
    pub(crate) kind: Kind,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Unmet<'t> {
    /// Nothing was measured in scenes of this kind.
    NotMeasured,
    /// Even the most accurate setting of the kind has a larger error; `None` if the kind has no settings.
    TooFine(Kind, Option<&'t Setting>),
}

/// The table that comes with the program.
pub fn table() -> &'static Table {
    static TABLE: OnceLock<Table> = OnceLock::new();
    TABLE.get_or_init(|| toml::from_str(include_str!("measured.toml")).expect("the table is tested with the program"))
}

impl Table {
    /// Of the settings whose error is at most `tolerance`, the one that costs least at the point. Of two equally cheap
    /// settings the more accurate one is taken.
    ///
    /// # Errors
    /// [`Unmet`].
    pub(crate) fn choose(&self, tolerance: f64, point: &Point) -> Result<Choice<'_>, Unmet<'_>> {
        let kind = Kind::of(point).filter(|_| !stepping::is_darcy(point)).ok_or(Unmet::NotMeasured)?;
        let measured = self.kinds.get(&kind).ok_or(Unmet::TooFine(kind, None))?;
        let priced = |setting| {
            let stepping = stepping_at(setting, point);
            (setting.ms_per_t0 * setting.step / stepping.dt, setting, stepping)
        };
        // The costs of fixed implicit steps hold only where droplets do not fold.
        let folds = matches!(&point.model, Model::Deformable(ring) if stepping::folds(ring));
        let known = |setting: &&Setting| !folds || setting.integrator != Integrator::Implicit;
        let fit = measured.settings.iter().filter(known).filter(|setting| setting.error <= tolerance).map(priced);
        let best = fit.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.error.total_cmp(&b.1.error)));
        let Some((cost, setting, stepping)) = best else {
            let finest = measured.settings.iter().min_by(|a, b| a.error.total_cmp(&b.error));
            return Err(Unmet::TooFine(kind, finest));
        };
        let default = default_at(point);
        let default = measured.settings.iter().find(|setting| setting.knobs() == default).map(priced);
        Ok(Choice {
            setting,
            stepping,
            over_default: default.as_ref().map(|(default, ..)| cost / default),
            default: default.map(|(_, setting, _)| setting),
            scenes: &measured.scenes,
            kind,
        })
    }
}

impl Setting {
    pub(crate) fn knobs(&self) -> Knobs {
        (self.n_vertices, self.integrator, self.dt)
    }
}

/// The setting that a campaign takes at such a point by default.
pub(crate) fn default_at(point: &Point) -> Knobs {
    if stepping::is_darcy(point) {
        return (LIQUID_VERTICES, Integrator::Adaptive, None);
    }
    let point = with_vertices(point, DEFAULT_VERTICES);
    let chosen = stepping::choose(IntegratorChoice::Auto, None, &point, &StabilityLimit::of(&point));
    (DEFAULT_VERTICES, chosen.integrator, None)
}

/// Integrator and step of a setting at a point, within the limits that hold there.
fn stepping_at(setting: &Setting, point: &Point) -> Stepping {
    let limit = StabilityLimit::of(&with_vertices(point, setting.n_vertices));
    let dt = match (setting.integrator, setting.dt) {
        (Integrator::Verlet, Some(dt)) => dt.min(AUTO_SHARE * limit.dt_max),
        (Integrator::Verlet, None) => limit.auto_dt(),
        (Integrator::Implicit, Some(dt)) => dt.min(stepping::implicit_dt_bound(point.v_t)),
        (Integrator::Implicit, None) => stepping::implicit_dt(point),
        (Integrator::Adaptive, dt) => dt.unwrap_or_else(|| stepping::adaptive_dt(point)),
    };
    Stepping { integrator: setting.integrator, dt }
}

pub(crate) fn with_vertices(point: &Point, n_vertices: usize) -> Point {
    let mut point = point.clone();
    if let Model::Deformable(ring) = &mut point.model {
        ring.n_vertices = n_vertices;
    }
    point
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Deformable, Density, ObstacleField, Soft};

    fn setting(n_vertices: usize, dt: Option<f64>, ms_per_t0: f64, error: f64) -> Setting {
        let step = dt.unwrap_or(1e-3);
        let of = "<v_g>".to_owned();
        Setting { n_vertices, integrator: Integrator::Verlet, dt, step, ms_per_t0, error, of }
    }

    fn table() -> Table {
        let settings = vec![
            setting(64, None, 0.25, 0.05),
            setting(64, Some(2e-3), 0.13, 0.06),
            Setting { integrator: Integrator::Adaptive, step: 0.125, ..setting(256, None, 1.0, 0.01) },
            setting(512, Some(5e-4), 4.0, 0.002),
        ];
        let kinds = BTreeMap::from([(Kind::Clog, Measured { scenes: "somewhere".to_owned(), settings })]);
        Table { measured: "never".to_owned(), kinds }
    }

    fn point(gamma: f64) -> Point {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Saturated, box_size: 50.0 };
        Point::new(Model::Deformable(Deformable::of_tension(gamma)), Scene::Obstacles(field))
    }

    #[test]
    fn the_cheapest_setting_that_meets_the_tolerance_is_taken() {
        let table = table();
        for (tolerance, n_vertices, dt) in [(0.1, 64, 2e-3), (0.055, 64, 1e-3), (0.02, 256, 0.125), (0.002, 512, 5e-4)]
        {
            let choice = table.choose(tolerance, &point(1.09)).unwrap();
            assert_eq!((choice.setting.n_vertices, choice.stepping.dt), (n_vertices, dt), "{tolerance}");
        }
        let coarse = table.choose(0.055, &point(1.09)).unwrap();
        assert_eq!((coarse.over_default, coarse.default.map(|setting| setting.error)), (Some(0.25), Some(0.01)));
        let fixed = Setting { integrator: Integrator::Implicit, ..setting(32, Some(0.0625), 0.01, 0.001) };
        let mut with_fixed = table.clone();
        with_fixed.kinds.values_mut().for_each(|measured| measured.settings.push(fixed.clone()));
        let chosen = |gamma| with_fixed.choose(0.055, &point(gamma)).unwrap().stepping.integrator;
        assert_eq!(chosen(1.09), Integrator::Implicit);
        assert_eq!(chosen(0.1), Integrator::Verlet, "fixed implicit steps converge badly where droplets fold");
    }

    #[test]
    fn a_finer_tolerance_than_anything_measured_is_refused_with_the_finest() {
        let table = table();
        let refused = table.choose(1e-3, &point(1.09)).unwrap_err();
        assert!(matches!(refused, Unmet::TooFine(Kind::Clog, Some(finest)) if finest.error == 0.002));
        let soft = Point::new(Model::Soft(Soft { e_w: 1.0 }), point(1.0).scene);
        assert_eq!(table.choose(0.5, &soft), Err(Unmet::NotMeasured));
    }

    #[test]
    fn a_step_never_exceeds_what_is_stable_at_the_point() {
        let table = table();
        for gamma in [0.1, 1.0, 10.0, 100.0] {
            let point = point(gamma);
            let choice = table.choose(0.1, &point).unwrap();
            let limit = StabilityLimit::of(&with_vertices(&point, choice.setting.n_vertices));
            assert!(choice.stepping.dt <= AUTO_SHARE * limit.dt_max);
        }
    }

    #[test]
    fn the_table_that_comes_with_the_program_reads_and_knows_the_defaults() {
        let table = super::table();
        let point = point(1.09);
        assert!(table.kinds.len() == Kind::ALL.len());
        for kind in Kind::ALL {
            let measured = &table.kinds[&kind];
            assert!(measured.settings.iter().any(|setting| setting.knobs() == default_at(&point)), "{kind:?}");
            let sound = |setting: &&Setting| setting.error > 0.0 && setting.ms_per_t0 > 0.0 && setting.step > 0.0;
            assert!(measured.settings.iter().all(|setting| sound(&setting)), "{kind:?}");
        }
    }
}

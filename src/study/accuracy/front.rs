//! Error against computing time: all settings of N_v, dt and integrator in a scene, and their Pareto front.

use crate::campaign::choose::tolerance::{Knobs, default_at};
use crate::parameters::{Model, Point, Scene};
use crate::study::accuracy::ladder::{Column, Ladder};
use crate::study::accuracy::records::{Difference, PointRecords};
use crate::study::accuracy::scene::TestScene;

/// A slower setting is on the front only if its error is smaller by more than this share.
const VISIBLE: f64 = 0.02;

/// One setting of a scene, with its cost and its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// Vertices, integrator, and its step; `None` is the automatic step.
    pub setting: Knobs,
    /// The step that it took, in t0.
    pub step: f64,
    /// Milliseconds per t0, on one thread.
    pub ms_per_t0: f64,
    /// The largest error of a headline observable, including what could not be resolved, and the name of that
    /// observable; `None` if a value is missing.
    pub error: Option<(f64, &'static str)>,
    /// Why a value is missing, if the error is `None`.
    pub excuse: String,
    /// Whether no faster setting is as accurate, within 2%.
    pub on_front: bool,
}

/// All settings of a scene, the fastest first. Some of them form the Pareto front of error against time.
#[derive(Clone, Debug, PartialEq)]
pub struct ParetoFront {
    /// The scene.
    pub scene: TestScene,
    /// The parameters it was measured at, in words.
    pub conditions: String,
    /// The settings.
    pub spots: Vec<Spot>,
    /// The setting that campaigns take by default in such a scene.
    default: Knobs,
}

impl ParetoFront {
    /// Compares all settings of a scene with the finest ring of its ladder in N_v; `None` if the scene has no headline
    /// observables or nothing ran.
    pub(super) fn of(finest: &Ladder, all: &[PointRecords]) -> Option<Self> {
        let headlines: Vec<&Column> = finest.columns.iter().filter(|column| column.observable.headline).collect();
        let reference = finest.reference()?;
        if headlines.is_empty() {
            return None;
        }
        let spot = |one: &PointRecords| {
            Some(Spot {
                setting: one.setting()?,
                step: one.point.stepping.dt,
                ms_per_t0: one.ms_per_t0()?,
                error: largest_error(one, reference, &headlines),
                excuse: one.excuse(),
                on_front: false,
            })
        };
        let mut spots: Vec<Spot> = all.iter().filter_map(spot).collect();
        spots.sort_by(|a, b| a.ms_per_t0.total_cmp(&b.ms_per_t0));
        mark(&mut spots);
        // These scenes are sampled more often than those of campaigns, which would limit the step.
        let default = default_at(&Point { sample_every: f64::INFINITY, ..(*reference.point).clone() });
        let conditions = conditions(&reference.point);
        (!spots.is_empty()).then_some(Self { scene: finest.scene, conditions, spots, default })
    }

    /// The setting that campaigns take by default, if it was measured.
    pub(crate) fn default(&self) -> Option<&Spot> {
        self.spots.iter().find(|spot| spot.setting == self.default)
    }

    /// The fastest setting that is as accurate as the default, within 2%.
    pub(crate) fn instead_of_default(&self) -> Option<&Spot> {
        let (error, _) = self.default()?.error?;
        self.spots.iter().find(|spot| spot.error.is_some_and(|(other, _)| other <= (1.0 + VISIBLE) * error))
    }
}

/// The largest error of a headline observable, and its name.
///
/// If the exact value is known, the error is the difference from it. Otherwise it is the difference from the finest
/// ring, plus the error of that ring, plus two standard errors of the difference if there are several seeds.
fn largest_error(one: &PointRecords, reference: &PointRecords, headlines: &[&Column]) -> Option<(f64, &'static str)> {
    let error = |column: &&Column| {
        let observable = column.observable;
        let error = match observable.exact {
            Some(exact) => (one.value(observable)? / exact(&one.point) - 1.0).abs(),
            None => {
                let Difference { size, spread } = one.difference(reference, observable)?;
                size + 2.0 * spread + column.left_over?
            }
        };
        Some((error, observable.name))
    };
    headlines.iter().map(error).collect::<Option<Vec<_>>>()?.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Marks the settings on the front: each must be better than all faster ones by [`VISIBLE`].
fn mark(spots: &mut [Spot]) {
    let mut best = f64::INFINITY;
    for spot in spots {
        let error = spot.error.map_or(f64::INFINITY, |(error, _)| error);
        spot.on_front = error < (1.0 - VISIBLE) * best;
        best = best.min(error);
    }
}

fn conditions(point: &Point) -> String {
    let gamma = match &point.model {
        Model::Deformable(ring) => format!("gamma = {}", ring.gamma),
        Model::Soft(soft) => format!("e_w = {}", soft.e_w),
    };
    match &point.scene {
        Scene::Channel(channel) => format!("{gamma}, w = {}", channel.w),
        Scene::Obstacles(field) => format!("{gamma}, w_ob = {}, sigma_ob = {}", field.w_ob, field.sigma_ob),
        Scene::Plate | Scene::Disc(_) => gamma,
    }
}

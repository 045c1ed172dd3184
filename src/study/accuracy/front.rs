//! Error against time: every setting of N_v, dt and integrator in a scene, and those that no other beats.

use crate::campaign::choose::tolerance::{Kind, Knobs, Measured as MeasuredKind, Setting, Table, default_at};
use crate::parameters::{Model, Point, Scene};
use crate::study::accuracy::ladder::{Column, Ladder};
use crate::study::accuracy::study::Study;
use crate::study::accuracy::{Accuracy, Deviation, Measured};
use std::collections::BTreeMap;

/// By how much a slower setting must be more accurate to stand on the front.
const VISIBLE: f64 = 0.02;

/// One setting of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// Vertices, integrator, and its step where that is not the automatic one.
    pub setting: Knobs,
    /// The step it took, in t0.
    pub step: f64,
    /// Milliseconds per t0, one thread.
    pub ms_per_t0: f64,
    /// The largest error of a headline observable, what is not resolved added, and of which; `None` where a value is missing.
    pub error: Option<(f64, &'static str)>,
    /// Why it is missing.
    pub excuse: String,
    /// Whether no faster setting is as accurate, within 2%.
    pub on_front: bool,
}

/// All settings of a scene, the fastest first.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    /// The scene.
    pub study: Study,
    /// The parameters it was measured at, in words.
    pub conditions: String,
    /// The settings.
    pub spots: Vec<Spot>,
    /// What campaigns have by default in such a scene.
    default: Knobs,
}

impl Front {
    /// Holds all settings of a scene against the finest ring of its ladder in N_v; `None` without headline observables or without settings.
    ///
    /// The error of a setting is its distance from that ring, plus what the ring itself is off by, plus two standard errors of the distance
    /// where there are several seeds; against the exact value where one is known.
    pub(super) fn of(finest: &Ladder, all: Vec<Measured>) -> Option<Self> {
        let headlines: Vec<_> = finest.columns.iter().filter(|column| column.observable.headline).collect();
        let reference = finest.reference()?;
        if headlines.is_empty() {
            return None;
        }
        let error = |one: &Measured| -> Option<(f64, &'static str)> {
            let of = |column: &&Column| {
                let observable = column.observable;
                let Some(exact) = observable.exact else {
                    let Deviation { size, spread } = one.deviation(reference, observable)?;
                    return Some((size + 2.0 * spread + column.left_over?, observable.name));
                };
                Some(((one.value(observable)? / exact(&one.point) - 1.0).abs(), observable.name))
            };
            headlines.iter().map(of).collect::<Option<Vec<_>>>()?.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let mut spots: Vec<Spot> = all
            .iter()
            .filter_map(|one| {
                Some(Spot {
                    setting: one.setting()?,
                    step: one.point.stepping.dt,
                    ms_per_t0: one.ms_per_t0()?,
                    error: error(one),
                    excuse: one.excuse(),
                    on_front: false,
                })
            })
            .collect();
        spots.sort_by(|a, b| a.ms_per_t0.total_cmp(&b.ms_per_t0));
        let mut best = f64::INFINITY;
        for spot in &mut spots {
            let error = spot.error.map_or(f64::INFINITY, |(error, _)| error);
            // A setting that costs more must be visibly better.
            spot.on_front = error < (1.0 - VISIBLE) * best;
            best = best.min(error);
        }
        // Scenes of a study are sampled more often than campaigns are, which bounds the step.
        let default = default_at(&Point { sample_every: f64::INFINITY, ..(*reference.point).clone() });
        let conditions = conditions(&reference.point);
        let front = Self { study: finest.study, conditions, spots, default };
        (!front.spots.is_empty()).then_some(front)
    }

    /// What campaigns take by default.
    pub fn default(&self) -> Option<&Spot> {
        self.spots.iter().find(|spot| spot.setting == self.default)
    }

    /// The fastest setting that is as accurate as the default, within 2%.
    pub fn instead_of_default(&self) -> Option<&Spot> {
        let (error, _) = self.default()?.error?;
        self.spots.iter().find(|spot| spot.error.is_some_and(|(other, _)| other <= (1.0 + VISIBLE) * error))
    }
}

/// The parameters that matter, in words.
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

impl Accuracy {
    /// The table that `tolerance` reads: of each kind the settings that were measured in all its scenes, with the worst of their errors.
    pub fn table(&self, measured: String) -> Table {
        let kinds = Kind::ALL.into_iter().filter_map(|kind| {
            let fronts: Vec<&Front> = self.fronts.iter().filter(|front| front.study.kind() == Some(kind)).collect();
            let settings = settings(&fronts);
            let scenes = fronts.iter().map(|front| front.conditions.as_str()).collect::<Vec<_>>().join("; ");
            (!settings.is_empty()).then_some((kind, MeasuredKind { scenes, settings }))
        });
        Table { measured, kinds: kinds.collect::<BTreeMap<_, _>>() }
    }
}

/// What the fronts of one kind have in common; a setting that nothing came of in one of them is left out.
fn settings(fronts: &[&Front]) -> Vec<Setting> {
    let Some((first, others)) = fronts.split_first() else { return Vec::new() };
    let mut settings = Vec::new();
    for spot in &first.spots {
        let twins = others.iter().map(|front| front.spots.iter().find(|other| other.setting == spot.setting));
        let Some(same) = std::iter::once(Some(spot)).chain(twins).collect::<Option<Vec<&Spot>>>() else { continue };
        let Some(errors) = same.iter().map(|spot| spot.error).collect::<Option<Vec<_>>>() else { continue };
        let Some((error, of)) = errors.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        let mean = |value: fn(&Spot) -> f64| same.iter().map(|spot| value(spot)).sum::<f64>() / same.len() as f64;
        let (n_vertices, integrator, dt) = spot.setting;
        settings.push(Setting {
            n_vertices,
            integrator,
            dt,
            step: round(mean(|spot| spot.step)),
            ms_per_t0: round(mean(|spot| spot.ms_per_t0)),
            // Rounded up, and never nothing.
            error: round(1.005 * error).max(1e-9),
            of: of.to_owned(),
        });
    }
    settings
}

/// Three significant digits.
fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

//! Makes the table that `tolerance` reads from the fronts of all scenes.

use crate::campaign::choose::tolerance::{Kind, Measured, Setting, Table};
use crate::study::accuracy::Accuracy;
use crate::study::accuracy::front::{ParetoFront, Spot};

impl Accuracy {
    /// The table that `tolerance` reads. For each kind of scene it holds the settings that were measured in all scenes
    /// of that kind, each with its largest error. `measured` says where and when.
    pub fn table(&self, measured: String) -> Table {
        let kinds = Kind::ALL.into_iter().filter_map(|kind| {
            let fronts: Vec<&ParetoFront> =
                self.fronts.iter().filter(|front| front.scene.kind() == Some(kind)).collect();
            let settings = settings(&fronts);
            let scenes = fronts.iter().map(|front| front.conditions.as_str()).collect::<Vec<_>>().join("; ");
            (!settings.is_empty()).then_some((kind, Measured { scenes, settings }))
        });
        Table { measured, kinds: kinds.collect() }
    }
}

/// The settings that all fronts of one kind have, with an error in each.
fn settings(fronts: &[&ParetoFront]) -> Vec<Setting> {
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
            // Rounded up, and never zero.
            error: round(1.005 * error).max(1e-9),
            of: of.to_owned(),
        });
    }
    settings
}

fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

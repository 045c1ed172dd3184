//! What accuracy costs: errors, observed orders of convergence, and the front of error against computing time, from the
//! runs of an accuracy campaign.
//!
//! A block named `SCENE.KNOB` is a [`Ladder`]: its points, the *rungs*, vary one parameter, the *knob*. Errors are
//! differences from the finest rung, or from the exact value if that is known. A block `SCENE.settings` varies several
//! parameters at once and counts only for the [`front`], where every setting of N_v, dt and integrator is compared with
//! the finest ring of the scene.
//!
//! Droplets of one seed meet the same array at every setting. So the standard error of an error is that of paired
//! differences (by the jackknife over seeds), which is much smaller than the standard error of the value itself. If a
//! droplet may get stuck in another place, agreement in all n runs proves little: up to 3 in n other runs may differ.
//!
//! Read [`scene`] first, then [`observable`], [`records`], [`ladder`] and [`front`].

pub mod front;
pub mod ladder;
pub mod observable;
pub mod order;
mod readings;
pub mod records;
pub mod scene;
mod table;

use crate::campaign::file::{Block, Campaign};
use crate::parameters::PointId;
use crate::results::fits::RunRecord;
use crate::study::accuracy::ladder::{Knob, Ladder};
use crate::study::accuracy::{front::ParetoFront, records::PointRecords, scene::TestScene};
use std::collections::HashMap;

/// The accuracy that a campaign measured.
#[derive(Clone, Debug)]
pub struct Accuracy {
    /// The ladders, in the order of their blocks.
    pub ladders: Vec<Ladder>,
    /// Error against time, one front for each scene that has rings of several sizes.
    pub fronts: Vec<ParetoFront>,
}

/// A block that is neither `SCENE.KNOB` nor `SCENE.settings`.
#[derive(Debug, thiserror::Error)]
#[error("block `{block}`: {problem}")]
pub struct BadBlock {
    /// Its name.
    pub block: String,
    /// What is wrong with the name, and what is expected.
    pub problem: String,
}

/// The scene and the knob in the name of a block; no knob for `settings`.
///
/// # Errors
/// [`BadBlock`].
pub(crate) fn parts(block: &str) -> Result<(TestScene, Option<Knob>), BadBlock> {
    let bad = |problem: String| BadBlock { block: block.to_owned(), problem };
    let (scene, knob) = block.split_once('.').unwrap_or((block, ""));
    let unknown = || bad(format!("name it SCENE.KNOB, with one of {} as SCENE", TestScene::NAMES.join(", ")));
    let scene = TestScene::from_name(scene).ok_or_else(unknown)?;
    match (knob, Knob::from_name(knob)) {
        ("settings", _) => Ok((scene, None)),
        (_, Some(knob)) => Ok((scene, Some(knob))),
        _ => {
            let known = Knob::NAMES.join(", ");
            Err(bad(format!("name it {}.KNOB, with one of {known}, settings as KNOB", scene.name())))
        }
    }
}

/// Evaluates the runs of a campaign; `runs` holds those of each point, by seed.
///
/// # Errors
/// [`BadBlock`].
pub fn judge(campaign: &Campaign, runs: &HashMap<PointId, Vec<RunRecord>>) -> Result<Accuracy, BadBlock> {
    let mut ladders: Vec<Ladder> = Vec::new();
    let mut settings: Vec<(TestScene, Vec<PointRecords>)> = Vec::new();
    for block in &campaign.blocks {
        let (scene, knob) = parts(&block.name)?;
        let records = records_of(block, runs);
        if knob.is_none_or(Knob::is_setting) {
            let known = match settings.iter_mut().find(|(other, _)| *other == scene) {
                Some((_, known)) => known,
                None => &mut settings.push_mut((scene, Vec::new())).1,
            };
            for one in &records {
                if known.iter().all(|other| other.point_id != one.point_id) {
                    known.push(one.clone());
                }
            }
        }
        if let Some(knob) = knob {
            ladders.push(Ladder::of(scene, knob, records));
        }
    }
    let finest =
        |scene| ladders.iter().find(|ladder: &&Ladder| ladder.scene == scene && ladder.knob == Knob::NVertices);
    let fronts = settings.into_iter().filter_map(|(scene, all)| ParetoFront::of(finest(scene)?, &all)).collect();
    Ok(Accuracy { ladders, fronts })
}

fn records_of(block: &Block, runs: &HashMap<PointId, Vec<RunRecord>>) -> Vec<PointRecords> {
    let points = block.points.iter().zip(&block.point_ids);
    let records = points.map(|(point, &point_id)| PointRecords {
        point: point.clone(),
        point_id,
        runs: runs.get(&point_id).cloned().unwrap_or_default(),
    });
    records.collect()
}

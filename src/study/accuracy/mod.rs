//! What accuracy costs: from the runs of an accuracy campaign to errors, observed orders, and the front of error
//! against time.
//!
//! A block named `SCENE.KNOB` is a [`Ladder`]: its points vary one knob, and errors are taken against its finest rung,
//! or against the exact value where one is known. A block `SCENE.settings` varies several keys at once and counts for
//! the [`front`] alone, where every setting of N_v, dt and integrator is held against the finest ring of the scene.
//!
//! Droplets of one seed meet the same array at every setting. The spread of an error is therefore that of paired
//! differences (by the jackknife over seeds), which is far smaller than the spread of the value itself. Where a droplet
//! may get stuck in another place, agreement in all n runs proves little: up to 3 in n other runs may still differ.
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
use crate::study::accuracy::front::ParetoFront;
use crate::study::accuracy::ladder::{Knob, Ladder};
use crate::study::accuracy::records::PointRecords;
use crate::study::accuracy::scene::TestScene;
use std::collections::HashMap;

/// Everything that a campaign says of accuracy.
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
    /// What is wrong with it, and what is expected.
    pub problem: String,
}

/// The scene and the knob that the name of a block speaks of; no knob for `settings`.
///
/// # Errors
/// [`BadBlock`].
pub(crate) fn parts(block: &str) -> Result<(TestScene, Option<Knob>), BadBlock> {
    let bad = |problem: String| BadBlock { block: block.to_owned(), problem };
    let (scene, knob) = block.split_once('.').unwrap_or((block, ""));
    let scene = TestScene::from_name(scene).ok_or_else(|| {
        let known: Vec<_> = TestScene::ALL.iter().map(|scene| scene.name()).collect();
        bad(format!("name it SCENE.KNOB, with one of {} as SCENE", known.join(", ")))
    })?;
    match (knob, Knob::from_name(knob)) {
        ("settings", _) => Ok((scene, None)),
        (_, Some(knob)) => Ok((scene, Some(knob))),
        _ => {
            let known: Vec<_> = Knob::ALL.iter().map(|knob| knob.name()).collect();
            Err(bad(format!("name it {}.KNOB, with one of {}, settings as KNOB", scene.name(), known.join(", "))))
        }
    }
}

/// Judges the runs of a campaign; `runs` holds those of each point, by seed.
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

/// What the runs of each point of a block left.
fn records_of(block: &Block, runs: &HashMap<PointId, Vec<RunRecord>>) -> Vec<PointRecords> {
    let points = block.points.iter().zip(&block.point_ids);
    let records = points.map(|(point, &point_id)| PointRecords {
        point: point.clone(),
        point_id,
        runs: runs.get(&point_id).cloned().unwrap_or_default(),
    });
    records.collect()
}

//! What accuracy costs: from the runs of an accuracy campaign to errors, observed orders, and the front of error against time.
//!
//! A block named `SCENE.KNOB` is a [`Ladder`]: its points vary one knob. Errors are against its finest rung, or against the exact value where
//! one is known. Blocks `SCENE.settings` vary several keys at once and count for the [`front`] alone, where every setting of N_v, dt and integrator is
//! held against the finest ring of the scene. Droplets of one seed meet the same array at every setting, so the spread of an error is that
//! of paired differences (jackknife over seeds), far smaller than the spread of the value itself. Where a droplet may get stuck in another place, agreement of
//! all n runs proves little: as many as 3 in n others may differ.

pub mod front;
pub mod ladder;
pub mod order;
pub mod study;

use crate::campaign::choose::stepping::candidates;
use crate::campaign::choose::tolerance::Knobs;
use crate::campaign::file::Campaign;
use crate::parameters::{Point, PointId};
use crate::physics::simulate::stability::StabilityLimit;
use crate::results::fits::RunRecord;
use front::Front;
use ladder::{Knob, Ladder};
use std::collections::HashMap;
use std::sync::Arc;
use study::{Observable, Study};

/// A grid point and what its runs left.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The point.
    pub point: Arc<Point>,
    /// Its identity.
    pub point_id: PointId,
    /// Its runs, by seed.
    pub runs: Vec<RunRecord>,
}

/// A difference of two estimates, and its standard error where there are several seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Its size, relative or in the unit of the observable.
    pub size: f64,
    /// Its standard error by the jackknife over seeds, no less than `1.5/n` of n runs that can jump; 0 of a single one that cannot.
    pub spread: f64,
}

/// Everything that a campaign says of accuracy.
#[derive(Clone, Debug)]
pub struct Accuracy {
    /// The ladders, in the order of their blocks.
    pub ladders: Vec<Ladder>,
    /// Error against time, a front for each scene that has rings of several sizes.
    pub fronts: Vec<Front>,
}

/// A block that is neither `SCENE.KNOB` nor `SCENE.settings`.
#[derive(Debug, thiserror::Error)]
#[error("block `{block}`: {problem}")]
pub struct BadBlock {
    /// Its name.
    pub block: String,
    /// What is wrong, and what is expected.
    pub problem: String,
}

/// The scene and the knob that the name of a block speaks of; no knob for `settings`.
///
/// # Errors
/// [`BadBlock`].
pub fn parts(block: &str) -> Result<(Study, Option<Knob>), BadBlock> {
    let bad = |problem: String| BadBlock { block: block.to_owned(), problem };
    let (scene, knob) = block.split_once('.').unwrap_or((block, ""));
    let study = Study::from_name(scene).ok_or_else(|| {
        let known: Vec<_> = Study::ALL.iter().map(|study| study.name()).collect();
        bad(format!("its name must begin with one of {}, and a point", known.join(", ")))
    })?;
    match (knob, Knob::from_name(knob)) {
        ("settings", _) => Ok((study, None)),
        (_, Some(knob)) => Ok((study, Some(knob))),
        _ => {
            let known: Vec<_> = Knob::ALL.iter().map(|knob| knob.name()).collect();
            Err(bad(format!("after the scene its name must end with one of {}, settings", known.join(", "))))
        }
    }
}

/// Judges the runs of a campaign; `runs` holds those of each point, by seed.
///
/// # Errors
/// [`BadBlock`].
pub fn judge(campaign: &Campaign, runs: &HashMap<PointId, Vec<RunRecord>>) -> Result<Accuracy, BadBlock> {
    let mut ladders: Vec<Ladder> = Vec::new();
    let mut by_study: Vec<(Study, Vec<Measured>)> = Vec::new();
    for block in &campaign.blocks {
        let (study, knob) = parts(&block.name)?;
        let measured: Vec<Measured> = block
            .points
            .iter()
            .zip(&block.point_ids)
            .map(|(point, &point_id)| Measured {
                point: point.clone(),
                point_id,
                runs: runs.get(&point_id).cloned().unwrap_or_default(),
            })
            .collect();
        if knob.is_none_or(Knob::is_setting) {
            let all = match by_study.iter_mut().find(|(of, _)| *of == study) {
                Some((_, all)) => all,
                None => &mut by_study.push_mut((study, Vec::new())).1,
            };
            for one in &measured {
                if all.iter().all(|other| other.point_id != one.point_id) {
                    all.push(one.clone());
                }
            }
        }
        if let Some(knob) = knob {
            ladders.push(Ladder::of(study, knob, measured));
        }
    }
    let finest =
        |study| ladders.iter().find(|ladder: &&Ladder| ladder.study == study && ladder.knob == Knob::NVertices);
    let fronts = by_study.into_iter().filter_map(|(study, all)| Front::of(finest(study)?, all)).collect();
    Ok(Accuracy { ladders, fronts })
}

impl Measured {
    /// The observable from all runs; `None` if a run is missing or failed, or does not have it.
    pub fn value(&self, observable: &Observable) -> Option<f64> {
        self.estimate(observable, None)
    }

    /// The same without the run at one place.
    fn estimate(&self, observable: &Observable, left_out: Option<usize>) -> Option<f64> {
        if self.runs.is_empty() || self.runs.iter().any(|run| run.outcome.is_none()) {
            return None;
        }
        let kept = self.runs.iter().enumerate().filter(|(k, _)| Some(*k) != left_out).map(|(_, run)| run);
        (observable.estimate)(&self.point, &kept.collect::<Vec<_>>()).filter(|value| value.is_finite())
    }

    /// By how much the observable differs from that of `other`, whose runs have the same seeds.
    pub fn deviation(&self, other: &Self, observable: &Observable) -> Option<Deviation> {
        let difference = |left_out| {
            let (mine, theirs) = (self.estimate(observable, left_out)?, other.estimate(observable, left_out)?);
            Some((mine - theirs) / scale(observable, theirs))
        };
        let size = difference(None)?.abs();
        let paired = self.runs.len() == other.runs.len();
        let spread = if paired { self.jackknife(difference) } else { 0.0 };
        // What none of n runs shows may still happen to 3 in n (95%), and two standard errors are to cover it.
        let unseen =
            if observable.can_jump && self.point_id != other.point_id { 1.5 / self.runs.len() as f64 } else { 0.0 };
        Some(Deviation { size, spread: spread.max(unseen) })
    }

    /// Standard error of the observable itself, as relative as its errors; `None` of a single run.
    pub fn statistical(&self, observable: &Observable) -> Option<f64> {
        let value = self.value(observable)?;
        let relative = |left_out| Some(self.estimate(observable, left_out)? / scale(observable, value));
        (self.runs.len() > 1).then(|| self.jackknife(relative))
    }

    /// `sqrt((n - 1)/n sum (x_k - mean)^2)` of an estimate without each of the n runs in turn.
    fn jackknife(&self, estimate: impl Fn(Option<usize>) -> Option<f64>) -> f64 {
        let n = self.runs.len();
        let without: Vec<f64> = (0..n).filter_map(|k| estimate(Some(k))).collect();
        if n < 2 || without.len() < n {
            return 0.0;
        }
        let n = n as f64;
        let mean = without.iter().sum::<f64>() / n;
        ((n - 1.0) / n * without.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>()).sqrt()
    }

    /// Milliseconds of wall time per t0 on one thread, over all runs; `None` if nothing ran.
    pub fn ms_per_t0(&self) -> Option<f64> {
        let sum = |of: fn(&RunRecord) -> f64| self.runs.iter().map(of).sum::<f64>();
        let time = sum(|run| run.t_end);
        (time > 0.0).then(|| 1e3 * sum(|run| run.wall_s) / time)
    }

    /// Why an observable is not there, in a word or two.
    pub fn excuse(&self) -> String {
        let failed = self.runs.iter().filter(|run| run.outcome.is_none()).count();
        match self.runs.first() {
            None => "not run".to_owned(),
            Some(_) if failed > 0 => format!("{failed} failed"),
            Some(run) => match run.outcome {
                Some(crate::results::trajectory::Outcome::Clogged) => "stuck".to_owned(),
                Some(crate::results::trajectory::Outcome::Exited) => "passes".to_owned(),
                _ => "no end".to_owned(),
            },
        }
    }

    /// N_v, integrator, and a step that is not its automatic one; `None` for a soft particle.
    pub fn setting(&self) -> Option<Knobs> {
        let crate::parameters::Model::Deformable(ring) = &self.point.model else { return None };
        let stepping = &self.point.stepping;
        let automatic = candidates(&self.point, &StabilityLimit::of(&self.point)).contains(stepping);
        Some((ring.n_vertices, stepping.integrator, (!automatic).then_some(stepping.dt)))
    }
}

/// What a difference is divided by.
fn scale(observable: &Observable, value: f64) -> f64 {
    if observable.relative { value.abs() } else { 1.0 }
}

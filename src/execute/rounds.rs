//! Seeds are added in rounds until an interval is narrow enough.
//!
//! A block with `until` begins with `runs_per_point` seeds at each point. When all of them have ended, a point whose
//! 95% interval is wider than asked for doubles its seeds, up to `max_runs`. The stored results of the point's own
//! round alone decide that, so the seeds that are run depend neither on timing nor on threads nor on interruptions:
//! whoever asks again, in any state of the store, gets the round that is under way, or the next.

use crate::campaign::file::{Block, Campaign, Estimate, Until};
use crate::parameters::{Job, JobId, JobState, Point, PointId};
use crate::results::fits::PointRuns;
use crate::study::speed::speed_average;
use crate::study::survival::lambda_fit;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// What decides whether a point needs more seeds.
#[derive(Debug)]
pub(super) struct Evidence {
    runs: HashMap<PointId, PointRuns>,
    states: HashMap<JobId, JobState>,
}

impl Evidence {
    /// From the finished runs and the states of all jobs of a store.
    pub(super) fn new(runs: Vec<PointRuns>, states: Vec<(JobId, JobState)>) -> Self {
        let runs = runs.into_iter().map(|point| (point.point_id, point)).collect();
        Self { runs, states: states.into_iter().collect() }
    }

    fn ended(&self, job: &Job) -> bool {
        matches!(self.states.get(&job.id()), Some(JobState::Done | JobState::Failed))
    }

    /// Half of the 95% interval over the estimate, from these seeds alone; `None` if there is no interval.
    fn relative_error(&self, id: PointId, until: Until, seeds: &std::ops::Range<u64>) -> Option<f64> {
        let mut point = self.runs.get(&id)?.clone();
        point.runs.retain(|run| seeds.contains(&run.seed));
        let (value, low, high) = match until.estimate {
            Estimate::Lambda => {
                let fit = lambda_fit(&point, until.from);
                (fit.lambda, fit.lambda_low, fit.lambda_high)
            }
            Estimate::Speed => {
                let average = speed_average(&point);
                (average.v_g, average.v_g_low, average.v_g_high)
            }
        };
        Some(0.5 * (high? - low?) / value?)
    }
}

/// The campaign with the seeds of the round that is under way, or of the next. Points of one block that need different
/// numbers of seeds stand in blocks of their own.
pub(super) fn grown(campaign: &Campaign, evidence: &Evidence) -> Campaign {
    let blocks = campaign.blocks.iter().flat_map(|block| match block.until {
        None => vec![block.clone()],
        Some(until) => by_runs(block, |point, id| runs_of(point, id, until, block, evidence)),
    });
    Campaign { blocks: blocks.collect(), ..campaign.clone() }
}

/// How many seeds the point needs now.
fn runs_of(point: &Arc<Point>, id: PointId, until: Until, block: &Block, evidence: &Evidence) -> u64 {
    let first = block.seeds.start;
    let mut runs = block.seeds.end - first;
    loop {
        let seeds = first..first + runs;
        let ended = |seed| evidence.ended(&Job { point: point.clone(), point_id: id, seed });
        if runs >= until.max_runs || !seeds.clone().all(ended) {
            return runs;
        }
        if evidence.relative_error(id, until, &seeds).is_some_and(|error| error <= until.relative_error) {
            return runs;
        }
        runs = (2 * runs).min(until.max_runs);
    }
}

/// The block, divided by the number of seeds that its points need.
fn by_runs(block: &Block, runs: impl Fn(&Arc<Point>, PointId) -> u64) -> Vec<Block> {
    let mut parts: BTreeMap<u64, Block> = BTreeMap::new();
    for (point, &id) in block.points.iter().zip(&block.point_ids) {
        let runs = runs(point, id);
        let part = parts.entry(runs).or_insert_with(|| Block {
            points: Vec::new(),
            point_ids: Vec::new(),
            seeds: block.seeds.start..block.seeds.start + runs,
            ..block.clone()
        });
        part.points.push(point.clone());
        part.point_ids.push(id);
    }
    parts.into_values().collect()
}

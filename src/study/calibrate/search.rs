//! The search for Gamma and b0: a coarse grid shared by all trials, then Nelder-Mead from its best points.
//!
//! Delta_v is slightly noisy, and it jumps where droplets begin to stay stuck, so the search uses no derivatives. Its
//! coordinates are `(ln Gamma, sqrt b0)`, which keeps Gamma positive and mirrors the search at b0 = 0.

use crate::study::calibrate::profile::{Laboratory, Parameters, Profile};
use crate::study::calibrate::{deviation::Deviation, frames::Trial};
use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;
use rayon::prelude::*;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Largest ratio of Gamma between two rows of the grid.
const ROW_RATIO: f64 = 2.0;

/// Number of values of b0 in a row.
const COLUMNS: usize = 3;

/// Number of grid points from which the search goes on, for each trial.
const STARTS: usize = 2;

/// Size of the first simplex, in steps of the grid.
const SIMPLEX: f64 = 0.5;

/// The search ends when the costs at the corners of the simplex differ by less than this share of the first cost.
const TOLERANCE: f64 = 2e-3;

/// Largest number of steps of a search.
const MOST_STEPS: u64 = 40;

/// Cost of parameters out of range, and of those whose simulation failed.
const NOWHERE: f64 = 1e9;

/// Ranges of the search. The droplets of [C24] have Gamma from 0.16 to 1.7 and b0 from 0.064 to 0.21.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ranges {
    /// Range of Gamma, above 0.
    pub gamma: RangeInclusive<f64>,
    /// Range of b0, from 0 upwards.
    pub b0: RangeInclusive<f64>,
}

fn coordinates(parameters: Parameters) -> [f64; 2] {
    [libm::log(parameters.gamma), parameters.b0.sqrt()]
}

fn parameters([x, y]: [f64; 2]) -> Parameters {
    Parameters { gamma: libm::exp(x), b0: y * y }
}

/// A point of the grid and its profile, if its simulation did not fail.
pub(super) struct Node {
    at: [f64; 2],
    profile: Option<Arc<Profile>>,
}

/// A grid over the ranges, simulated.
pub(super) struct SearchGrid {
    step: [f64; 2],
    nodes: Vec<Node>,
}

impl SearchGrid {
    /// Simulates the grid row by row, the softest droplets first; the droplets of a row in parallel.
    ///
    /// Drag does not change where a droplet can rest. If the droplet with the least drag in a row rests before the last
    /// frames of all trials, stiffer droplets would too, so their rows are left out.
    pub(super) fn simulate(ranges: &Ranges, laboratory: &Laboratory<'_>, trials: &[Trial]) -> Self {
        let corner = |gamma: f64, b0: f64| coordinates(Parameters { gamma, b0 });
        let low = corner(*ranges.gamma.start(), *ranges.b0.start());
        let high = corner(*ranges.gamma.end(), *ranges.b0.end());
        let rows = ((high[0] - low[0]) / libm::log(ROW_RATIO) - 1e-9).ceil().max(1.0) as usize + 1;
        let step = [(high[0] - low[0]) / (rows - 1) as f64, (high[1] - low[1]) / (COLUMNS - 1) as f64];
        let mut nodes = Vec::new();
        for row in 0..rows {
            let at = |column: usize| [low[0] + row as f64 * step[0], low[1] + column as f64 * step[1]];
            let node = |at| Node { at, profile: laboratory.profile(parameters(at)).ok() };
            let found: Vec<Node> = (0..COLUMNS).into_par_iter().map(|column| node(at(column))).collect();
            let behind =
                |profile: &Arc<Profile>| trials.iter().all(|trial| Deviation::between(profile, trial).missed > 0.0);
            let stuck = found[0].profile.as_ref().is_some_and(behind);
            nodes.extend(found);
            if stuck {
                break;
            }
        }
        Self { step, nodes }
    }

    /// The best points for a trial, with their costs.
    fn best(&self, trial: &Trial) -> Vec<([f64; 2], f64)> {
        let cost = |node: &Node| Some((node.at, Deviation::between(node.profile.as_deref()?, trial).cost()));
        let mut points: Vec<_> = self.nodes.iter().filter_map(cost).collect();
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        points.truncate(STARTS);
        points
    }
}

struct Objective<'a> {
    laboratory: &'a Laboratory<'a>,
    trial: &'a Trial,
    ranges: &'a Ranges,
}

impl CostFunction for Objective<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, at: &Vec<f64>) -> Result<f64, Error> {
        let parameters = parameters([at[0], at[1]]);
        let beyond =
            |value: f64, range: &RangeInclusive<f64>| (range.start() - value).max(value - range.end()).max(0.0);
        let outside = beyond(parameters.gamma, &self.ranges.gamma) + beyond(parameters.b0, &self.ranges.b0);
        if outside > 0.0 {
            return Ok(NOWHERE * (1.0 + outside));
        }
        let profile = self.laboratory.profile(parameters);
        Ok(profile.map_or(NOWHERE, |profile| Deviation::between(&profile, self.trial).cost()))
    }
}

/// The parameters of least cost for a trial; `None` if no droplet of the grid could be simulated.
///
/// # Errors
/// Those of the optimiser.
pub(super) fn minimise(
    grid: &SearchGrid,
    laboratory: &Laboratory<'_>,
    trial: &Trial,
    ranges: &Ranges,
) -> Result<Option<Parameters>, Error> {
    let starts = grid.best(trial);
    let ends: Vec<_> = starts
        .into_par_iter()
        .map(|(at, cost)| descend(Objective { laboratory, trial, ranges }, at, cost, grid.step))
        .collect::<Result<_, _>>()?;
    let best = ends.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.map(|(at, _)| parameters(at)))
}

/// Nelder-Mead from one point. The first simplex extends towards softer droplets, because stiffer ones may not pass.
fn descend(objective: Objective<'_>, at: [f64; 2], cost: f64, step: [f64; 2]) -> Result<([f64; 2], f64), Error> {
    let [x, y] = at;
    // At the edge of the range the simplex must extend inwards.
    let inwards = if y - SIMPLEX * step[1] >= 0.0 { -1.0 } else { 1.0 };
    let softer = if libm::exp(x - SIMPLEX * step[0]) >= *objective.ranges.gamma.start() { -1.0 } else { 1.0 };
    let simplex = vec![vec![x, y], vec![x + softer * SIMPLEX * step[0], y], vec![x, y + inwards * SIMPLEX * step[1]]];
    let solver = NelderMead::new(simplex).with_sd_tolerance(TOLERANCE * cost)?;
    let ended = Executor::new(objective, solver).configure(|state| state.max_iters(MOST_STEPS)).timer(false).run()?;
    let state = ended.state();
    let best = state.get_best_param().map_or(at, |best| [best[0], best[1]]);
    Ok((best, state.get_best_cost()))
}

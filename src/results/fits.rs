//! What the studies read of finished runs, and the rows that they make of them, one for each grid point. The store
//! provides the runs and keeps the rows.

use crate::parameters::{Point, PointId};
use crate::results::trajectory::{Mechanism, Outcome, Samples};

/// The finished runs of one grid point.
#[derive(Clone, Debug)]
pub struct PointRuns {
    /// Identity of the point.
    pub point_id: PointId,
    /// Its parameters.
    pub point: Point,
    /// Its finished runs, by seed.
    pub runs: Vec<FinishedRun>,
}

impl PointRuns {
    /// How many of its runs are of this kind.
    pub(crate) fn count(&self, kind: impl Fn(&FinishedRun) -> bool) -> u32 {
        self.runs.iter().filter(|run| kind(run)).count() as u32
    }
}

/// The part of one finished run that fits need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinishedRun {
    /// Seed of the run.
    pub seed: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Displacement at the end, in sigma.
    pub r_end: f64,
    /// Time at the end, in t0.
    pub t_end: f64,
    /// Mean speed after the start-up, in V_t.
    pub v_g_mean: Option<f64>,
    /// How the clog holds, if the run ended in one.
    pub mechanism: Option<Mechanism>,
    /// Displacement of the equilibrium in which it was arrested at its time limit, in sigma; `None` if it was not.
    pub arrested: Option<f64>,
}

impl FinishedRun {
    /// Where the droplet stays for good, in sigma: the place of its clog or of its arrest; `None` if it flowed on.
    pub fn stays_at(&self) -> Option<f64> {
        if self.outcome == Outcome::Clogged { Some(self.r_end) } else { self.arrested }
    }

    /// The mean speed of a droplet that flowed on until a limit ended its run or it left the scene, in V_t; `None` if it
    /// did not, or if its run was too short to have a speed.
    pub fn flowing_speed(&self) -> Option<f64> {
        let flowed = matches!(self.outcome, Outcome::TimeLimit | Outcome::Distance | Outcome::Exited);
        self.v_g_mean.filter(|_| flowed && self.arrested.is_none())
    }

    /// Whether time ran out on the droplet while it was not at rest.
    pub fn is_cut_by_time(&self) -> bool {
        self.outcome == Outcome::TimeLimit && self.arrested.is_none()
    }
}

/// Decay length of the survival probability `P(r) = exp(-r/lambda)` at one grid point ([C24] eq. 16).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LambdaFit {
    /// Finished runs that got beyond `r_from`.
    pub runs: u32,
    /// Runs that clogged, or were arrested at their time limit; every other run is censored at its displacement.
    pub clogs: u32,
    /// Runs that went the whole distance.
    pub by_distance: u32,
    /// Runs on which time ran out while they were not at rest.
    pub by_time: u32,
    /// Runs that went further than the side of the periodic box, where they count as cut off.
    pub beyond_box: u32,
    /// The displacement from which on runs count, in sigma.
    pub r_from: f64,
    /// Those of the clogs that were arrested at their time limit, above the threshold of a clog.
    pub arrested: u32,
    /// Maximum-likelihood lambda = (sum of all r)/clogs, in sigma; `None` when nothing clogged.
    pub lambda: Option<f64>,
    /// Lower end of the 95% interval, or the one-sided 95% lower bound when nothing clogged.
    pub lambda_low: Option<f64>,
    /// Upper end of the 95% profile-likelihood interval; `None` when nothing clogged (unbounded).
    pub lambda_high: Option<f64>,
    /// Lambda if every droplet on which time ran out had clogged there, in sigma; `None` if there is none. The truth lies
    /// between this and `lambda`, but for chance, if such droplets clog at least as easily as the others.
    pub lambda_if_stuck: Option<f64>,
    /// The paper's estimate: least squares of the Kaplan-Meier P(r) on exp(-r/lambda).
    pub lambda_least_squares: Option<f64>,
    /// Probability that clogs are spread as unevenly as these, or more so, if survival is exponential.
    pub p_exponential: Option<f64>,
    /// Shape k of Weibull's distribution, which is 1 where survival is exponential.
    pub weibull_shape: Option<f64>,
    /// Lower end of its 95% interval.
    pub weibull_low: Option<f64>,
    /// Upper end of its 95% interval.
    pub weibull_high: Option<f64>,
    /// Total number of runs that would narrow the interval to +-10%, at the present share of clogs.
    pub runs_for_ten_percent: Option<u32>,
}

/// Mean speed of the runs that neither clogged nor were arrested at one grid point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedAverage {
    /// Finished runs.
    pub runs: u32,
    /// Runs that ended without a clog or an arrest and are averaged.
    pub flowing: u32,
    /// Runs that went the whole distance.
    pub by_distance: u32,
    /// Runs on which time ran out while they were not at rest.
    pub by_time: u32,
    /// Runs on which time ran out at rest.
    pub arrested: u32,
    /// <v_g>/V_t; `None` when nothing flowed.
    pub v_g: Option<f64>,
    /// Lower end of the 95% bootstrap interval.
    pub v_g_low: Option<f64>,
    /// Upper end of the 95% bootstrap interval.
    pub v_g_high: Option<f64>,
    /// Capillary number `Ca = (v_g/V_t) pi/(4 Gamma)` ([C24] eq. 17); `None` for SP.
    pub ca: Option<f64>,
}

/// The stored result of one job: a summary of the run or the reason of its failure, and its time series.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunRecord {
    /// Seed of the run.
    pub seed: u64,
    /// How it ended; `None` if it failed.
    pub outcome: Option<Outcome>,
    /// Why it failed, if it did.
    pub error: Option<String>,
    /// Displacement at the end, in sigma.
    pub r_end: f64,
    /// Time at the end, in t0.
    pub t_end: f64,
    /// Mean speed after the start-up, in V_t.
    pub v_g_mean: Option<f64>,
    /// Displacement of the equilibrium in which it was arrested at its time limit, in sigma.
    pub arrested: Option<f64>,
    /// E_k/E_t at the end.
    pub ek_ratio_end: f64,
    /// How deep the droplet sank on the plate, in sigma.
    pub delta_s: Option<f64>,
    /// Seconds that the run took on one thread.
    pub wall_s: f64,
    /// Its time series; empty unless the reader asked for them.
    pub samples: Samples,
}

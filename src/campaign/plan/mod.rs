//! What a campaign still has to do. A plan is a pure function of the campaign, the jobs in a store, and a measured
//! speed.
//!
//! Jobs are identified by content. So a job that two blocks name is planned once, and a job that an earlier, smaller
//! campaign finished is not planned again. Read [`plan`] first.

mod cost;
mod effects;
mod expectation;
mod integrators;
mod repeats;
mod rounds;
mod switches;
mod text;
mod time;
mod tolerance;

#[cfg(test)]
mod tests;

pub use cost::{Cost, Speed};
pub use effects::Effect;
pub use repeats::Repeats;
pub use rounds::Rounds;
pub use switches::Switch;
pub use text::Ends;
pub use time::ShortTime;

use crate::campaign::file::{Block, Campaign};
use crate::campaign::memory::run_bytes;
use crate::campaign::parallel::in_parallel;
use crate::parameters::{Job, JobId, JobState, Point, Value, list};
use crate::physics::simulate::stability::StabilityLimit;
use rayon::prelude::*;

/// Jobs that a store knows, sorted by id, each once.
#[derive(Clone, Debug, Default)]
pub struct KnownJobs(Vec<(JobId, JobState)>);

impl KnownJobs {
    /// Takes the jobs of a store, in any order.
    pub fn new(mut jobs: Vec<(JobId, JobState)>) -> Self {
        if !jobs.is_sorted_by(|a, b| a.0 < b.0) {
            jobs.sort_by_key(|job| job.0);
            jobs.dedup_by_key(|job| job.0);
        }
        Self(jobs)
    }
}

/// What a campaign still has to do.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Name of the campaign.
    pub campaign: String,
    /// Its blocks.
    pub blocks: Vec<BlockPlan>,
    /// The jobs to run: the longest first, and equally long ones by seed, so that jobs in the same array come together.
    pub jobs: Vec<PlannedJob>,
}

/// A job to run.
#[derive(Clone, Debug)]
pub struct PlannedJob {
    /// The job.
    pub job: Job,
    /// Its identity.
    pub id: JobId,
    /// Expected CPU time, in seconds.
    pub expected_s: f64,
}

/// How many jobs of a block are in which state. A job that two blocks name is counted in the first of them only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Not in the store.
    pub new: u64,
    /// In the store, not yet computed.
    pub pending: u64,
    /// Taken by a worker, and not planned again. A store takes jobs back from dead workers before it reports states.
    pub running: u64,
    /// Finished.
    pub done: u64,
    /// Failed, and not planned again. To try them again, a store sets them back to pending first.
    pub failed: u64,
    /// Named by an earlier block too.
    pub shared: u64,
}

/// Points of a block that take the same integrator for the same reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The integrator.
    pub integrator: &'static str,
    /// How many points take it.
    pub points: usize,
    /// Why, in a few words.
    pub why: String,
}

/// The plan of one block.
#[derive(Clone, Debug)]
pub struct BlockPlan {
    /// Its name.
    pub name: String,
    /// `DP` or `SP`.
    pub model: &'static str,
    /// The scene.
    pub scene: &'static str,
    /// Number of grid points.
    pub points: usize,
    /// Runs of each point.
    pub runs: u64,
    /// How many of its jobs are in which state.
    pub counts: Counts,
    /// Smallest and largest time step, in t0.
    pub dt: Ends,
    /// Smallest and largest stability limit of Verlet, in t0.
    pub dt_limit: Ends,
    /// The stiffest force term at the point with the smallest limit.
    pub stiffest: &'static str,
    /// Which integrator takes which points, and why.
    pub integrators: Vec<Chosen>,
    /// What acts on the droplet, what does not, and why.
    pub effects: Vec<Effect>,
    /// Smallest and largest of each limit and measure that ends a run or that runs are made in; `None` where the file
    /// says "none" at all points.
    pub ends: Vec<(&'static str, Option<Ends>)>,
    /// The points whose time limit leaves a droplet no time to come to rest.
    pub short_time: Option<ShortTime>,
    /// Where droplets may go round the periodic box, if anywhere.
    pub repeats: Option<Repeats>,
    /// Where on the grid the campaign chooses otherwise.
    pub switches: Vec<Switch>,
    /// The rounds of `until`.
    pub rounds: Option<Rounds>,
    /// The most memory that a run of it takes, in bytes.
    pub memory: f64,
    /// The expected cost of its jobs to run.
    pub cost: Cost,
}

#[derive(Clone, Copy)]
struct Candidate {
    id: JobId,
    /// Rank of its point by expected cost, the highest first.
    rank: u32,
    /// Index of its point among the points of all blocks.
    place: u32,
    seed: u64,
}

/// Plans a campaign, given the jobs that a store knows.
///
/// ```
/// use meniscus::campaign::file::Campaign;
/// use meniscus::campaign::plan::{KnownJobs, Speed, plan};
///
/// let text = "name = 'c'\nmodel = 'SP'\nscene = 'plate'\nruns_per_point = 2\ngrid.e_w = [1.0, 2.0, 3.0]";
/// let campaign = Campaign::parse("c.toml", text).unwrap();
/// let plan = plan(&campaign, &KnownJobs::default(), &Speed::default());
/// assert_eq!((plan.jobs.len(), plan.blocks[0].counts.new), (6, 6));
/// ```
pub fn plan(campaign: &Campaign, known: &KnownJobs, speed: &Speed) -> Plan {
    in_parallel(|| arranged(campaign, known, speed))
}

fn arranged(campaign: &Campaign, known: &KnownJobs, speed: &Speed) -> Plan {
    let blocks = &campaign.blocks;
    let places: Vec<(usize, usize)> =
        blocks.iter().enumerate().flat_map(|(b, block)| (0..block.points.len()).map(move |p| (b, p))).collect();
    let block_of = |candidate: &Candidate| places[candidate.place as usize].0;
    let expected: Vec<f64> = places.par_iter().map(|&(b, p)| speed.expected_s(&blocks[b].points[p])).collect();

    let mut counts = vec![Counts::default(); blocks.len()];
    let mut candidates = candidates(blocks, &places, &ranks(&expected));
    candidates.dedup_by(|later, first| {
        let same = later.id == first.id;
        counts[block_of(later)].shared += u64::from(same);
        same
    });
    let mut states = known.0.iter().peekable();
    candidates.retain(|candidate| {
        while states.next_if(|(id, _)| *id < candidate.id).is_some() {}
        let state = states.next_if(|(id, _)| *id == candidate.id).map(|(_, state)| *state);
        tally(&mut counts[block_of(candidate)], state)
    });

    let mut costs: Vec<Cost> = blocks.iter().map(Cost::none_of).collect();
    for candidate in &candidates {
        costs[block_of(candidate)].add(expected[candidate.place as usize]);
    }
    candidates.par_sort_unstable_by_key(|candidate| (candidate.rank, candidate.seed, candidate.place));
    let planned = |&Candidate { id, place, seed, .. }: &Candidate| {
        let (b, p) = places[place as usize];
        let job = Job { point: blocks[b].points[p].clone(), point_id: blocks[b].point_ids[p], seed };
        PlannedJob { job, id, expected_s: expected[place as usize] }
    };
    let jobs = candidates.par_iter().map(planned).collect();
    let blocks =
        blocks.iter().zip(counts).zip(costs).filter_map(|((block, counts), cost)| describe(block, counts, cost, speed));
    Plan { campaign: campaign.name.clone(), blocks: blocks.collect(), jobs }
}

/// All jobs of all blocks, sorted by id; of equal ids that of the earlier block comes first.
fn candidates(blocks: &[Block], places: &[(usize, usize)], ranks: &[u32]) -> Vec<Candidate> {
    let of_point = |(place, &(b, p)): (usize, &(usize, usize))| {
        let (block, rank, place) = (&blocks[b], ranks[place], place as u32);
        let id = move |seed| JobId::new(block.point_ids[p], seed);
        block.seeds.clone().map(move |seed| Candidate { id: id(seed), rank, place, seed })
    };
    let mut candidates: Vec<Candidate> = places.par_iter().enumerate().flat_map_iter(of_point).collect();
    candidates.par_sort_unstable_by_key(|candidate| (candidate.id, candidate.place));
    candidates
}

/// The rank of each cost, the highest first; equal costs share a rank.
fn ranks(costs: &[f64]) -> Vec<u32> {
    let mut order: Vec<usize> = (0..costs.len()).collect();
    order.par_sort_by(|a, b| costs[*b].total_cmp(&costs[*a]));
    let mut ranks = vec![0; costs.len()];
    for pair in order.windows(2) {
        ranks[pair[1]] = ranks[pair[0]] + u32::from(costs[pair[1]] < costs[pair[0]]);
    }
    ranks
}

fn tally(counts: &mut Counts, state: Option<JobState>) -> bool {
    let (count, run) = match state {
        None => (&mut counts.new, true),
        Some(JobState::Pending) => (&mut counts.pending, true),
        Some(JobState::Running) => (&mut counts.running, false),
        Some(JobState::Done) => (&mut counts.done, false),
        Some(JobState::Failed) => (&mut counts.failed, false),
    };
    *count += 1;
    run
}

/// The plan of a block; `None` if it has no points, which a valid campaign rules out.
fn describe(block: &Block, counts: Counts, cost: Cost, speed: &Speed) -> Option<BlockPlan> {
    let first: &Point = block.points.first()?;
    let limits: Vec<StabilityLimit> = block.points.par_iter().map(|point| StabilityLimit::of(point)).collect();
    let tightest = limits.iter().min_by(|a, b| a.dt_max.total_cmp(&b.dt_max))?;
    Some(BlockPlan {
        name: block.name.clone(),
        model: first.model.name(),
        scene: first.scene.name(),
        points: block.points.len(),
        runs: block.seeds.end - block.seeds.start,
        counts,
        dt: Ends::of(block.points.iter().map(|point| point.stepping.dt)),
        dt_limit: Ends::of(limits.iter().map(|limit| limit.dt_max)),
        stiffest: tightest.terms.first()?.term,
        integrators: match block.tolerance {
            Some(tolerance) => tolerance::of(&block.points, tolerance),
            None => integrators::of(block, &limits),
        },
        effects: effects::of(&block.points),
        ends: ENDS.iter().filter_map(|name| Some((*name, ends_of(block, name)?))).collect(),
        short_time: time::short(&block.points),
        repeats: repeats::repeats(&block.points),
        switches: switches::of(block),
        rounds: Rounds::of(block, speed),
        memory: block.points.iter().map(|point| run_bytes(point)).fold(0.0, f64::max),
        cost,
    })
}

/// What ends runs, and the box that they are in, in the order in which a plan names them.
const ENDS: [&str; 5] = ["t_max", "distance", "h_end", "ek_threshold", "box_size"];

/// The smallest and the largest value of a parameter in a block: `None` inside where it is "none" at some points, and
/// `None` where it means nothing.
fn ends_of(block: &Block, name: &str) -> Option<Option<Ends>> {
    let values: Vec<Value> = block.points.iter().filter_map(|point| list::value(point, name)).collect();
    let numbers: Vec<f64> = values.iter().filter_map(|value| value.number()).collect();
    let all_numbers = numbers.len() == values.len();
    (!values.is_empty()).then(|| all_numbers.then(|| Ends::of(numbers.into_iter())))
}

//! One job of a campaign given as text, run alone.

use meniscus::campaign::file::Campaign;
use meniscus::parameters::{Integrator, Job};
use meniscus::physics::simd::best_instruction_set;
use meniscus::physics::simulate::{Context, simulate};
use meniscus::physics::walls::arrays::library::ArrayLibrary;
use meniscus::results::trajectory::{Failure, Trajectory};
use std::sync::atomic::AtomicBool;

/// The first job of a campaign of these keys (a DP, the ring of the paper, unless they say otherwise), and the integrator it has.
pub fn job(keys: &str, seed: u64) -> (Job, Integrator) {
    let model = if keys.contains("model = ") { "" } else { "model = \"DP\"\n" };
    let is_ring = !model.is_empty() && !keys.contains("dynamics = ");
    let dynamics = if is_ring { "dynamics = \"vertex\"\n" } else { "" };
    let text = format!("name = \"one\"\n{model}{dynamics}runs_per_point = 1\n{keys}");
    let campaign = Campaign::parse("one.toml", &text).unwrap_or_else(|errors| panic!("{}", errors.render(false)));
    let block = &campaign.blocks[0];
    let point = block.points[0].clone();
    let integrator = point.stepping.integrator;
    (Job { point, point_id: block.point_ids[0], seed }, integrator)
}

/// Its trajectory.
#[allow(dead_code, reason = "not every program that includes this runs whole jobs")]
pub fn run(keys: &str, seed: u64) -> Result<Trajectory, Failure> {
    let context = Context {
        arrays: &ArrayLibrary::default(),
        instruction_set: best_instruction_set(),
        stop: &AtomicBool::new(false),
    };
    simulate(&job(keys, seed).0, context).map(|trajectory| trajectory.expect("nobody stops it"))
}

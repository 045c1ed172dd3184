//! `meniscus replay DUMP`: runs the job of a dump again, and says whether it fails as it did.

use crate::cli::talk::print;
use crate::cli::{CommandResult, Exit};
use crate::execute::replay::Dump;
use crate::physics::simd;
use std::path::PathBuf;

/// Arguments of `replay`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The dump that a failed job left: the column dump of the view `failures`, within the store's folder
    dump: PathBuf,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let dump = Dump::read(&self.dump)?;
        let (point, seed) = (&dump.job.point, dump.job.seed);
        let (model, scene) = (point.model.name(), point.scene.name());
        print(format!("job {}: {model}, {scene}, seed {seed}, from step {} on\n", dump.id, dump.first_step()))?;
        let now = dump.run(simd::best_instruction_set())?;
        match (now, dump.failure()) {
            (Err(now), Some(recorded)) if now == *recorded => {
                print(format!("failed as recorded: {now}\n"))?;
                Ok(Exit::Done)
            }
            (now, recorded) => {
                let now = now.map_or_else(|failure| failure.to_string(), |outcome| outcome.name().to_owned());
                print(format!("ended otherwise: {now}\n"))?;
                match recorded {
                    Some(recorded) => Err(format!("it failed with {recorded} when the dump was written").into()),
                    None => Ok(Exit::Done),
                }
            }
        }
    }
}

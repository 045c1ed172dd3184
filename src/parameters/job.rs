//! One run of a grid point, and where it stands in a store.

use crate::parameters::{JobId, Point, PointId};
use std::sync::Arc;

/// One trajectory to compute: a grid point and a seed.
#[derive(Clone, Debug)]
pub struct Job {
    /// The grid point, shared by all its runs.
    pub point: Arc<Point>,
    /// Identity of the point.
    pub point_id: PointId,
    /// Seed of every random choice of this run.
    pub seed: u64,
}

/// Where a job stands in a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JobState {
    /// Known, waiting to run.
    Pending,
    /// Taken by a worker.
    Running,
    /// Finished, with a trajectory.
    Done,
    /// Ended in a failure that is kept with its class and reason.
    Failed,
}

impl Job {
    /// Identity of this job, under the current [`PHYSICS_VERSION`].
    pub fn id(&self) -> JobId {
        JobId::new(self.point_id, self.seed)
    }
}

impl JobState {
    /// The name used in the column `state`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pending => "pending",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
        }
    }

    /// The state of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Pending, Self::Running, Self::Done, Self::Failed].into_iter().find(|state| state.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_reads_back_from_its_name() {
        for name in ["pending", "running", "done", "failed"] {
            assert_eq!(JobState::from_name(name).map(JobState::name), Some(name));
        }
        assert_eq!(JobState::from_name("lost"), None);
    }
}

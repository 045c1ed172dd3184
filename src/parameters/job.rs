//! One trajectory to compute, and where it stands in a store.

use crate::parameters::{JobId, Point, PointId, names};
use std::sync::Arc;

/// One trajectory to compute: a grid point and a seed.
#[derive(Clone, Debug)]
pub struct Job {
    /// The grid point, which its jobs share.
    pub point: Arc<Point>,
    /// Identity of the point.
    pub point_id: PointId,
    /// Seed of all random numbers of the trajectory.
    pub seed: u64,
}

/// Where a job stands in a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JobState {
    /// Not yet computed.
    Pending,
    /// Taken by a worker.
    Running,
    /// Finished, with a trajectory.
    Done,
    /// Ended in a failure that is kept with its class and reason.
    Failed,
}

impl Job {
    /// Identity of the course that its droplet takes, whatever time limit and distance cut it off, under the current
    /// physics version.
    pub(crate) fn course(&self) -> JobId {
        JobId::new(self.point.course(), self.seed)
    }

    /// Identity of this job, under the current physics version.
    pub fn id(&self) -> JobId {
        JobId::new(self.point_id, self.seed)
    }
}

names!(pub JobState { Pending = "pending", Running = "running", Done = "done", Failed = "failed" });

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

//! What a round decides, as pure functions of what happened and of the time: when to stop, and how long the rest will
//! take. The executor acts on it.

use crate::campaign::plan::PlannedJob;
use crate::parameters::Point;
use crate::results::trajectory::{FailureClass, Outcome};
use crate::store::PointWork;
use std::collections::BTreeMap;
use std::time::Duration;

/// Most jobs fail in the same way once this many have, and more than this share of all that ended.
const BREAKER_FAILURES: u64 = 20;
const BREAKER_SHARE: f64 = 0.5;

/// Why a run ends before all jobs are done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// Somebody asked for it, such as by Ctrl-C or SIGTERM.
    Interrupted,
    /// The deadline came.
    Deadline,
    /// Most jobs fail in the same way; going on would waste the night.
    Breaker {
        /// The class of their failure.
        class: FailureClass,
        /// How many failed so.
        failures: u64,
    },
    /// The store no longer takes outcomes.
    WriterStopped,
}

/// Jobs that were under way when a run was told to stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Paused {
    /// Those that go on where they were.
    pub saved: u64,
    /// Those that had not begun to move or could not be saved: they go on from their last checkpoint or begin anew.
    pub unsaved: u64,
}

/// How a job ended, and what it was expected to cost.
#[derive(Clone, Copy, Debug)]
pub(super) struct JobEnd {
    /// Its outcome, or the class of its failure.
    pub(super) how: Result<Outcome, FailureClass>,
    /// Expected CPU time, in seconds.
    pub(super) expected_s: f64,
    /// Whether its time ran out while it crept, at no equilibrium.
    pub(super) creeps: bool,
}

/// Where a round stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Jobs to run.
    pub jobs: u64,
    /// Those that ended.
    pub ended: u64,
    /// Those that ended in a clog.
    pub clogs: u64,
    /// Those that crept when their time ran out, slower than V_t/100 and at no equilibrium.
    pub creeping: u64,
    /// Failures by class.
    pub failures: BTreeMap<FailureClass, u64>,
    /// Expected CPU time of all jobs, in seconds.
    pub expected_s: f64,
    /// Expected CPU time of those that ended, in seconds.
    pub expected_ended_s: f64,
}

impl Progress {
    /// None of these jobs has ended.
    pub(super) fn of(jobs: &[PlannedJob]) -> Self {
        let expected_s = jobs.iter().map(|job| job.expected_s).sum();
        Self { jobs: jobs.len() as u64, expected_s, ..Self::default() }
    }

    /// Where the run of another process stands by what its store says; clogs and failures are not counted.
    pub fn seen(points: &[PointWork], expected_s: impl Fn(&Point) -> f64) -> Self {
        let mut progress = Self::default();
        for PointWork { point, left, ended } in points {
            let each_s = expected_s(point);
            progress.jobs += left + ended;
            progress.ended += ended;
            progress.expected_s += (left + ended) as f64 * each_s;
            progress.expected_ended_s += *ended as f64 * each_s;
        }
        progress
    }

    /// Takes note of a job's end.
    pub(super) fn note(&mut self, end: JobEnd) {
        self.ended += 1;
        self.expected_ended_s += end.expected_s;
        self.creeping += u64::from(end.creeps);
        match end.how {
            Ok(outcome) => self.clogs += u64::from(outcome == Outcome::Clogged),
            Err(class) => *self.failures.entry(class).or_default() += 1,
        }
    }

    /// All failures.
    pub fn failed(&self) -> u64 {
        self.failures.values().sum()
    }

    /// Why the run should stop now, if it should.
    pub(super) fn stop(&self, deadline_came: bool, interrupted: bool) -> Option<StopReason> {
        if interrupted {
            return Some(StopReason::Interrupted);
        }
        if deadline_came {
            return Some(StopReason::Deadline);
        }
        let tripped = |&(_, &failures): &(&FailureClass, &u64)| {
            failures >= BREAKER_FAILURES && failures as f64 > BREAKER_SHARE * self.ended as f64
        };
        self.failures.iter().find(tripped).map(|(&class, &failures)| StopReason::Breaker { class, failures })
    }

    /// Jobs ended per second.
    pub fn rate(&self, elapsed: Duration) -> f64 {
        self.ended as f64 / elapsed.as_secs_f64().max(1e-9)
    }

    /// Time left, if the rest takes as long compared with what was expected as the jobs so far; `None` before the
    /// first has ended.
    pub fn time_left(&self, elapsed: Duration) -> Option<Duration> {
        let left = self.expected_s - self.expected_ended_s;
        let seconds = elapsed.as_secs_f64() * left / self.expected_ended_s;
        (self.expected_ended_s > 0.0).then(|| Duration::try_from_secs_f64(seconds.max(0.0)).unwrap_or(Duration::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOG: JobEnd = JobEnd { how: Ok(Outcome::Clogged), expected_s: 2.0, creeps: false };
    const BLOWN: JobEnd = JobEnd { how: Err(FailureClass::Unstable), expected_s: 2.0, creeps: false };

    fn after(ends: &[(JobEnd, u64)]) -> Progress {
        let mut progress = Progress { jobs: 1000, expected_s: 2000.0, ..Progress::default() };
        for &(end, times) in ends {
            (0..times).for_each(|_| progress.note(end));
        }
        progress
    }

    #[test]
    fn a_few_failures_do_not_stop_a_campaign_but_the_same_on_most_jobs_does() {
        assert_eq!(after(&[(BLOWN, 19)]).stop(false, false), None);
        assert_eq!(after(&[(CLOG, 30), (BLOWN, 25)]).stop(false, false), None);
        let tripped = after(&[(CLOG, 10), (BLOWN, 25)]).stop(false, false);
        assert_eq!(tripped, Some(StopReason::Breaker { class: FailureClass::Unstable, failures: 25 }));
    }

    #[test]
    fn the_deadline_and_a_signal_stop_a_campaign() {
        let progress = after(&[(CLOG, 1)]);
        assert_eq!(progress.stop(false, false), None);
        assert_eq!(progress.stop(true, false), Some(StopReason::Deadline));
        assert_eq!(progress.stop(false, true), Some(StopReason::Interrupted));
    }

    #[test]
    fn the_time_left_follows_the_expected_cost_of_the_rest() {
        let progress = after(&[(CLOG, 250)]);
        assert_eq!(progress.time_left(Duration::from_secs(100)), Some(Duration::from_secs(300)));
        assert_eq!(after(&[]).time_left(Duration::from_secs(100)), None);
    }
}

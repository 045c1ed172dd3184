//! The time at which a run has to end, by whichever clock was meant.
//!
//! "At half past seven" is meant by the clock on the wall, whatever becomes of it: it may be set, and the machine may
//! sleep. "In eight hours" is meant by time that passes: setting the clock changes nothing, and time asleep counts.

use std::time::{Duration, SystemTime};

/// When something has to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deadline {
    /// When so much time has passed since the machine was started; [`Deadline::after`] counts from now.
    Passed(Duration),
    /// When the clock shows this.
    Clock(SystemTime),
}

impl Deadline {
    /// So long from now; time in which the machine sleeps counts.
    pub fn after(time: Duration) -> Self {
        Self::Passed(Now::read().passed.saturating_add(time))
    }

    /// Whether it is time.
    pub fn has_come(self) -> bool {
        self.has_come_at(Now::read())
    }

    fn has_come_at(self, now: Now) -> bool {
        match self {
            Self::Passed(end) => now.passed >= end,
            Self::Clock(end) => now.clock >= end,
        }
    }
}

/// What the clocks show.
#[derive(Clone, Copy)]
struct Now {
    passed: Duration,
    clock: SystemTime,
}

impl Now {
    fn read() -> Self {
        Self { passed: passed(), clock: SystemTime::now() }
    }
}

/// Time since the machine was started, time asleep included.
#[cfg(target_os = "linux")]
fn passed() -> Duration {
    Duration::try_from(rustix::time::clock_gettime(rustix::time::ClockId::Boottime)).unwrap_or_default()
}

/// Time since the first call; elsewhere it is up to the system whether time asleep is counted.
#[cfg(not(target_os = "linux"))]
fn passed() -> Duration {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: Duration = Duration::from_secs(3600);

    #[test]
    fn a_time_of_the_clock_holds_when_the_clock_jumps_and_when_the_machine_sleeps() {
        let now = Now::read();
        let end = Deadline::Clock(now.clock + 8 * HOUR);
        assert!(!end.has_come_at(now));
        assert!(end.has_come_at(Now { clock: now.clock + 8 * HOUR, ..now }), "the clock was set forward");
        assert!(!end.has_come_at(Now { passed: now.passed + 9 * HOUR, clock: now.clock - HOUR }), "it was set back");
    }

    #[test]
    fn a_time_that_passes_does_not_heed_the_clock_and_counts_sleep() {
        let now = Now::read();
        let end = Deadline::after(8 * HOUR);
        assert!(!end.has_come_at(Now { clock: now.clock + 24 * HOUR, ..now }));
        assert!(end.has_come_at(Now { passed: now.passed + 9 * HOUR, clock: now.clock - HOUR }));
        assert!(!Deadline::after(Duration::MAX).has_come(), "as long as one likes");
        assert!(Deadline::after(Duration::ZERO).has_come());
    }
}

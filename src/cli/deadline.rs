//! When a run has to stop: after a time, or at a time of the day.

use crate::campaign::durations;
use chrono::{DateTime, Days, Local, NaiveDateTime, NaiveTime, TimeZone};
use std::time::{Duration, Instant};

/// What `--deadline` says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Deadline {
    /// So long after the start of the program.
    After(Duration),
    /// When the clock on the wall next shows this.
    At(NaiveTime),
}

impl Deadline {
    /// Reads `90s`, `45m`, `8h`, `2d`, or `07:30`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let clock = ["%H:%M", "%H:%M:%S"].iter().find_map(|format| NaiveTime::parse_from_str(text, format).ok());
        match clock {
            Some(time) => Ok(Self::At(time)),
            None => durations::parse(text).map(Self::After).map_err(|_| {
                format!("`{text}` is not a deadline: write a number and s, m, h or d, like 8h, or a time like 07:30")
            }),
        }
    }

    /// The deadline of a run that starts now; `None` if it is too far away to be expressed.
    pub(super) fn counted_from_now(self) -> Option<Instant> {
        Instant::now().checked_add(self.time_left(Local::now()))
    }

    /// How long it is from a time of the clock until then.
    fn time_left(self, now: DateTime<Local>) -> Duration {
        match self {
            Self::After(time) => time,
            Self::At(time) => {
                let next = next(now.naive_local(), time);
                // A time that the clock skips in spring is taken as if it did not.
                let left = Local
                    .from_local_datetime(&next)
                    .earliest()
                    .map_or_else(|| next - now.naive_local(), |next| next.signed_duration_since(now));
                left.to_std().unwrap_or_default()
            }
        }
    }
}

/// When the clock next shows `time`, later than now.
fn next(now: NaiveDateTime, time: NaiveTime) -> NaiveDateTime {
    let today = now.date().and_time(time);
    if today > now { today } else { today.checked_add_days(Days::new(1)).unwrap_or(today) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_are_times_that_pass_or_times_of_the_day() {
        let after = |seconds| Ok(Deadline::After(Duration::from_secs_f64(seconds)));
        assert_eq!(Deadline::parse("90s"), after(90.0));
        assert_eq!(Deadline::parse("1.5h"), after(5400.0));
        assert_eq!(Deadline::parse("2d"), after(172_800.0));
        let half_past = NaiveTime::from_hms_opt(7, 30, 0).unwrap();
        assert_eq!(Deadline::parse("07:30"), Ok(Deadline::At(half_past)));
        assert_eq!(Deadline::parse("7:30:00"), Ok(Deadline::At(half_past)));
        for wrong in ["", "soon", "8", "-1h", "25:00", "07:60", "h", "ä", "NaNs"] {
            assert!(Deadline::parse(wrong).unwrap_err().contains("07:30"), "{wrong}");
        }
    }

    #[test]
    fn a_time_of_the_day_is_the_next_one() {
        let half_past = NaiveTime::from_hms_opt(7, 30, 0).unwrap();
        let day = chrono::NaiveDate::from_ymd_opt(2027, 2, 28).unwrap();
        let at = |hour, minute| day.and_hms_opt(hour, minute, 0).unwrap();
        assert_eq!(next(at(7, 29), half_past), at(7, 30));
        assert_eq!(next(at(7, 30), half_past), at(7, 30) + Days::new(1));
        assert_eq!(next(at(22, 0), half_past), at(7, 30) + Days::new(1));
    }
}

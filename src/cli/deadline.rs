//! When a run has to stop: after a time, or at a time of the day.

use crate::campaign::durations;
use crate::execute;
use chrono::{DateTime, Days, Local, NaiveDateTime, NaiveTime, TimeZone};
use std::time::Duration;

/// From here on the seconds of a deadline do not matter to people.
const LONG: Duration = Duration::from_secs(600);

/// What `--deadline` says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Deadline {
    /// So long after the start of the program.
    After(Duration),
    /// When the clock on the wall next shows this.
    At(NaiveTime),
}

impl Deadline {
    /// Reads `90s`, `45m`, `8h`, `2d`, `1h30m`; the time of the day `07:30`, two numbers with a colon; and the times of
    /// Slurm that have two colons or a dash, `1:30:00`, `1-12`, `1-00:00:00`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        if let Ok(time) = NaiveTime::parse_from_str(text, "%H:%M") {
            return Ok(Self::At(time));
        }
        let time = durations::parse_slurm(text).map_or_else(|| durations::parse(text), Ok);
        time.map(Self::After).map_err(|_| {
            format!(
                "`{text}` is not a deadline: write a time that passes, like 8h, 1h30m, 1:30:00 or 1-00:00:00 (a day), \
                 or a time of the day, like 07:30"
            )
        })
    }

    /// The deadline of a run that starts now.
    pub(super) fn counted_from_now(self) -> execute::Deadline {
        match self {
            Self::After(time) => execute::Deadline::after(time),
            Self::At(time) => execute::Deadline::Clock(when(time, Local::now()).into()),
        }
    }

    /// When that is, in words: `stops at 07:30 tomorrow, in 9 h 12 min`.
    pub(super) fn told(self) -> String {
        self.told_at(Local::now())
    }

    fn told_at(self, now: DateTime<Local>) -> String {
        let (end, left) = match self {
            Self::After(time) => (chrono::Duration::from_std(time).ok().and_then(|t| now.checked_add_signed(t)), time),
            Self::At(time) => {
                let end = when(time, now);
                (Some(end), end.signed_duration_since(now).to_std().unwrap_or_default())
            }
        };
        let left_in_words = durations::written(left);
        let Some(end) = end else { return format!("stops in {left_in_words}") };
        let days = end.date_naive().signed_duration_since(now.date_naive()).num_days();
        let day = match days {
            0 => "today".to_owned(),
            1 => "tomorrow".to_owned(),
            _ => end.format("on %Y-%m-%d").to_string(),
        };
        let time = end.format(if left < LONG { "%H:%M:%S" } else { "%H:%M" });
        format!("stops at {time} {day}, in {left_in_words}")
    }
}

/// The moment at which the clock next shows `time`. A time that the clock skips in spring is taken as if it did not.
fn when(time: NaiveTime, now: DateTime<Local>) -> DateTime<Local> {
    let next = next(now.naive_local(), time);
    Local.from_local_datetime(&next).earliest().unwrap_or_else(|| now + (next - now.naive_local()))
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
        assert_eq!(Deadline::parse("7:30"), Ok(Deadline::At(half_past)));
        // Two colons or a dash: a time that passes, as Slurm has it.
        assert_eq!(Deadline::parse("7:30:00"), after(27_000.0));
        assert_eq!(Deadline::parse("1-00:00:00"), after(86_400.0));
        assert_eq!(Deadline::parse("1h30m"), after(5400.0));
        for wrong in ["", "soon", "8", "-1h", "25:00", "07:60", "h", "ä", "NaNs", "1-", "1:60:00"] {
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

    #[test]
    fn a_deadline_is_told_as_it_was_understood() {
        let now = Local.with_ymd_and_hms(2027, 2, 27, 22, 18, 0).unwrap();
        let told = |text: &str| Deadline::parse(text).unwrap().told_at(now);
        assert_eq!(told("07:30"), "stops at 07:30 tomorrow, in 9 h 12 min");
        assert_eq!(told("22:20"), "stops at 22:20:00 today, in 2 min 0 s");
        assert_eq!(told("1:30:00"), "stops at 23:48 today, in 1 h 30 min");
        assert_eq!(told("1:30"), "stops at 01:30 tomorrow, in 3 h 12 min");
        assert_eq!(told("1-02:00"), "stops at 00:18 on 2027-03-01, in 26 h 0 min");
        assert_eq!(told("8s"), "stops at 22:18:08 today, in 8.0 s");
        assert_eq!(told("999999999d"), "stops in 999999999.0 days");
    }
}

//! Times as people write and read them: one parser and one formatter for plans and for the command line.
//!
//! Own code, because the crate `humantime` reads no fractions such as `1.5h` and writes every unit down to nanoseconds.

use std::time::Duration;

/// The largest first, as they stand in `1h30m`.
const UNITS: [(char, f64); 4] = [('d', 86400.0), ('h', 3600.0), ('m', 60.0), ('s', 1.0)];

/// Reads `90s`, `45m`, `1.5h`, `2d` or `1h30m`.
pub(crate) fn parse(text: &str) -> Result<Duration, String> {
    let wrong = || format!("`{text}` is not a time: write a number and s, m, h or d, like 8h");
    let (mut rest, mut sum, mut smaller) = (text, Duration::ZERO, UNITS.iter());
    while let Some(end) = rest.find(UNITS.map(|(letter, _)| letter)) {
        let (_, unit) = smaller.find(|(letter, _)| rest[end..].starts_with(*letter)).ok_or_else(wrong)?;
        let number: f64 = rest[..end].parse().map_err(|_| wrong())?;
        let part = Duration::try_from_secs_f64(number * unit).map_err(|_| wrong())?;
        sum = sum.checked_add(part).ok_or_else(wrong)?;
        rest = &rest[end + 1..];
    }
    if rest.is_empty() && !text.is_empty() { Ok(sum) } else { Err(wrong()) }
}

/// Reads the forms of Slurm that no time of the day has: `1:30:00`, `2-12`, `1-06:30`, `1-00:00:00`.
pub(crate) fn parse_slurm(text: &str) -> Option<Duration> {
    let (days, rest) = text.split_once('-').map_or((None, text), |(days, rest)| (Some(days), rest));
    let number = |digits: &str| match digits.bytes().all(|byte| byte.is_ascii_digit()) {
        true => digits.parse::<u32>().ok(),
        false => None,
    };
    let parts = rest.split(':').map(number).collect::<Option<Vec<u32>>>()?;
    let (hours, minutes, seconds) = match (days.is_some(), parts.as_slice()) {
        (true, &[hours]) => (hours, 0, 0),
        (true, &[hours, minutes]) => (hours, minutes, 0),
        (_, &[hours, minutes, seconds]) => (hours, minutes, seconds),
        _ => return None,
    };
    let hours = 24 * u64::from(days.map_or(Some(0), number)?) + u64::from(hours);
    let in_range = minutes < 60 && seconds < 60;
    in_range.then(|| Duration::from_secs(3600 * hours + 60 * u64::from(minutes) + u64::from(seconds)))
}

/// Writes a time in the one or two units that matter: `350 ms`, `4.2 s`, `2 min 5 s`, `3 h 20 min`, `5.5 days`.
pub(crate) fn written(time: Duration) -> String {
    let (seconds, milliseconds) = (time.as_secs(), time.subsec_millis());
    match seconds {
        0 => format!("{milliseconds} ms"),
        1..60 => format!("{seconds}.{} s", milliseconds / 100),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        3600..172_800 => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
        _ => format!("{:.1} days", seconds as f64 / 86400.0),
    }
}

/// The same for a number of seconds.
pub(crate) fn written_s(seconds: f64) -> String {
    written(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_with_their_unit() {
        assert_eq!(parse("90s"), Ok(Duration::from_secs(90)));
        assert_eq!(parse("1.5h"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse("1h30m"), Ok(Duration::from_secs(5400)));
        assert_eq!(parse("1d2h3m4.5s"), Ok(Duration::from_secs_f64(93_784.5)));
        for wrong in ["", "8", "h", "-1h", "8 parsecs", "nan s", "30m1h", "1h1h", "1h30", "2h-5m", "1h 30m"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_mean_what_they_mean_to_slurm() {
        let hours = |text, hours: f64| assert_eq!(parse_slurm(text), Some(Duration::from_secs_f64(3600.0 * hours)));
        hours("1:30:00", 1.5);
        hours("100:00:36", 100.01);
        hours("2-12", 60.0);
        hours("1-06:30", 30.5);
        hours("1-00:00:00", 24.0);
        for other in ["07:30", "90", "1:60:00", "1:00:60", "-1", "1-", "1-2-3", "1:2:3:4", "+1-00", ":::", "1h", ""] {
            assert_eq!(parse_slurm(other), None, "{other}");
        }
    }

    #[test]
    fn times_are_written_in_the_units_that_matter() {
        let texts = [0.35, 4.25, 125.0, 12_000.0, 475_200.0].map(written_s);
        assert_eq!(texts, ["350 ms", "4.2 s", "2 min 5 s", "3 h 20 min", "5.5 days"]);
    }
}

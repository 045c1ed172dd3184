//! Times as people write and read them: one parser and one formatter for plans and for the command line.
//!
//! Own code, because the crate `humantime` reads no fractions such as `1.5h` and writes every unit down to nanoseconds.

use std::time::Duration;

const UNITS: [(char, f64); 4] = [('s', 1.0), ('m', 60.0), ('h', 3600.0), ('d', 86400.0)];

/// Reads `90s`, `45m`, `1.5h` or `2d`.
pub(crate) fn parse(text: &str) -> Result<Duration, String> {
    let wrong = || format!("`{text}` is not a time: write a number and s, m, h or d, like 8h");
    let split = UNITS.iter().find_map(|&(letter, unit)| Some((text.strip_suffix(letter)?, unit)));
    let (number, unit) = split.ok_or_else(wrong)?;
    let number: f64 = number.parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(number * unit).map_err(|_| wrong())
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
        for wrong in ["", "8", "h", "-1h", "8 parsecs", "nan s"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_are_written_in_the_units_that_matter() {
        let texts = [0.35, 4.25, 125.0, 12_000.0, 475_200.0].map(written_s);
        assert_eq!(texts, ["350 ms", "4.2 s", "2 min 5 s", "3 h 20 min", "5.5 days"]);
    }
}

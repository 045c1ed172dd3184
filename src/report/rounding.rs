//! Numbers as a reader wants them: with no more digits than are certain.

/// At most `digits` significant digits, in the shorter of the plain and the exponent form: `0.35`, `256`, `1e-17`.
pub(super) fn significant(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value);
    let (plain, exponent) = (format!("{rounded}"), format!("{rounded:e}"));
    if exponent.len() < plain.len() { exponent } else { plain }
}

/// The value in units of the second digit of `uncertainty`: `24.1` for an uncertainty of 5.2, `240` for one of 52.
///
/// An uncertainty that is 0 or not finite leaves three significant digits.
pub(super) fn to_precision(value: f64, uncertainty: f64) -> String {
    // The printed exponent is exact, where a rounded log10 may be one off.
    let exponent = format!("{uncertainty:.1e}").split_once('e').and_then(|(_, e)| e.parse::<i32>().ok());
    match exponent.filter(|_| uncertainty > 0.0) {
        Some(exponent) if exponent > 1 => {
            let unit = libm::exp10(f64::from(exponent - 1));
            format!("{:.0}", (value / unit).round() * unit)
        }
        Some(exponent) => format!("{value:.*}", usize::try_from(1 - exponent).unwrap_or(0)),
        None => significant(value, 3),
    }
}

/// `24.1 [18.9, 31.4]`: a value and its interval, to two digits of its narrower side, eight digits at most.
pub(super) fn with_interval(value: f64, low: f64, high: f64) -> String {
    let narrower = (value - low).min(high - value).max(1e-6 * value.abs());
    let text = |x| to_precision(x, narrower);
    format!("{} [{}, {}]", text(value), text(low), text(high))
}

/// `> 120`: a lower bound to three digits, rounded down so that it remains a lower bound.
pub(super) fn lower_bound(bound: f64) -> String {
    let nearest = significant(bound, 3);
    let nearest: f64 = nearest.parse().unwrap_or(bound);
    let unit = libm::exp10(libm::floor(libm::log10(bound)) - 2.0);
    let below = if nearest > bound { nearest - unit } else { nearest };
    format!("> {}", significant(below, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_take_their_shorter_form() {
        let texts = [0.35, 256.0, 1e-17, 2e5, 0.03, std::f64::consts::PI / 256.0].map(|x| significant(x, 6));
        assert_eq!(texts, ["0.35", "256", "1e-17", "2e5", "0.03", "0.0122718"]);
    }

    #[test]
    fn an_interval_decides_the_digits() {
        assert_eq!(with_interval(24.123, 18.93, 31.42), "24.1 [18.9, 31.4]");
        assert_eq!(with_interval(241.23, 189.3, 314.2), "241 [189, 314]");
        assert_eq!(with_interval(2412.3, 1893.0, 3142.0), "2410 [1890, 3140]");
        assert_eq!(with_interval(0.7123, 0.7101, 0.7149), "0.7123 [0.7101, 0.7149]");
        assert_eq!(with_interval(0.0, 0.0, 0.0), "0 [0, 0]");
        assert_eq!(with_interval(0.75, 0.75 - 1e-15, 0.75 + 1e-15), "0.75000000 [0.75000000, 0.75000000]");
    }

    #[test]
    fn a_bound_is_never_rounded_up() {
        assert_eq!(lower_bound(120.18), "> 120");
        assert_eq!(lower_bound(119.96), "> 119");
        assert_eq!(lower_bound(999.9), "> 999");
        assert_eq!(lower_bound(0.067_59), "> 0.0675");
    }
}

//! Numbers as people write them in campaign files, plans and messages.

use std::fmt;

/// A number as people write it: `0.03`, `200`, but `2e5` and `1e-17`.
pub struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (plain, powers) = (format!("{}", self.0), format!("{:e}", self.0));
        // With a power of ten only where that saves at least two characters.
        f.pad(if powers.len() + 2 <= plain.len() { &powers } else { &plain })
    }
}

/// The number rounded down to three significant digits, so that a limit that is shown is never above the true one.
pub(crate) fn cut_to_three_digits(number: f64) -> f64 {
    let near: f64 = format!("{number:.2e}").parse().expect("a formatted number reads back");
    if near <= number {
        return near;
    }
    let unit = libm::pow(10.0, libm::floor(libm::log10(number)) - 2.0);
    format!("{:.2e}", near - unit).parse().expect("a formatted number reads back")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let texts = [0.03, 256.0, 2e5, 1e-17, 1e4, 12345.0, 1e-3].map(|number| Short(number).to_string());
        assert_eq!(texts, ["0.03", "256", "2e5", "1e-17", "1e4", "12345", "0.001"]);
    }

    #[test]
    fn a_limit_shown_is_never_above_the_true_one() {
        let cut = [6.0785e-4, 2.7858, 99.99, 0.5].map(cut_to_three_digits);
        assert_eq!(cut, [6.07e-4, 2.78, 99.9, 0.5]);
    }
}

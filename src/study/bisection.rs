//! The root of a function in one unknown, to the last bit.
//!
//! A few dozen halvings cost nothing here, and the answer is the same on every machine: this is why no solver with a
//! tolerance is used.

/// Halves `[a, b]`, at whose ends `f` has different signs, until no number lies between; the sign changes from the
/// first number returned to the second.
pub(super) fn bisect(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> [f64; 2] {
    let sign = f(a) > 0.0;
    loop {
        let middle = 0.5 * (a + b);
        if middle <= a || middle >= b {
            return [a, b];
        }
        if (f(middle) > 0.0) == sign { a = middle } else { b = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_of_two_lies_between_neighbouring_numbers() {
        let [below, above] = bisect(|x| x * x - 2.0, 1.0, 2.0);
        assert!(below * below <= 2.0 && above * above > 2.0);
        assert_eq!(below.next_up(), above);
    }
}

//! The root of a function of one variable, to the last bit. This is own code because solvers with a tolerance do not
//! give the same bits on every machine.

/// Halves `[a, b]`, at whose ends `f` has different signs, until no number lies between. Returns the two neighbouring
/// numbers at which `f` has different signs.
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

//! Ranges of a grid axis, and the product of several axes.

use crate::campaign::file::problem::Mistake;
use crate::parameters::Short;

/// Most values on one axis.
pub(super) const LONGEST_AXIS: f64 = 1e5;

/// How a range is divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Spacing {
    /// Equal steps of this size.
    Step(f64),
    /// So many points at equal distances.
    Linear(usize),
    /// So many points at equal ratios.
    Log(usize),
}

/// What is wrong with a range: the key at fault, and the mistake.
type RangeMistake = (&'static str, Mistake);

/// The values of a range, both ends included.
///
/// Values between the ends are rounded to nine digits. So they read well, and a range that is made longer at the same
/// spacing keeps its old values to the last bit: no finished job is done again.
pub(super) fn spread(from: f64, to: f64, spacing: Spacing) -> Result<Vec<f64>, RangeMistake> {
    if from >= to {
        let message = format!("the range ends at {} but starts at {}", Short(to), Short(from));
        return Err(("to", Mistake::new(message).help("`to` must be above `from`")));
    }
    let steps = match spacing {
        Spacing::Linear(points) | Spacing::Log(points) => points - 1,
        Spacing::Step(step) => whole_steps(from, to, step).map_err(|mistake| ("step", mistake))?,
    };
    if let (Spacing::Log(_), true) = (spacing, from <= 0.0) {
        let mistake = Mistake::new(format!("a logarithmic range cannot start at {}", Short(from)));
        return Err(("from", mistake.help("`from` must be above 0, or the scale \"linear\"")));
    }
    let between = |i: usize| match spacing {
        Spacing::Step(step) => from + i as f64 * step,
        Spacing::Linear(_) => from + (to - from) * (i as f64 / steps as f64),
        Spacing::Log(_) => from * libm::exp(libm::log(to / from) * (i as f64 / steps as f64)),
    };
    let inner = (1..steps).map(|i| nine_digits(between(i)));
    Ok(std::iter::once(from).chain(inner).chain(std::iter::once(to)).collect())
}

fn whole_steps(from: f64, to: f64, step: f64) -> Result<usize, Mistake> {
    if step <= 0.0 {
        return Err(Mistake::new(format!("a step of {} leads nowhere", Short(step))).help("`step` must be above 0"));
    }
    let steps = ((to - from) / step).round();
    if steps >= LONGEST_AXIS {
        let help = format!("an axis has at most {} values", Short(LONGEST_AXIS));
        return Err(Mistake::new(format!("{} steps are too many", Short(steps))).help(help));
    }
    let last = nine_digits(from + steps * step);
    if steps < 1.0 || (last - to).abs() > 1e-6 * step {
        let reached = nine_digits(from + ((to - from) / step).floor() * step);
        let message = format!("steps of {} from {} do not end at {}", Short(step), Short(from), Short(to));
        let help = format!("the last step before it ends at {}: write that, or another step", Short(reached));
        return Err(Mistake::new(message).help(help));
    }
    Ok(steps as usize)
}

/// The number with nine significant decimal digits.
fn nine_digits(number: f64) -> f64 {
    format!("{number:.8e}").parse().expect("a formatted number reads back")
}

/// Where the `index`-th point of the product lies on each of the axes of these lengths; the last axis runs fastest.
pub(super) fn place_on_axes(lengths: &[usize], mut index: usize) -> Vec<usize> {
    let mut places = vec![0; lengths.len()];
    for (place, length) in places.iter_mut().zip(lengths).rev() {
        *place = index % length;
        index /= length;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logarithmic_range_has_equal_ratios_and_its_ends_as_written() {
        let values = spread(0.01, 10.0, Spacing::Log(7)).unwrap();
        assert_eq!(values, [0.01, 0.0316227766, 0.1, 0.316227766, 1.0, 3.16227766, 10.0]);
    }

    #[test]
    fn a_longer_range_of_the_same_spacing_keeps_the_old_values_to_the_last_bit() {
        let long = spread(0.01, 100.0, Spacing::Log(81)).unwrap();
        for (short, offset) in
            [(spread(0.01, 1.0, Spacing::Log(41)).unwrap(), 0), (spread(0.1, 100.0, Spacing::Log(61)).unwrap(), 20)]
        {
            assert_eq!(long[offset..offset + short.len()], short);
        }
        let fine = spread(0.2, 0.8, Spacing::Step(0.1)).unwrap();
        assert_eq!(fine, [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]);
        assert_eq!(spread(0.2, 0.5, Spacing::Linear(4)).unwrap(), fine[..4]);
    }

    #[test]
    fn a_range_that_runs_backwards_or_misses_its_end_is_refused() {
        assert_eq!(spread(1.0, 1.0, Spacing::Linear(2)).unwrap_err().0, "to");
        assert_eq!(spread(0.0, 1.0, Spacing::Log(3)).unwrap_err().0, "from");
        assert!(spread(0.1, 1.0, Spacing::Step(0.4)).unwrap_err().1.help.unwrap().contains("0.9"));
        assert_eq!(spread(0.0, 1.0, Spacing::Step(1e-9)).unwrap_err().0, "step");
        assert_eq!(spread(0.0, 1.0, Spacing::Step(-0.1)).unwrap_err().0, "step");
    }

    #[test]
    fn the_last_axis_runs_fastest() {
        let places: Vec<_> = (0..6).map(|i| place_on_axes(&[2, 3], i)).collect();
        assert_eq!(places, [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]);
        assert!(place_on_axes(&[], 0).is_empty());
    }
}

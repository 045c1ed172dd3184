//! Axes of plots: where a value lies, and where round numbers stand.

/// Share of a linear axis that is left free beyond its data on either side.
const FREE: f64 = 0.05;

/// About so many numbers stand along a linear axis.
const TICKS: f64 = 8.0;

/// A linear axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LinearAxis {
    pub(super) low: f64,
    pub(super) high: f64,
    step: f64,
}

impl LinearAxis {
    /// An axis that shows these values.
    pub(super) fn over(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values);
        // A single value gets a range of its own size.
        let span = if high > low { high - low } else { low.abs().max(1.0) * 0.1 };
        let (low, high) = (low - FREE * span, high + FREE * span);
        Self { low, high, step: round_step((high - low) / TICKS) }
    }

    /// Where a value lies, from 0 to 1.
    pub(super) fn share(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// Round numbers along the axis.
    pub(super) fn ticks(&self) -> impl Iterator<Item = f64> {
        let (first, last) = ((self.low / self.step).ceil() as i64, (self.high / self.step).floor() as i64);
        let step = self.step;
        (first..=last).map(move |k| k as f64 * step)
    }
}

/// The smallest of 1, 2, 5, 10 times a power of ten that is not below `least`.
fn round_step(least: f64) -> f64 {
    let unit = libm::exp10(libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * unit)
        .into_iter()
        .find(|step| *step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * unit)
}

/// A logarithmic axis, its ends as logarithms to base 10.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LogAxis {
    low: f64,
    high: f64,
}

impl LogAxis {
    /// An axis that shows these values, all above 0.
    pub(super) fn over(values: impl Iterator<Item = f64>) -> Self {
        let [low, high] = ends(values.map(libm::log10));
        let free = 0.08 * (high - low).max(0.5);
        Self { low: low - free, high: high + free }
    }

    /// Where a value lies, from 0 to 1.
    pub(super) fn share(&self, value: f64) -> f64 {
        (libm::log10(value) - self.low) / (self.high - self.low)
    }

    /// 1, 2 and 5 times powers of ten. Over more than three decades only powers of ten, over more than eight not all of
    /// them.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let every = ((self.high - self.low) / 8.0).ceil().max(1.0) as i32;
        let factors: &[f64] = if self.high - self.low > 3.0 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        decades
            .filter(|decade| decade.rem_euclid(every) == 0)
            .flat_map(|decade| factors.iter().map(move |factor| factor * libm::exp10(f64::from(decade))))
            .filter(|tick| (0.0..=1.0).contains(&self.share(*tick)))
            .collect()
    }
}

/// The smallest and the largest value; 0 and 1 where there is none.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let ends = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
    if ends[0] <= ends[1] { ends } else { [0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_on_an_axis_are_round_and_within_it() {
        let axis = LinearAxis::over([-1.5, 1.4].into_iter());
        let ticks: Vec<f64> = axis.ticks().collect();
        assert_eq!(ticks, [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5]);
        assert_eq!([0.013, 0.05, 2.1, 70.0].map(round_step), [0.02, 0.05, 5.0, 100.0]);
        let flat = LinearAxis::over([1.0].into_iter());
        assert!(flat.low < 1.0 && flat.high > 1.0 && flat.ticks().count() > 1);
        assert_eq!(LogAxis::over([1.0, 40.0].into_iter()).ticks(), [1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(LogAxis::over([1e-4, 1.0].into_iter()).ticks().len(), 5);
    }
}

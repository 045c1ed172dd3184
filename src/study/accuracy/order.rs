//! Observed orders of convergence, and how far the finest value still is from the limit.
//!
//! If `y(h) = y_0 + C h^p` is known at constant ratios `q = h_k/h_{k+1}`, neighbours differ by
//! `y_k - y_{k+1} = C h_k^p (1 - q^-p)`. In logarithms this is a straight line of slope p for any y_0. A fit to the
//! differences from the finest value would be steeper than p, because that value has an error too. If the exact value
//! is known, the errors themselves are fitted.
//!
//! ```
//! use meniscus::study::accuracy::order::Order;
//! let h = [0.4, 0.2, 0.1, 0.05];
//! let order = Order::of_ladder(&h, &h.map(|h| 1.0 + 3.0 * h * h)).unwrap();
//! assert!((order.p - 2.0).abs() < 1e-9);
//! // The finest value is 1.0075, so it is off by 0.0075: a third of the last difference.
//! assert!((order.left_over(0.0225, 2.0) - 0.0075).abs() < 1e-12);
//! ```

/// The ratios of a ladder may differ by this share.
const UNEVEN: f64 = 0.05;

/// Differences and errors below this share of the value are rounding.
const ROUNDING: f64 = 1e-12;

/// [`Order::left_over`] clamps the exponent to this range; no part of the scheme has an order above 2.
const TRUSTED: (f64, f64) = (0.5, 2.0);

/// Orders outside this range are not trusted.
const LIKELY: (f64, f64) = (0.3, 4.0);

/// An observed order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// The exponent p of the fit.
    pub p: f64,
    /// The smallest exponent of two neighbouring points.
    pub low: f64,
    /// The largest exponent of two neighbouring points.
    pub high: f64,
}

impl Order {
    /// From values on a ladder of constant ratio, coarse to fine. `None` for fewer than three values, for uneven
    /// ratios, or if all differences are rounding.
    pub fn of_ladder(h: &[f64], y: &[f64]) -> Option<Self> {
        let ratio = h.first()? / h.get(1)?;
        let even = h.windows(2).all(|pair| (pair[0] / pair[1] / ratio - 1.0).abs() < UNEVEN);
        let differences = h.iter().zip(y.windows(2)).map(|(&h, pair)| (h, pair[0] - pair[1]));
        if even { Self::fit(differences, y.last()?.abs()) } else { None }
    }

    /// From errors against an exact value of the size `scale`.
    pub(super) fn of_errors(h: &[f64], errors: &[f64], scale: f64) -> Option<Self> {
        Self::fit(h.iter().copied().zip(errors.iter().copied()), scale)
    }

    /// Least squares of ln|d| on ln h.
    fn fit(points: impl Iterator<Item = (f64, f64)>, scale: f64) -> Option<Self> {
        let points: Vec<(f64, f64)> = points
            .filter(|(_, d)| d.abs() > ROUNDING * scale)
            .map(|(h, d)| (libm::log(h), libm::log(d.abs())))
            .collect();
        if points.len() < 2 {
            return None;
        }
        let n = points.len() as f64;
        let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let covariance: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        let variance: f64 = points.iter().map(|p| (p.0 - x) * (p.0 - x)).sum();
        let local = points.windows(2).map(|pair| (pair[0].1 - pair[1].1) / (pair[0].0 - pair[1].0));
        let (low, high) = local.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        (variance > 0.0).then(|| Self { p: covariance / variance, low, high })
    }

    /// Whether errors fall at a likely order, and the orders of all pairs of points lie within 1 of each other.
    pub fn is_clear(&self) -> bool {
        LIKELY.0 < self.p && self.p < LIKELY.1 && self.high - self.low < 1.0
    }

    /// Error of the finest value, `|d|/(q^p - 1)`, from the last difference d and the ratio q.
    pub fn left_over(&self, last_difference: f64, ratio: f64) -> f64 {
        last_difference.abs() / (libm::pow(ratio, self.p.clamp(TRUSTED.0, TRUSTED.1)) - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_does_not_depend_on_the_limit() {
        let h = [0.1, 0.05, 0.025, 0.0125];
        for (p, limit) in [(1.0, 0.0), (1.5, 7.0), (2.0, -3.0)] {
            let order = Order::of_ladder(&h, &h.map(|h| limit - 0.3 * libm::pow(h, p))).unwrap();
            assert!((order.p - p).abs() < 1e-6 && order.is_clear(), "{order:?}");
        }
    }

    #[test]
    fn rounding_uneven_ladders_and_pairs_have_no_order() {
        assert_eq!(Order::of_ladder(&[0.4, 0.2, 0.1], &[1.0, 1.0 + 1e-15, 1.0]), None);
        assert_eq!(Order::of_ladder(&[0.4, 0.2, 0.05], &[4.0, 2.0, 0.5]), None);
        assert_eq!(Order::of_ladder(&[0.4, 0.2], &[4.0, 2.0]), None);
        assert_eq!(Order::of_ladder(&[], &[]), None);
    }

    #[test]
    fn errors_that_jump_about_are_no_order() {
        let order = Order::of_errors(&[0.4, 0.2, 0.1], &[1e-3, 1e-5, 1e-4], 1.0).unwrap();
        assert!(!order.is_clear());
    }
}

//! Readings between the samples of a time series: where a curve peaks, when it crosses a value.

use crate::results::trajectory::Samples;
use crate::study::bisection::bisect;

/// Half the way over which the slowest speed is taken, in sigma. It is longer than an edge, because vertices pass a tip
/// in jerks.
const HALF_WAY: f64 = 0.025;

/// A passage is timed from `h = -STRETCH` to `h = STRETCH`, in sigma.
pub(super) const STRETCH: f64 = 1.0;

/// The largest shape parameter A, on the parabola through the highest sample and its neighbours.
pub(super) fn largest_shape(samples: &Samples) -> Option<f64> {
    let (t, y) = (&samples.t, &samples.shape);
    let top = (0..y.len()).max_by(|&a, &b| y[a].total_cmp(&y[b]))?;
    if top == 0 || top + 1 >= y.len() {
        return Some(y[top]);
    }
    let (left, right) = (t[top] - t[top - 1], t[top + 1] - t[top]);
    let (rise, fall) = ((y[top] - y[top - 1]) / left, (y[top + 1] - y[top]) / right);
    let curvature = (fall - rise) / (left + right);
    let slope = (rise * right + fall * left) / (left + right);
    Some(if curvature < 0.0 { y[top] - slope * slope / (4.0 * curvature) } else { y[top] })
}

/// When the centroid first crosses `h`, on the cubic with the positions and speeds of the samples before and after.
pub(super) fn crossing(samples: &Samples, v_t: f64, h: f64) -> Option<f64> {
    let (t, place, speed) = (&samples.t, &samples.h, &samples.v_g);
    let k = (1..place.len()).find(|&k| place[k - 1] < h && place[k] >= h)?;
    let span = t[k] - t[k - 1];
    let (m0, m1) = (span * v_t * speed[k - 1], span * v_t * speed[k]);
    let cubic = |s: f64| {
        let (a, b) = (1.0 - s, s);
        place[k - 1] * a * a * (1.0 + 2.0 * b) + m0 * a * a * b + place[k] * b * b * (1.0 + 2.0 * a) - m1 * b * b * a
    };
    let [before, _] = bisect(|s| h - cubic(s), 0.0, 1.0);
    Some(t[k - 1] + span * before)
}

/// The slowest speed within the stretch, in V_t: `2 HALF_WAY` over the longest time that the droplet takes for it.
pub(super) fn slowest(samples: &Samples, v_t: f64) -> Option<f64> {
    let places = (0..).map(|k| -STRETCH + HALF_WAY * f64::from(k)).take_while(|h| *h <= STRETCH + 1e-9);
    let times: Vec<f64> = places.map(|h| crossing(samples, v_t, h)).collect::<Option<_>>()?;
    let longest = times.windows(3).map(|three| three[2] - three[0]).max_by(f64::total_cmp)?;
    Some(2.0 * HALF_WAY / (v_t * longest))
}

/// When E_k/E_t falls below the threshold for good; its logarithm is taken as linear between samples.
pub(super) fn time_to_rest(samples: &Samples, threshold: f64) -> Option<f64> {
    let (t, ratio) = (&samples.t, &samples.ek_ratio);
    let last = ratio.iter().rposition(|&ratio| ratio >= threshold)?;
    let (above, below) = (libm::log(ratio[last]), libm::log(*ratio.get(last + 1)?));
    let share = (above - libm::log(threshold)) / (above - below);
    Some(t[last] + share * (t[last + 1] - t[last]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(t: &[f64], h: impl Fn(f64) -> f64, v: impl Fn(f64) -> f64) -> Samples {
        Samples {
            t: t.to_vec(),
            h: t.iter().map(|&t| h(t)).collect(),
            v_g: t.iter().map(|&t| v(t)).collect(),
            ..Samples::default()
        }
    }

    #[test]
    fn a_crossing_is_found_between_samples() {
        let t: Vec<f64> = (0..40).map(f64::from).collect();
        let cubed = samples(&t, |t| -2.0 + 1e-3 * t * t * t, |t| 3e-3 * t * t);
        assert!((crossing(&cubed, 1.0, 0.7).unwrap() - libm::cbrt(2700.0)).abs() < 1e-9);
        assert_eq!(crossing(&cubed, 1.0, 1e3), None);
    }

    #[test]
    fn the_slowest_speed_is_that_of_the_slowest_stretch() {
        let t: Vec<f64> = (0..3000).map(f64::from).collect();
        // Half as fast up to h = 0.
        let h = |t: f64| if t < 1250.0 { -2.5 + 2e-3 * t } else { 4e-3 * (t - 1250.0) };
        let steady = samples(&t, h, |t| if t < 1250.0 { 2e-3 } else { 4e-3 });
        assert!((slowest(&steady, 1.0).unwrap() - 2e-3).abs() < 1e-9);
    }

    #[test]
    fn a_peak_and_a_threshold_lie_between_samples() {
        let t = [0.0, 1.0, 2.0, 3.0];
        let shape = t.map(|t| 1.2 - 0.01 * (t - 1.3) * (t - 1.3)).to_vec();
        let peaked = Samples { t: t.to_vec(), shape, ..Samples::default() };
        assert!((largest_shape(&peaked).unwrap() - 1.2).abs() < 1e-12);
        let falling = Samples { t: t.to_vec(), ek_ratio: t.map(|t| libm::exp(-t)).to_vec(), ..Samples::default() };
        assert!((time_to_rest(&falling, libm::exp(-1.25)).unwrap() - 1.25).abs() < 1e-12);
    }
}

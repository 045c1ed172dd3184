//! The scenes that accuracy is measured in, and what is read off a run in each.

use crate::campaign::choose::tolerance::Kind;
use crate::parameters::{Model, Point};
use crate::results::fits::RunRecord;
use crate::results::trajectory::{Outcome, Samples};

/// Half the way over which the slowest speed is taken, in sigma: wider than an edge, for vertices jerk as they pass a tip.
const HALF_WAY: f64 = 0.025;

/// The stretch of a channel that a passage is timed over, from -1 to 1.
const STRETCH: f64 = 1.0;

/// A scene of the accuracy campaign, by the first part of its block's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Study {
    /// A droplet that touches nothing.
    Free,
    /// Through a constriction, close to the threshold of passing.
    Channel,
    /// The same, further from it.
    Passage,
    /// It stays stuck.
    Arrest,
    /// An array in which nothing clogs.
    Flow,
    /// An array in which droplets clog.
    Clog,
    /// A soft particle on a plate.
    Plate,
}

/// A number that is read off the runs of a point.
#[derive(Clone, Copy, Debug)]
pub struct Observable {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Whether its errors are relative; else they are in its own unit.
    pub relative: bool,
    /// Whether `tolerance` speaks of it.
    pub headline: bool,
    /// Whether a small cause can have a large effect on it, in few of many runs: a droplet gets stuck in another place.
    pub can_jump: bool,
    /// Its exact value, where that is known.
    pub exact: Option<fn(&Point) -> f64>,
    /// The number; `None` if the runs do not have it.
    pub estimate: fn(&Point, &[&RunRecord]) -> Option<f64>,
}

const PASSAGE: &[Observable] = &[
    Observable {
        name: "A_max - 1",
        about: "largest shape parameter, less that of a circle",
        relative: true,
        headline: true,
        can_jump: false,
        exact: None,
        estimate: |_, runs| passed(runs).and_then(largest_shape).map(|shape| shape - 1.0),
    },
    Observable {
        name: "transit",
        about: "time from h = -1 to h = 1, in t0",
        relative: true,
        headline: true,
        can_jump: false,
        exact: None,
        estimate: |point, runs| {
            let samples = passed(runs)?;
            Some(crossing(samples, point.v_t, STRETCH)? - crossing(samples, point.v_t, -STRETCH)?)
        },
    },
    Observable {
        name: "slowest",
        about: "slowest speed over 0.05 sigma, in V_t; its errors are in V_t too",
        relative: false,
        headline: false,
        can_jump: false,
        exact: None,
        estimate: |point, runs| slowest(passed(runs)?, point.v_t),
    },
];

const ARREST: &[Observable] = &[
    Observable {
        name: "h at rest",
        about: "where the droplet rests; errors in sigma",
        relative: false,
        headline: false,
        can_jump: false,
        exact: None,
        estimate: |_, runs| first_with(runs, Outcome::Clogged).and_then(|run| run.samples.h.last().copied()),
    },
    Observable {
        name: "time to rest",
        about: "when E_k/E_t falls below the threshold, in t0",
        relative: true,
        headline: false,
        can_jump: false,
        exact: None,
        estimate: |point, runs| time_to_rest(&first_with(runs, Outcome::Clogged)?.samples, point.limits.ek_threshold),
    },
];

const FREE: &[Observable] = &[
    Observable {
        name: "speed",
        about: "v_g/V_t at the end, exactly 1",
        relative: true,
        headline: true,
        can_jump: false,
        exact: Some(|_| 1.0),
        estimate: |_, runs| first_with(runs, Outcome::TimeLimit).and_then(|run| run.samples.v_g.last().copied()),
    },
    Observable {
        name: "energy",
        about: "E_k/E_t at the end, exactly 1: drag takes what gravity gives, and nothing else moves",
        relative: true,
        headline: true,
        can_jump: false,
        exact: Some(|_| 1.0),
        estimate: |_, runs| first_with(runs, Outcome::TimeLimit).map(|run| run.ek_ratio_end),
    },
    Observable {
        name: "fall",
        about: "r(t)/(V_t t - V_t^2 (1 - exp(-t/V_t))) at the end, exactly 1",
        relative: true,
        headline: true,
        can_jump: false,
        exact: Some(|_| 1.0),
        estimate: |point, runs| {
            let run = first_with(runs, Outcome::TimeLimit)?;
            Some(run.r_end / (point.v_t * (run.t_end + point.v_t * libm::expm1(-run.t_end / point.v_t))))
        },
    },
];

const FLOW: &[Observable] = &[Observable {
    name: "<v_g>",
    about: "mean speed over the arrays, in V_t",
    relative: true,
    headline: true,
    can_jump: false,
    exact: None,
    estimate: |_, runs| {
        let speeds: Option<Vec<f64>> = runs.iter().map(|run| run.v_g_mean).collect();
        speeds.filter(|speeds| !speeds.is_empty()).map(|speeds| speeds.iter().sum::<f64>() / speeds.len() as f64)
    },
}];

const CLOG: &[Observable] = &[Observable {
    name: "lambda",
    about: "decay length by maximum likelihood, in sigma",
    relative: true,
    headline: true,
    can_jump: true,
    exact: None,
    estimate: |_, runs| {
        let clogs = runs.iter().filter(|run| run.outcome == Some(Outcome::Clogged)).count();
        (clogs > 0).then(|| runs.iter().map(|run| run.r_end.max(0.0)).sum::<f64>() / clogs as f64)
    },
}];

const PLATE: &[Observable] = &[Observable {
    name: "delta_s",
    about: "how deep the soft particle sinks, exactly pi/(16 E_w)",
    relative: true,
    headline: false,
    can_jump: false,
    exact: Some(|point| match &point.model {
        Model::Soft(soft) => std::f64::consts::PI / (16.0 * soft.e_w),
        Model::Deformable(_) => f64::NAN,
    }),
    estimate: |_, runs| runs.first()?.delta_s,
}];

impl Study {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Free, Self::Channel, Self::Passage, Self::Arrest, Self::Flow, Self::Clog, Self::Plate];

    /// The first part of the names of its blocks.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Channel => "channel",
            Self::Passage => "passage",
            Self::Arrest => "arrest",
            Self::Flow => "flow",
            Self::Clog => "clog",
            Self::Plate => "plate",
        }
    }

    /// The scene of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|study| study.name() == name)
    }

    /// What is read off its runs.
    pub const fn observables(self) -> &'static [Observable] {
        match self {
            Self::Free => FREE,
            Self::Channel | Self::Passage => PASSAGE,
            Self::Arrest => ARREST,
            Self::Flow => FLOW,
            Self::Clog => CLOG,
            Self::Plate => PLATE,
        }
    }

    /// What happens in it.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Free => "A droplet that touches nothing",
            Self::Channel => "A droplet squeezes through a constriction that it only just passes",
            Self::Passage => "It passes with more ease",
            Self::Arrest => "It stays stuck, and comes to rest",
            Self::Flow => "Arrays of obstacles in which nothing clogs, the same at every setting",
            Self::Clog => "Arrays of obstacles in which droplets clog, the same at every setting",
            Self::Plate => "A soft particle sinks onto a plate",
        }
    }

    /// What `tolerance` counts it as.
    pub const fn kind(self) -> Option<Kind> {
        match self {
            Self::Free => Some(Kind::Free),
            Self::Channel | Self::Passage => Some(Kind::Channel),
            Self::Flow => Some(Kind::Flow),
            Self::Clog => Some(Kind::Clog),
            Self::Arrest | Self::Plate => None,
        }
    }

    /// Whether its observables need time series.
    pub const fn needs_samples(self) -> bool {
        matches!(self, Self::Free | Self::Channel | Self::Passage | Self::Arrest)
    }
}

fn first_with<'a>(runs: &[&'a RunRecord], outcome: Outcome) -> Option<&'a RunRecord> {
    runs.first().copied().filter(|run| run.outcome == Some(outcome))
}

fn passed<'a>(runs: &[&'a RunRecord]) -> Option<&'a Samples> {
    first_with(runs, Outcome::Exited).map(|run| &run.samples)
}

/// The largest shape, between samples by a parabola through the three highest.
fn largest_shape(samples: &Samples) -> Option<f64> {
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

/// When the centroid first crosses `h`, between samples by the cubic that has their places and speeds.
fn crossing(samples: &Samples, v_t: f64, h: f64) -> Option<f64> {
    let (t, place, speed) = (&samples.t, &samples.h, &samples.v_g);
    let k = (1..place.len()).find(|&k| place[k - 1] < h && place[k] >= h)?;
    let span = t[k] - t[k - 1];
    let (m0, m1) = (span * v_t * speed[k - 1], span * v_t * speed[k]);
    let cubic = |s: f64| {
        let (a, b) = (1.0 - s, s);
        place[k - 1] * a * a * (1.0 + 2.0 * b) + m0 * a * a * b + place[k] * b * b * (1.0 + 2.0 * a) - m1 * b * b * a
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if cubic(middle) < h { low = middle } else { high = middle }
    }
    Some(t[k - 1] + span * low)
}

/// `2 HALF_WAY` over the longest time the droplet takes for it within the stretch, in V_t.
fn slowest(samples: &Samples, v_t: f64) -> Option<f64> {
    let places = (0..).map(|k| -STRETCH + HALF_WAY * f64::from(k)).take_while(|h| *h <= STRETCH + 1e-9);
    let times: Vec<f64> = places.map(|h| crossing(samples, v_t, h)).collect::<Option<_>>()?;
    let longest = times.windows(3).map(|three| three[2] - three[0]).max_by(f64::total_cmp)?;
    Some(2.0 * HALF_WAY / (v_t * longest))
}

/// When E_k/E_t falls below the threshold for good, between samples by its logarithm.
fn time_to_rest(samples: &Samples, threshold: f64) -> Option<f64> {
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

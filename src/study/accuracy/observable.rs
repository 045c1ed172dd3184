//! The numbers that are read off the runs of a point, scene by scene.

use crate::parameters::{Model, Point};
use crate::results::fits::RunRecord;
use crate::results::trajectory::{Outcome, Samples};
use crate::study::accuracy::readings::{STRETCH, crossing, largest_shape, slowest, time_to_rest};

/// A number that is read off the runs of a point.
#[derive(Clone, Copy, Debug)]
pub struct Observable {
    /// Its name.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Whether its errors are relative or in its own unit.
    pub relative: bool,
    /// Whether `tolerance` bounds its error.
    pub headline: bool,
    /// Whether a small change can have a large effect in a few runs, as when a droplet gets stuck in another place.
    pub can_jump: bool,
    /// Its exact value, if that is known.
    pub exact: Option<fn(&Point) -> f64>,
    /// Its value; `None` if the runs do not have it.
    pub estimate: fn(&Point, &[&RunRecord]) -> Option<f64>,
}

/// What most observables have in common.
const USUAL: Observable = Observable {
    name: "",
    about: "",
    relative: true,
    headline: true,
    can_jump: false,
    exact: None,
    estimate: |_, _| None,
};

pub(super) const PASSAGE: &[Observable] = &[
    Observable {
        name: "A_max - 1",
        about: "largest shape parameter, less that of a circle",
        estimate: |_, runs| passed(runs).and_then(largest_shape).map(|shape| shape - 1.0),
        ..USUAL
    },
    Observable {
        name: "transit",
        about: "time from h = -1 to h = 1, in t0",
        estimate: |point, runs| {
            let samples = passed(runs)?;
            Some(crossing(samples, point.v_t, STRETCH)? - crossing(samples, point.v_t, -STRETCH)?)
        },
        ..USUAL
    },
    Observable {
        name: "slowest",
        about: "slowest speed over 0.05 sigma, in V_t; its errors are in V_t too",
        relative: false,
        headline: false,
        estimate: |point, runs| slowest(passed(runs)?, point.v_t),
        ..USUAL
    },
];

pub(super) const ARREST: &[Observable] = &[
    Observable {
        name: "h at rest",
        about: "where the droplet rests; errors in sigma",
        relative: false,
        headline: false,
        estimate: |_, runs| first_with(runs, Outcome::Clogged).and_then(|run| run.samples.h.last().copied()),
        ..USUAL
    },
    Observable {
        name: "time to rest",
        about: "when E_k/E_t falls below the threshold, in t0",
        headline: false,
        estimate: |point, runs| time_to_rest(&first_with(runs, Outcome::Clogged)?.samples, point.limits.ek_threshold),
        ..USUAL
    },
];

pub(super) const FREE: &[Observable] = &[
    Observable {
        name: "speed",
        about: "v_g/V_t at the end, exactly 1",
        exact: Some(|_| 1.0),
        estimate: |_, runs| first_with(runs, Outcome::TimeLimit).and_then(|run| run.samples.v_g.last().copied()),
        ..USUAL
    },
    Observable {
        name: "energy",
        about: "E_k/E_t at the end, exactly 1: drag takes what gravity gives, and nothing else moves",
        exact: Some(|_| 1.0),
        estimate: |_, runs| first_with(runs, Outcome::TimeLimit).map(|run| run.ek_ratio_end),
        ..USUAL
    },
    Observable {
        name: "fall",
        about: "r(t)/(V_t t - V_t^2 (1 - exp(-t/V_t))) at the end, exactly 1",
        exact: Some(|_| 1.0),
        estimate: |point, runs| {
            let run = first_with(runs, Outcome::TimeLimit)?;
            Some(run.r_end / (point.v_t * (run.t_end + point.v_t * libm::expm1(-run.t_end / point.v_t))))
        },
        ..USUAL
    },
];

pub(super) const FLOW: &[Observable] = &[Observable {
    name: "<v_g>",
    about: "mean speed over the arrays, in V_t",
    estimate: |_, runs| {
        let speeds: Option<Vec<f64>> = runs.iter().map(|run| run.v_g_mean).collect();
        speeds.filter(|speeds| !speeds.is_empty()).map(|speeds| speeds.iter().sum::<f64>() / speeds.len() as f64)
    },
    ..USUAL
}];

pub(super) const CLOG: &[Observable] = &[Observable {
    name: "lambda",
    about: "decay length by maximum likelihood, in sigma",
    can_jump: true,
    estimate: |_, runs| {
        let stays = |run: &&&RunRecord| run.outcome == Some(Outcome::Clogged) || run.arrested.is_some();
        let clogs = runs.iter().filter(stays).count();
        let total: f64 = runs.iter().map(|run| run.arrested.unwrap_or(run.r_end).max(0.0)).sum();
        (clogs > 0).then(|| total / clogs as f64)
    },
    ..USUAL
}];

pub(super) const PLATE: &[Observable] = &[Observable {
    name: "delta_s",
    about: "how deep the soft particle sinks, exactly pi/(16 E_w)",
    headline: false,
    exact: Some(|point| match &point.model {
        Model::Soft(soft) => std::f64::consts::PI / (16.0 * soft.e_w),
        Model::Deformable(_) => f64::NAN,
    }),
    estimate: |_, runs| runs.first()?.delta_s,
    ..USUAL
}];

fn first_with<'a>(runs: &[&'a RunRecord], outcome: Outcome) -> Option<&'a RunRecord> {
    runs.first().copied().filter(|run| run.outcome == Some(outcome))
}

/// The time series of the first run, if its droplet came through.
fn passed<'a>(runs: &[&'a RunRecord]) -> Option<&'a Samples> {
    first_with(runs, Outcome::Exited).map(|run| &run.samples)
}

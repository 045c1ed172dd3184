//! The result of one run: a [`Trajectory`] with its outcome, summary numbers, clog and samples, or a [`Failure`].

use crate::parameters::names;
use crate::results::outline::Outline;
use serde::{Deserialize, Serialize};

/// A droplet that is slower than this creeps, in V_t.
const CREEPING: f64 = 0.01;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Outcome {
    /// E_k/E_t fell below the threshold after the droplet had moved.
    Clogged,
    /// The simulated time ran out.
    TimeLimit,
    /// The droplet went the whole distance that the campaign asked for.
    Distance,
    /// The droplet left the channel.
    Exited,
    /// The droplet came to rest on the plate.
    Settled,
    /// A film of the liquid closed: the droplet breaks in two, which is beyond the model.
    Pinched,
}

/// A finished run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// How it ended.
    pub outcome: Outcome,
    /// Displacement of the centroid along +x since gravity came on, in sigma.
    pub r_end: f64,
    /// Time at the end, in t0.
    pub t_end: f64,
    /// Mean speed after the start-up, the slope of r(t), in V_t; `None` if there are too few samples.
    pub v_g_mean: Option<f64>,
    /// E_k/E_t at the end.
    pub ek_ratio_end: f64,
    /// Largest recorded shape parameter `A = perimeter^2/(4 pi a)`; `None` for SP.
    pub shape_max: Option<f64>,
    /// Largest recorded `|a/a0 - 1|`; `None` for SP.
    pub area_error_max: Option<f64>,
    /// Largest recorded overlap with an obstacle, in sigma.
    pub overlap_max: f64,
    /// Largest rise of the total energy above its lowest earlier value; only round-off and O(dt^2) in a stable run.
    pub energy_rise_max: f64,
    /// Lowest E_k/E_t at any check after the start.
    pub ek_ratio_min: f64,
    /// When an obstacle was first seen inside the ring, in t0. Such a run goes on only if the campaign says
    /// `engulfed = "record"`; otherwise it fails.
    pub engulfed_t: Option<f64>,
    /// How many stretches of Verlet steps, or implicit steps, were refused and taken again in smaller steps.
    pub refused: u64,
    /// How deep the droplet sank on the plate, in sigma; `None` in other scenes.
    pub delta_s: Option<f64>,
    /// Time steps taken.
    pub steps: u64,
    /// The clog, if the run ended in one.
    pub clog: Option<Clog>,
    /// The equilibrium that lies ahead, if the simulated time ran out just before it.
    pub arrest: Option<Arrest>,
    /// The film that closed, if the run ended with that.
    pub pinch: Option<Pinch>,
    /// Recorded time series.
    pub samples: Samples,
    /// Kept outlines, by time; the last one is that at the end.
    pub outlines: Vec<Outline>,
}

impl Trajectory {
    /// Whether the time ran out on a droplet that was slower than V_t/100, and at no equilibrium that is known: it may
    /// creep on, or come to rest later.
    pub fn creeps(&self) -> bool {
        let slow = |v_g: &f64| v_g.abs() < CREEPING;
        self.outcome == Outcome::TimeLimit && self.arrest.is_none() && self.samples.v_g.last().is_some_and(slow)
    }
}

/// The state of a droplet at the moment it counts as clogged.
#[derive(Clone, Debug, PartialEq)]
pub struct Clog {
    /// Time, in t0.
    pub t: f64,
    /// Displacement along +x, in sigma.
    pub r: f64,
    /// Unwrapped centroid, x.
    pub x: f64,
    /// Unwrapped centroid, y.
    pub y: f64,
    /// E_k/E_t.
    pub ek_ratio: f64,
    /// Shape parameter A; `None` for SP.
    pub shape: Option<f64>,
    /// Number of obstacles that carry load.
    pub contacts: u32,
    /// How the clog holds; `None` if nothing pushes against gravity.
    pub mechanism: Option<Mechanism>,
}

/// The equilibrium of a droplet that was arrested when its simulated time ran out: at rest, or nearly so, but not yet
/// below the threshold of a clog.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrest {
    /// Displacement of the equilibrium along +x, in sigma.
    pub r: f64,
    /// Its unwrapped centroid, x.
    pub x: f64,
    /// Its unwrapped centroid, y.
    pub y: f64,
    /// The way that the centroid had left to it, in sigma.
    pub way_left: f64,
    /// The energy that the droplet had left to lose, in M g sigma.
    pub energy_left: f64,
}

/// Where a film of the droplet closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinch {
    /// Unwrapped x, in sigma.
    pub x: f64,
    /// Unwrapped y, in sigma.
    pub y: f64,
}

/// How a clog holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Mechanism {
    /// One obstacle carries most of the load and the ring bends round it.
    Wrap,
    /// Two obstacles on either side of a throat carry it.
    Squeeze,
    /// Any other clog.
    Hybrid,
}

/// Recorded time series, one column for each quantity, all of one length. Units: t0, sigma, V_t.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Samples {
    /// Time.
    pub t: Vec<f64>,
    /// Displacement along +x since gravity came on.
    pub r: Vec<f64>,
    /// x of the centroid, unwrapped.
    pub h: Vec<f64>,
    /// y of the centroid, unwrapped.
    pub y: Vec<f64>,
    /// Velocity of the centroid along +x, in units of V_t.
    pub v_g: Vec<f64>,
    /// E_k/E_t.
    pub ek_ratio: Vec<f64>,
    /// Shape parameter A; empty for SP.
    pub shape: Vec<f64>,
    /// a/a0 - 1; empty for SP.
    pub area_error: Vec<f64>,
}

/// Why a run could not be finished.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}: {reason} (step {step})", class.name())]
pub struct Failure {
    /// The kind of failure.
    pub class: FailureClass,
    /// What happened, in a sentence.
    pub reason: String,
    /// The time step at which it was noticed.
    pub step: u64,
    /// The last sound outline of the droplet, if there was one.
    pub outline: Option<Box<Outline>>,
}

/// Kinds of failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum FailureClass {
    /// Numbers left the range that physics allows.
    Unstable,
    /// An obstacle came to lie inside the ring.
    Engulfed,
    /// The ring crossed itself.
    Crossed,
    /// The program panicked.
    Panicked,
    /// Reading or writing failed.
    Io,
    /// The job cannot be started as asked.
    BadInput,
}

names!(pub Outcome {
    Clogged = "clogged", TimeLimit = "time_limit", Distance = "distance", Exited = "exited", Settled = "settled",
    Pinched = "pinched",
});
names!(pub Mechanism { Wrap = "wrap", Squeeze = "squeeze", Hybrid = "hybrid" });
names!(pub FailureClass {
    Unstable = "unstable", Engulfed = "engulfed", Crossed = "crossed",
    Panicked = "panicked", Io = "io", BadInput = "bad_input",
});

impl Samples {
    /// Number of recorded instants.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Leaves the first `len` instants.
    pub fn truncate(&mut self, len: usize) {
        let Self { t, r, h, y, v_g, ek_ratio, shape, area_error } = self;
        for column in [t, r, h, y, v_g, ek_ratio, shape, area_error] {
            column.truncate(len);
        }
    }

    /// Whether nothing was recorded.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

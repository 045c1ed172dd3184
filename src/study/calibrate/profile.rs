//! Profiles of simulated droplets, and the laboratory that computes them.

use crate::campaign::choose::stepping;
use crate::parameters::{IntegratorChoice, Job, Limits, Model, Point, Scene};
use crate::physics::simd::best_instruction_set;
use crate::physics::simulate::{Context, simulate, stability::StabilityLimit};
use crate::physics::walls::arrays::library::ArrayLibrary;
use crate::results::trajectory::{Failure, Samples};
use crate::study::calibrate::frames::Trial;
use std::collections::HashMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

/// Time between two samples of a profile, in t0. At twice V_t the droplet moves 0.02 sigma in this time.
const SAMPLE_EVERY: f64 = 0.25;

/// E_k/E_t below which a droplet counts as stuck. At this speed, 1e-5 V_t, a thousandth of sigma takes 3000 t0.
const STUCK: f64 = 1e-10;

/// A simulated passage ends after this many times the duration of the experiment.
const PATIENCE: f64 = 2.0;

/// For the duration of an experiment, slower frames are taken to have this speed, in V_t.
const SLOWEST: f64 = 1e-3;

/// Room before the first contact, before the first frame, and after the last frame, in sigma.
const ROOM: [f64; 3] = [0.5, 0.25, 0.05];

/// The parameters that are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Line tension Gamma, in `g rho sigma^2`.
    pub gamma: f64,
    /// Near-wall drag b0/b_inf.
    pub b0: f64,
}

/// Speed and shape of a simulated droplet against the position of its centroid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// Position of the centroid, in sigma, in increasing order.
    pub h: Vec<f64>,
    /// Speed, in V_t.
    pub v_g: Vec<f64>,
    /// Shape parameter A.
    pub shape: Vec<f64>,
}

impl Profile {
    /// The samples that lie further than all earlier ones: a droplet that trembles has many speeds at one place.
    pub(crate) fn of(samples: &Samples) -> Self {
        let mut profile = Self::default();
        for ((&h, &v_g), &shape) in samples.h.iter().zip(&samples.v_g).zip(&samples.shape) {
            if h > profile.reach() {
                profile.h.push(h);
                profile.v_g.push(v_g);
                profile.shape.push(shape);
            }
        }
        profile
    }

    /// The farthest position that the droplet reached.
    pub(super) fn reach(&self) -> f64 {
        self.h.last().copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// Speed and shape at `h`, linear between samples; `None` where the droplet never was.
    pub fn at(&self, h: f64) -> Option<[f64; 2]> {
        let after = self.h.partition_point(|&at| at < h);
        let before = after.checked_sub(1).or_else(|| (self.h.first() == Some(&h)).then_some(0))?;
        let after = (after < self.h.len()).then_some(after)?;
        let span = self.h[after] - self.h[before];
        let share = if span > 0.0 { (h - self.h[before]) / span } else { 0.0 };
        Some([&self.v_g, &self.shape].map(|column| column[before] + share * (column[after] - column[before])))
    }
}

/// Profiles by the bits of gamma and b0.
type Known = HashMap<[u64; 2], Result<Arc<Profile>, Failure>>;

/// A channel in which droplets of any parameters can be simulated; every profile is computed once.
pub struct Laboratory<'w> {
    template: Point,
    known: Mutex<Known>,
    arrays: ArrayLibrary,
    stop: AtomicBool,
    watch: &'w (dyn Fn(usize) + Sync),
}

impl<'w> Laboratory<'w> {
    /// A channel as in `template`, with ends and time limit that follow from the frames. `watch` is called with the
    /// number of simulations so far, whenever one ends.
    ///
    /// The droplet starts half a diameter before it can touch the wedges, or a quarter before the first frame if that
    /// is earlier. It forgets its start over a distance of V_t^2, so a longer way would change nothing.
    pub fn new(mut template: Point, trials: &[Trial], watch: &'w (dyn Fn(usize) + Sync)) -> Self {
        let ends = |[low, high]: [f64; 2], [first, last]: [f64; 2]| [low.min(first), high.max(last)];
        let [first, last] = trials.iter().map(Trial::range).fold([f64::INFINITY, f64::NEG_INFINITY], ends);
        if let Scene::Channel(channel) = &mut template.scene {
            channel.h_start = (channel.first_contact(0.5) - ROOM[0]).min(first - ROOM[1]);
            channel.h_end = last + ROOM[2];
            let way_there = (first - channel.h_start) / template.v_t;
            let longest = trials.iter().map(|trial| passage_time(trial, template.v_t)).fold(0.0, f64::max);
            template.limits = Limits { t_max: PATIENCE * (way_there + longest), distance: None, ek_threshold: STUCK };
        }
        template.sample_every = SAMPLE_EVERY;
        let known = Mutex::new(HashMap::new());
        Self { template, known, arrays: ArrayLibrary::default(), stop: AtomicBool::new(false), watch }
    }

    /// Where droplets start and end, in sigma.
    pub(super) fn window(&self) -> [f64; 2] {
        match &self.template.scene {
            Scene::Channel(channel) => [channel.h_start, channel.h_end],
            Scene::Obstacles(_) | Scene::Plate | Scene::Disc(_) => [0.0; 2],
        }
    }

    fn point(&self, parameters: Parameters) -> Point {
        let mut point = Point { b0: parameters.b0, ..self.template.clone() };
        if let Model::Deformable(ring) = &mut point.model {
            ring.gamma = parameters.gamma;
        }
        let limit = StabilityLimit::of(&point);
        point.stepping = stepping::choose(IntegratorChoice::Auto, None, &point, &limit);
        point
    }

    /// The profile of a droplet with these parameters.
    ///
    /// # Errors
    /// The [`Failure`] of the simulation.
    pub fn profile(&self, parameters: Parameters) -> Result<Arc<Profile>, Failure> {
        let key = [parameters.gamma.to_bits(), parameters.b0.to_bits()];
        if let Some(known) = self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return known.clone();
        }
        let point = Arc::new(self.point(parameters));
        let job = Job { point_id: point.id(), point, seed: 0 };
        let context = Context { arrays: &self.arrays, instruction_set: best_instruction_set(), stop: &self.stop };
        let profile = simulate(&job, context).map(|trajectory| {
            Arc::new(trajectory.map(|trajectory| Profile::of(&trajectory.samples)).unwrap_or_default())
        });
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(key, profile.clone());
        (self.watch)(known.len());
        profile
    }

    /// How many profiles were computed, and how many of these simulations failed.
    pub(super) fn count(&self) -> [usize; 2] {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        [known.len(), known.values().filter(|profile| profile.is_err()).count()]
    }
}

/// Time from the first frame to the last, `int dh/v_g` by the trapezoidal rule, in t0.
fn passage_time(trial: &Trial, v_t: f64) -> f64 {
    let mut frames: Vec<[f64; 2]> = trial.frames.iter().map(|frame| [frame.h, frame.v_g.max(SLOWEST)]).collect();
    frames.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let step = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]) * 0.5 * (1.0 / pair[0][1] + 1.0 / pair[1][1]) / v_t;
    frames.windows(2).map(step).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Channel;

    #[test]
    fn a_profile_is_linear_between_samples_and_nothing_beyond_them() {
        let samples = Samples {
            h: vec![-1.0, -0.5, -0.6, -0.5, 0.0],
            v_g: vec![0.0, 1.0, -3.0, 9.0, 0.5],
            shape: vec![1.0, 1.0, 1.0, 1.0, 1.2],
            ..Samples::default()
        };
        let profile = Profile::of(&samples);
        assert_eq!((profile.h.len(), profile.reach()), (3, 0.0));
        assert_eq!(profile.at(-1.0), Some([0.0, 1.0]));
        assert_eq!(profile.at(-0.25), Some([0.75, 1.1]));
        assert_eq!(profile.at(0.0), Some([0.5, 1.2]));
        assert_eq!((profile.at(-1.1), profile.at(0.01)), (None, None));
    }

    #[test]
    fn a_circle_touches_the_wedges_where_geometry_says() {
        let channel = Channel { w: 0.7, angle: 45.0, tip_radius: 0.0, h_start: -10.0, h_end: 3.0 };
        let h = channel.first_contact(0.5);
        assert!(((0.35 - h) * std::f64::consts::FRAC_1_SQRT_2 - 0.5).abs() < 1e-12, "{h}");
        assert_eq!(Channel { w: 3.0, ..channel }.first_contact(0.5), 0.0);
    }
}

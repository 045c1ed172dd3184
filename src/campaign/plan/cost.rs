//! What jobs cost: the number of time steps times the measured duration of a step.

use crate::campaign::choose::stepping::{NEWTON_STEPS, adaptive_s_per_t0, folds};
use crate::campaign::file::Block;
use crate::parameters::{Integrator, Model, Point};

/// Typical mean speed of a droplet that does not clog, in V_t. It turns a distance into a time.
pub(super) const FLOWING_SPEED: f64 = 0.7;

/// By what factor a step takes longer for a droplet that folds back on itself: 1.1 at Gamma = 0.1, 1.7 at 0.03, 2 at
/// 0.01.
const FOLDED: f64 = 1.5;

/// How fast one thread of this machine is. The default stands for an unknown speed and makes every estimate zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Speed {
    /// Nanoseconds per vertex and Verlet step of a deformable particle.
    pub deformable_ns_per_vertex_step: f64,
    /// Nanoseconds per vertex and Newton step of its implicit integrator.
    pub implicit_ns_per_vertex_newton: f64,
    /// Nanoseconds per step of a soft particle.
    pub soft_ns_per_step: f64,
}

impl Speed {
    /// Expected CPU time of one job, in seconds: `T/dt` steps with `T = min(t_max, distance/(0.7 V_t))`, or `t_max` if
    /// no distance is set. A droplet that clogs ends earlier.
    pub(crate) fn expected_s(&self, point: &Point) -> f64 {
        let way = point.limits.distance.map(|distance| distance / (FLOWING_SPEED * point.v_t));
        let steps = way.map_or(point.limits.t_max, |time| time.min(point.limits.t_max)) / point.stepping.dt;
        if let (Model::Deformable(ring), Integrator::Adaptive) = (&point.model, point.stepping.integrator) {
            let known = self.implicit_ns_per_vertex_newton > 0.0;
            return if known { steps * point.stepping.dt * adaptive_s_per_t0(ring.n_vertices) } else { 0.0 };
        }
        let ns_per_step = match &point.model {
            Model::Deformable(ring) => {
                let per_vertex = match point.stepping.integrator {
                    Integrator::Verlet => self.deformable_ns_per_vertex_step,
                    Integrator::Implicit | Integrator::Adaptive => NEWTON_STEPS * self.implicit_ns_per_vertex_newton,
                };
                ring.n_vertices as f64 * per_vertex * if folds(ring) { FOLDED } else { 1.0 }
            }
            Model::Soft(_) => self.soft_ns_per_step,
        };
        steps * ns_per_step * 1e-9
    }
}

/// The expected cost of the jobs of a block that are to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// How many jobs.
    pub jobs: u64,
    /// CPU time of all jobs, in seconds.
    pub total_s: f64,
    /// CPU time of the longest job, in seconds.
    pub longest_s: f64,
    /// Whether every point sets a distance; if not, the estimate is an upper bound.
    pub by_distance: bool,
}

impl Cost {
    pub(super) fn none_of(block: &Block) -> Self {
        let by_distance = block.points.iter().all(|point| point.limits.distance.is_some());
        Self { jobs: 0, total_s: 0.0, longest_s: 0.0, by_distance }
    }

    pub(super) fn add(&mut self, expected_s: f64) {
        self.jobs += 1;
        self.total_s += expected_s;
        self.longest_s = self.longest_s.max(expected_s);
    }

    /// Mean CPU time of a job, in seconds; `None` if there is no job.
    pub(crate) fn mean_s(&self) -> Option<f64> {
        (self.jobs > 0).then(|| self.total_s / self.jobs as f64)
    }

    /// Wall time on this many threads, in seconds: an equal share of all, but at least the longest job.
    pub fn wall_s(&self, threads: usize) -> f64 {
        (self.total_s / threads.max(1) as f64).max(self.longest_s)
    }

    pub(super) fn and(self, other: Self) -> Self {
        Self {
            jobs: self.jobs + other.jobs,
            total_s: self.total_s + other.total_s,
            longest_s: self.longest_s.max(other.longest_s),
            by_distance: self.by_distance && other.by_distance,
        }
    }
}

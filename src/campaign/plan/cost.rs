//! What jobs cost: what is expected of a run ([`Expectation`]), times the measured duration of a step.
//!
//! Steps of fixed length cost the same whatever happens. Steps that follow their error follow the events of a run, so their
//! cost goes with the way of the droplet and not with time. It was measured in campaigns, in Newton steps of the ring of
//! springs, because the duration of these is measured on each machine.

use crate::campaign::choose::stepping::{NEWTON_STEPS, folded, folded_steps};
use crate::campaign::file::Block;
use crate::campaign::plan::expectation::Expectation;
use crate::parameters::{Deformable, Dynamics, Integrator, Model, Point, Scene};

/// By what factor a step of Verlet takes longer among obstacles than the measured one, which leans on two discs.
const AMONG_OBSTACLES: f64 = 3.0;

/// By what factor it takes longer with near-wall drag.
const NEAR_WALLS: f64 = 3.0;

/// By what factor Verlet's step takes longer for a droplet that folds back on itself, and for one that lies in films.
const FOLDED: [f64; 2] = [1.2, 2.0];

/// A soft particle touches nothing for much of the time, so that its steps take this share of the measured one.
const FREE: f64 = 0.7;

/// How many Verlet steps take as long as one t0 of a soft particle whose steps follow their error.
const SOFT_ADAPTIVE: f64 = 150.0;

/// What one sigma of the way of a ring of springs costs among obstacles of density 0.39, in Newton steps: 390 to 450.
const A_SIGMA: f64 = 420.0;

/// With which power of the density it grows.
const OF_DENSITY: f64 = 1.7;

/// What its rest after an arrest costs, in Newton steps.
const A_REST: f64 = 3000.0;

/// What the passage of a ring of 256 vertices through an orifice costs, in Newton steps; it goes with N_v.
const A_PASSAGE: f64 = 30_000.0;

/// By what factor steps that follow their error cost more with near-wall drag.
const DRAGGED: f64 = 3.0;

/// Nanoseconds per vertex and Newton step of the machine on which the cost of the liquid was measured.
const MEASURED_AT: f64 = 11.0;

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
    /// Expected CPU time of one job, in seconds.
    pub(crate) fn expected_s(&self, point: &Point) -> f64 {
        let expected = Expectation::of(point);
        let steps = expected.time / point.stepping.dt;
        let ns = match (&point.model, point.stepping.integrator) {
            (Model::Soft(_), Integrator::Adaptive) => SOFT_ADAPTIVE * expected.time * self.soft_ns_per_step,
            (Model::Soft(_), _) => FREE * steps * self.soft_ns_per_step,
            (Model::Deformable(ring), Integrator::Adaptive) => self.adaptive_ns(ring, point, expected),
            (Model::Deformable(ring), integrator) => {
                let per_vertex = match integrator {
                    Integrator::Verlet => AMONG_OBSTACLES * self.deformable_ns_per_vertex_step,
                    _ => NEWTON_STEPS * self.implicit_ns_per_vertex_newton,
                };
                let folded = folded(ring, FOLDED);
                let near_walls = if point.b0 > 0.0 { NEAR_WALLS } else { 1.0 };
                steps * ring.n_vertices as f64 * per_vertex * folded * near_walls
            }
        };
        1e-9 * ns
    }

    /// The cost of steps that follow their error.
    fn adaptive_ns(&self, ring: &Deformable, point: &Point, Expectation { way, rests, .. }: Expectation) -> f64 {
        let (n, is_orifice) = (ring.n_vertices as f64, matches!(point.scene, Scene::Channel(_)));
        if ring.dynamics == Dynamics::Darcy {
            // Matrices are dense: their filling goes with n, their factors with n^3.
            let a_sigma_ms = 0.067 * n + 1.4e-5 * n * n * n;
            let passages = if is_orifice { 5.0 } else { 0.0 };
            return 1e6 * a_sigma_ms * (way + rests + passages) * self.implicit_ns_per_vertex_newton / MEASURED_AT;
        }
        let dragged = if point.b0 > 0.0 { DRAGGED } else { 1.0 };
        let passage = if is_orifice { A_PASSAGE * n / 256.0 } else { 0.0 };
        let crowded = match &point.scene {
            Scene::Obstacles(field) => libm::pow((field.number_density() / 0.39).max(1.0), OF_DENSITY),
            Scene::Channel(_) | Scene::Disc(_) | Scene::Plate => 1.0,
        };
        let steps = dragged * (A_SIGMA * way * crowded * folded_steps(ring) + passage) + A_REST * rests;
        steps * n * self.implicit_ns_per_vertex_newton
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
    /// Whether every point sets a distance.
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

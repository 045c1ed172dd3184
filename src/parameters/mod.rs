//! What a job is: a fully resolved grid point, a seed, and the identity both give it.
//!
//! A [`Point`] holds everything that decides a trajectory except the seed. Its JSON form is canonical (fixed field
//! order, shortest round-trip floats), so its hash is the identity of the grid point. A field added later must carry
//! `#[serde(default, skip_serializing_if = ...)]` with the value that means "as before": old points keep their
//! hashes, and nothing is computed twice.

mod choices;
mod identity;
mod scenes;

pub use choices::{ContactKind, Engulfed, GravityForm, IntegratorChoice, SelfContact, WallStiffness};
pub use identity::{BadId, JobId, PointId};
pub use scenes::{Channel, Density, LoneDisc, ObstacleField, Scene};

use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Raised whenever the same job would give different numbers; results of older versions then count as stale.
pub const PHYSICS_VERSION: u32 = 4;

/// Mass of the droplet, `M = rho a0 = pi/4`.
pub const MASS: f64 = std::f64::consts::FRAC_PI_4;

/// One grid point: everything that decides a trajectory except the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The droplet.
    pub model: Model,
    /// Where it moves.
    pub scene: Scene,
    /// Terminal speed of the free droplet, `V_t = M/b_inf`, in `sqrt(g sigma)`.
    pub v_t: f64,
    /// Strength of the near-wall drag, `b0/b_inf` ([C24] eq. 6); zero switches it off.
    #[serde(default, skip_serializing_if = "is_default")]
    pub b0: f64,
    /// Exponent of the near-wall drag; the paper's 4/3 unless said otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// How time advances.
    pub stepping: Stepping,
    /// When a run ends.
    pub limits: Limits,
    /// Time between two recorded samples, in t0.
    pub sample_every: f64,
    /// Time between two kept shapes, in t0; `None` keeps the last alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shapes_every: Option<f64>,
}

/// The two droplet models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Model {
    /// Deformable particle: a ring of vertices with line tension ([C24] eqs 1-4).
    #[serde(rename = "DP")]
    Deformable(Deformable),
    /// Soft particle: one point ([C24] eqs 8-11).
    #[serde(rename = "SP")]
    Soft(Soft),
}

/// The `kappa` of the source paper.
pub const PAPER_KAPPA: f64 = 1e-3;

/// Parameters of the deformable particle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deformable {
    /// Line tension Gamma, in `g rho sigma^2`.
    pub gamma: f64,
    /// Perimeter stiffness over line tension, `kappa = K_l/Gamma`.
    pub kappa: f64,
    /// Area stiffness K_a.
    pub k_a: f64,
    /// Number of vertices N_v.
    pub n_vertices: usize,
    /// Wall stiffness E_w shared by all edges: `k_w = E_w/N_v`.
    pub e_w: f64,
    /// Vertex diameter delta: an edge touches a wall nearer than `delta/2`.
    pub delta: f64,
    /// Smoothing of the edge length, `eps/l0`.
    pub eps: f64,
    /// What E_w means.
    #[serde(default, skip_serializing_if = "is_default")]
    pub wall: WallStiffness,
    /// What of the ring touches walls.
    #[serde(default, skip_serializing_if = "is_default")]
    pub contact: ContactKind,
    /// How gravity acts on the ring.
    #[serde(default, skip_serializing_if = "is_default")]
    pub gravity: GravityForm,
    /// Whether the ring repels itself where it folds back.
    #[serde(default, skip_serializing_if = "is_default")]
    pub self_contact: SelfContact,
    /// What happens when an obstacle comes to lie inside the ring.
    #[serde(default, skip_serializing_if = "is_default")]
    pub engulfed: Engulfed,
}

/// Whether a field has the value that means "as before the field was there".
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Deformable {
    /// The droplet of line tension `gamma`, all else at its default: N_v = 256, kappa = 1e-3, K_a = 1e4, delta = pi/256.
    pub fn of_tension(gamma: f64) -> Self {
        Self {
            gamma,
            kappa: PAPER_KAPPA,
            k_a: 1e4,
            n_vertices: 256,
            e_w: 1e4,
            delta: std::f64::consts::PI / 256.0,
            eps: 0.1,
            wall: WallStiffness::default(),
            contact: ContactKind::default(),
            gravity: GravityForm::default(),
            self_contact: SelfContact::default(),
            engulfed: Engulfed::default(),
        }
    }

    /// The kappa at which tension and perimeter add up to one linear spring, `1/(N_v l0)`, about 1/pi ([`crate::physics::ring::forces::tension::EdgeTension::Linear`]).
    pub fn linear_kappa(&self) -> f64 {
        1.0 / (self.n_vertices as f64 * regular_edge(self.n_vertices))
    }

    /// Stiffness of each edge against walls, k_w.
    pub fn k_w(&self) -> f64 {
        match self.wall {
            WallStiffness::Total => self.e_w / self.n_vertices as f64,
            WallStiffness::PerVertex => 4.0 * self.e_w / (self.delta * self.delta),
        }
    }
}

/// Parameters of the soft particle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Soft {
    /// Stiffness E_w of the contact with an obstacle.
    pub e_w: f64,
}

/// How time advances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stepping {
    /// The integrator.
    pub integrator: Integrator,
    /// Time step, in t0.
    pub dt: f64,
}

/// The integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Integrator {
    /// Modified velocity-Verlet with implicit drag.
    #[serde(rename = "verlet")]
    Verlet,
    /// Implicit backward differences of second order; of the deformable particle alone.
    #[serde(rename = "implicit")]
    Implicit,
}

/// When a run ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limits {
    /// Longest simulated time, in t0.
    pub t_max: f64,
    /// Displacement along +x after which the run ends, in sigma.
    pub distance: Option<f64>,
    /// A droplet that has once moved is clogged when E_k/E_t falls below this ([C24] App. C).
    pub ek_threshold: f64,
}

/// One trajectory to compute: a grid point and a seed.
#[derive(Clone, Debug)]
pub struct Job {
    /// The grid point, shared by all its runs.
    pub point: Arc<Point>,
    /// Identity of the point.
    pub point_id: PointId,
    /// Seed of every random choice of this run.
    pub seed: u64,
}

/// Where a job stands in a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JobState {
    /// Known, waiting to run.
    Pending,
    /// Taken by a worker.
    Running,
    /// Finished, with a trajectory.
    Done,
    /// Ended in a failure that is kept with its class and reason.
    Failed,
}

impl Point {
    /// A droplet in a scene, all else as a campaign has it by default: V_t = 0.03 without near-wall drag, to a clog or T = 2e5, a sample
    /// every 10 t0. Its steps are Verlet's, of 1e-3; a campaign chooses them ([`crate::campaign::choose::stepping`]).
    pub fn new(model: Model, scene: Scene) -> Self {
        Self {
            model,
            scene,
            v_t: 0.03,
            b0: 0.0,
            alpha: None,
            stepping: Stepping { integrator: Integrator::Verlet, dt: 1e-3 },
            limits: Limits { t_max: 2e5, distance: None, ek_threshold: 1e-17 },
            sample_every: 10.0,
            shapes_every: None,
        }
    }

    /// The canonical text of this point, the one that is hashed and stored.
    ///
    /// Numbers must be finite, which a validated campaign guarantees; JSON writes others as `null`.
    pub fn canonical(&self) -> String {
        serde_json::to_string(self).expect("a point holds only plain numbers and names")
    }

    /// Identity of this grid point.
    pub fn id(&self) -> PointId {
        PointId::of_canonical(&self.canonical())
    }
}

impl Job {
    /// Identity of this job, under the current [`PHYSICS_VERSION`].
    pub fn id(&self) -> JobId {
        JobId::new(self.point_id, self.seed)
    }
}

impl JobState {
    /// The name used in the column `state`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pending => "pending",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
        }
    }

    /// The state of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Pending, Self::Running, Self::Done, Self::Failed].into_iter().find(|state| state.name() == name)
    }
}

impl Model {
    /// `DP` or `SP`, as in the column `model`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Deformable(_) => "DP",
            Self::Soft(_) => "SP",
        }
    }
}

impl Integrator {
    /// The name of the integrator, as in the column `integrator`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Verlet => "verlet",
            Self::Implicit => "implicit",
        }
    }
}

/// Edge length of the regular ring of area `a0 = pi/4`, `l0 = sqrt(4 a0 N_v tan(pi/N_v))/N_v`.
///
/// ```
/// // N_v l0 tends to the circumference pi.
/// assert!((1024.0 * meniscus::parameters::regular_edge(1024) - std::f64::consts::PI).abs() < 1e-5);
/// ```
pub fn regular_edge(n_vertices: usize) -> f64 {
    let n = n_vertices as f64;
    let tan = libm::tan(std::f64::consts::PI / n);
    (4.0 * MASS * n * tan).sqrt() / n
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point() -> Point {
        let density = Density::Number(0.35);
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density, box_size: 500.0 };
        Point::new(Model::Soft(Soft { e_w: 10.0 }), Scene::Obstacles(field))
    }

    #[test]
    fn a_point_survives_its_canonical_form() {
        let text = point().canonical();
        let back: Point = serde_json::from_str(&text).unwrap();
        assert_eq!(back, point());
        assert_eq!(back.canonical(), text);
    }

    #[test]
    fn identities_differ_with_any_parameter_and_with_the_seed() {
        let mut other = point();
        other.v_t = 0.030_000_000_000_000_002;
        assert_ne!(point().id(), other.id());
        assert_ne!(JobId::new(point().id(), 0), JobId::new(point().id(), 1));
    }

    #[test]
    fn a_state_reads_back_from_its_name() {
        for name in ["pending", "running", "done", "failed"] {
            assert_eq!(JobState::from_name(name).map(JobState::name), Some(name));
        }
        assert_eq!(JobState::from_name("lost"), None);
    }

    #[test]
    fn an_id_reads_back_from_its_text() {
        let id = JobId::new(point().id(), 7);
        assert_eq!(id.to_string().len(), 20);
        assert_eq!(id.to_string().parse::<JobId>().unwrap(), id);
        assert!("12".parse::<JobId>().is_err());
        assert!("+0000000000000000001".parse::<JobId>().is_err());
    }
}

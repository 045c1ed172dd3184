//! What a job is: a fully resolved grid point, a seed, and the identity both give it.
//!
//! A [`Point`] holds everything that decides a trajectory except the seed. Its JSON form is canonical (fixed field
//! order, shortest round-trip floats), so its hash is the identity of the grid point. A field added later must carry
//! `#[serde(default, skip_serializing_if = ...)]` with the value that means "as before": old points keep their
//! hashes, and nothing is computed twice.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Raised whenever the same job would give different numbers; results of older versions then count as stale.
pub const PHYSICS_VERSION: u32 = 1;

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
}

/// Parameters of the soft particle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Soft {
    /// Stiffness E_w of the contact with an obstacle.
    pub e_w: f64,
}

/// The geometry a droplet moves in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Scene {
    /// Discs at random in a periodic box.
    #[serde(rename = "obstacles")]
    Obstacles(ObstacleField),
}

/// A periodic box of discs placed by random sequential addition; with the seed it names one array.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObstacleField {
    /// Smallest gap between two disc surfaces.
    pub w_ob: f64,
    /// Diameter of a disc.
    pub sigma_ob: f64,
    /// How many discs.
    pub density: Density,
    /// Side L of the periodic box.
    pub box_size: f64,
}

/// How full an obstacle array is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Density {
    /// Until no further disc fits.
    #[serde(rename = "saturated")]
    Saturated,
    /// So many discs per sigma^2.
    #[serde(rename = "number")]
    Number(f64),
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

/// Identity of a grid point: 80 bits of the hash of its canonical form, written as 20 hex digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PointId(u128);

/// Identity of a job: 80 bits of the hash of point, seed and physics version, written as 20 hex digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct JobId(u128);

/// The first 80 bits of a blake3 hash; a million ids collide with probability 4e-13.
fn first_80_bits(hash: blake3::Hash) -> u128 {
    let mut wide = [0_u8; 16];
    wide[6..].copy_from_slice(&hash.as_bytes()[..10]);
    u128::from_be_bytes(wide)
}

impl Point {
    /// The canonical text of this point, the one that is hashed and stored.
    ///
    /// Numbers must be finite, which a validated campaign guarantees; JSON writes others as `null`.
    pub fn canonical(&self) -> String {
        serde_json::to_string(self).expect("a point holds only plain numbers and names")
    }

    /// Identity of this grid point.
    pub fn id(&self) -> PointId {
        PointId(first_80_bits(blake3::hash(self.canonical().as_bytes())))
    }
}

impl Job {
    /// Identity of this job, under the current [`PHYSICS_VERSION`].
    pub fn id(&self) -> JobId {
        JobId::new(self.point_id, self.seed)
    }
}

impl JobId {
    /// Identity of the run `seed` of a grid point, under the current [`PHYSICS_VERSION`].
    pub fn new(point: PointId, seed: u64) -> Self {
        let mut bytes = [0_u8; 28];
        bytes[..16].copy_from_slice(&point.0.to_be_bytes());
        bytes[16..24].copy_from_slice(&seed.to_be_bytes());
        bytes[24..].copy_from_slice(&PHYSICS_VERSION.to_be_bytes());
        Self(first_80_bits(blake3::hash(&bytes)))
    }
}

/// A text that is not 20 hex digits.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` is no id: an id has 20 hexadecimal digits (see the column job_id of `runs`)")]
pub struct BadId(String);

macro_rules! hex_id {
    ($id:ident) => {
        impl fmt::Display for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{:020x}", self.0)
            }
        }
        impl fmt::Debug for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }
        impl FromStr for $id {
            type Err = BadId;
            fn from_str(text: &str) -> Result<Self, BadId> {
                let digits = text.len() == 20 && text.bytes().all(|c| c.is_ascii_hexdigit());
                let value = u128::from_str_radix(text, 16).ok().filter(|_| digits);
                value.map(Self).ok_or_else(|| BadId(text.to_owned()))
            }
        }
    };
}
hex_id!(PointId);
hex_id!(JobId);

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

impl Scene {
    /// The name of the scene, as in the column `scene`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Obstacles(_) => "obstacles",
        }
    }
}

impl Integrator {
    /// The name of the integrator, as in the column `integrator`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Verlet => "verlet",
        }
    }
}

/// Edge length of the regular ring of area `a0 = pi/4`, `l0 = sqrt(4 a0 N_v tan(pi/N_v))/N_v`.
///
/// ```
/// // N_v l0 tends to the circumference pi.
/// assert!((1024.0 * meniscus::job::regular_edge(1024) - std::f64::consts::PI).abs() < 1e-5);
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
        Point {
            model: Model::Soft(Soft { e_w: 10.0 }),
            scene: Scene::Obstacles(ObstacleField {
                w_ob: 0.2,
                sigma_ob: 0.3,
                density: Density::Number(0.35),
                box_size: 500.0,
            }),
            v_t: 0.03,
            stepping: Stepping { integrator: Integrator::Verlet, dt: 1e-3 },
            limits: Limits { t_max: 2e5, distance: None, ek_threshold: 1e-17 },
            sample_every: 10.0,
            shapes_every: None,
        }
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

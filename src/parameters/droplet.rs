//! The two models of a droplet and their parameters.

use crate::parameters::point::is_default;
use crate::parameters::{ContactKind, Dynamics, Engulfed, GravityForm, SelfContact, WallStiffness, regular_edge};
use serde::{Deserialize, Serialize};

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

/// The default of `kappa`, perimeter stiffness over line tension, as in [C24].
pub(crate) const PAPER_KAPPA: f64 = 1e-3;

/// The default of `step_error`, in sigma.
pub(crate) const STEP_ERROR: f64 = 3e-4;

/// Most vertices of a ring.
pub(crate) const MOST_VERTICES: usize = 4096;

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
    /// Wall stiffness E_w.
    pub e_w: f64,
    /// Vertex diameter delta: an edge touches a wall nearer than `delta/2`.
    pub delta: f64,
    /// Smoothing of the edge length, `eps/l0`.
    pub eps: f64,
    /// Whether E_w is the stiffness of all edges together or of each.
    #[serde(default, skip_serializing_if = "is_default")]
    pub wall: WallStiffness,
    /// Which part of the ring touches walls.
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
    /// The laws by which it moves.
    #[serde(default, skip_serializing_if = "is_default")]
    pub dynamics: Dynamics,
    /// Largest error of a vertex along its normal in one step, in sigma; `None` is the default. Only for steps whose
    /// length follows their error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_error: Option<f64>,
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

impl Deformable {
    /// The droplet of line tension `gamma`; all other parameters have their defaults.
    ///
    /// ```
    /// let ring = meniscus::parameters::Deformable::of_tension(1.0);
    /// assert_eq!((ring.n_vertices, ring.k_w()), (256, 1e4 / 256.0));
    /// ```
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
            dynamics: Dynamics::default(),
            step_error: None,
        }
    }

    /// The kappa at which tension and perimeter add up to one linear spring: `1/(N_v l0)`, about 1/pi.
    pub(crate) fn linear_kappa(&self) -> f64 {
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

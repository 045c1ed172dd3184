//! The largest stable time step of Verlet, estimated term by term before a job starts.
//!
//! Velocity-Verlet is stable for `dt < 2/omega`, where omega is the highest frequency of the linearised forces. If
//! several terms act on a vertex, `omega^2 <= sum omega_term^2`.

use crate::parameters::{Deformable, MASS, Model, Point, SelfContact, regular_edge};
use crate::physics::ring::forces::self_contact::apart::Apart;

/// The step of [C24], and the largest that `dt = "auto"` takes.
pub(crate) const PAPER_DT: f64 = 1e-3;

/// Share of the stability limit that `dt = "auto"` takes at most.
pub(crate) const AUTO_SHARE: f64 = 0.8;

/// By what factor the area of a ring with uneven edges is stiffer than that of an even ring: `K_a sum (l_i +
/// l_{i+1})^2/(4 m)` over `4 pi K_a`, if three of four vertices crowd together. Without this factor, at K_a = 1e6 and
/// Gamma = 1.09, an eighth of the time had to be taken again in smaller steps.
const UNEVEN: f64 = 4.0;

/// Whether vertices of this ring pile up and repel each other.
pub(crate) fn vertices_pile_up(ring: &Deformable) -> bool {
    ring.self_contact == SelfContact::Auto && Apart::of(ring) == Apart::Places
}

/// The highest frequency that one force term can give a vertex.
#[derive(Clone, Debug, PartialEq)]
pub struct TermFrequency {
    /// The force term.
    pub term: &'static str,
    /// Its highest angular frequency, in 1/t0.
    pub omega: f64,
    /// What to change to lower it.
    pub remedy: &'static str,
}

/// The stability limit of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct StabilityLimit {
    /// Largest stable time step, `2/sqrt(sum omega^2)`, in t0.
    pub dt_max: f64,
    /// The terms, stiffest first.
    pub terms: Vec<TermFrequency>,
}

impl StabilityLimit {
    /// The limit of a grid point under Verlet; `point.stepping` is not read.
    pub fn of(point: &Point) -> Self {
        let mut terms = match &point.model {
            Model::Deformable(ring) => ring_terms(ring),
            Model::Soft(soft) => vec![TermFrequency {
                term: "wall",
                // At most four discs press on a point at once.
                omega: (4.0 * 4.0 * soft.e_w / MASS).sqrt(),
                remedy: "lower e_w",
            }],
        };
        terms.sort_by(|a, b| b.omega.total_cmp(&a.omega));
        let sum: f64 = terms.iter().map(|t| t.omega * t.omega).sum();
        Self { dt_max: 2.0 / sum.sqrt(), terms }
    }

    /// Verlet's step under `dt = "auto"`: the paper's 1e-3, or 0.8 of the limit if that is smaller.
    pub fn auto_dt(&self) -> f64 {
        PAPER_DT.min(AUTO_SHARE * self.dt_max)
    }
}

fn ring_terms(ring: &Deformable) -> Vec<TermFrequency> {
    let n = ring.n_vertices as f64;
    let vertex_mass = MASS / n;
    let eps = ring.eps * regular_edge(ring.n_vertices);
    let term = |term, omega, remedy| TermFrequency { term, omega, remedy };
    let tension = (4.0 * ring.gamma / (eps * vertex_mass)).sqrt();
    let area = (UNEVEN * 4.0 * std::f64::consts::PI * ring.k_a).sqrt();
    let wall = (2.0 * ring.k_w() / vertex_mass).sqrt();
    let mut terms = vec![
        term("tension", tension, "lower gamma or n_vertices, or raise eps"),
        term("area", area, "lower k_a"),
        term("wall", wall, "lower e_w, or take wall = \"total\""),
    ];
    if vertices_pile_up(ring) {
        // All vertices may stand on one edge, so the total stiffness N_v k counts.
        let omega = (Apart::Places.total_stiffness() / vertex_mass).sqrt();
        terms.push(term("self-contact", omega, "raise gamma, lower n_vertices, or take self_contact = \"off\""));
    }
    if ring.kappa > 0.0 {
        let omega = 2.0 * n * (ring.kappa * ring.gamma / MASS).sqrt();
        terms.push(term("perimeter", omega, "lower kappa or n_vertices"));
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Density, ObstacleField, Scene};

    fn point(gamma: f64) -> Point {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Saturated, box_size: 50.0 };
        Point::new(Model::Deformable(Deformable::of_tension(gamma)), Scene::Obstacles(field))
    }

    #[test]
    fn the_papers_step_is_stable_at_its_reference_and_too_large_at_gamma_10() {
        let reference = StabilityLimit::of(&point(1.09));
        assert!(reference.auto_dt() == PAPER_DT && reference.dt_max > PAPER_DT);
        let stiff = StabilityLimit::of(&point(10.0));
        assert!(stiff.dt_max < PAPER_DT && stiff.terms[0].term == "tension");
        assert!((stiff.auto_dt() - 4.78e-4).abs() < 1e-5);
    }

    #[test]
    fn frequencies_are_those_of_the_physics_notes() {
        let limit = StabilityLimit::of(&point(1.0));
        let omega = |term| limit.terms.iter().find(|t| t.term == term).unwrap().omega;
        assert!((omega("area") / UNEVEN.sqrt() - 354.0).abs() < 1.0);
        assert!((omega("wall") - 160.0).abs() < 1.0);
        assert!((omega("perimeter") - 18.0).abs() < 1.0);
    }
}

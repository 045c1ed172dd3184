//! How wrong the discretisation makes the decay length or the mean speed of a point, as far as that was measured.
//!
//! Of the ring of springs it is the error in the table of [`tolerance`](super::tolerance), the largest at this number of
//! vertices. It was measured at one tension in each kind of scene, and holds two standard errors of that measurement. Of the
//! liquid it is the difference of lambda from that of 256 vertices in common arrays; mean speeds were not measured.

use crate::campaign::choose::tolerance::{Kind, table};
use crate::parameters::{Dynamics, Model, Point};

/// The error of lambda of the liquid against 256 vertices, by the number of vertices: 200 arrays of density 0.7 at Gamma =
/// 1.09 (`campaigns/lambda_vertices.toml`; docs/physics.md).
const LIQUID: [(usize, f64); 3] = [(32, 0.003), (64, 0.002), (128, 0.002)];

/// The relative error of the headline number in scenes of the point's kind: lambda where arrays clog, the mean speed where
/// their gaps are as wide as a droplet. `None` if it was not measured.
pub(crate) fn discretisation_error(point: &Point) -> Option<(Kind, f64)> {
    let (Model::Deformable(ring), kind) = (&point.model, Kind::of(point)?) else { return None };
    let error = match (ring.dynamics, kind) {
        (Dynamics::Darcy, Kind::Clog) => {
            LIQUID.iter().find(|(n_vertices, _)| *n_vertices == ring.n_vertices).map(|(_, error)| *error)
        }
        (Dynamics::Darcy, _) => None,
        (Dynamics::Vertex, kind) => {
            let settings = table().kinds.get(&kind).map_or(&[][..], |measured| &measured.settings);
            let same = settings.iter().filter(|setting| setting.n_vertices == ring.n_vertices);
            same.map(|setting| setting.error).max_by(f64::total_cmp)
        }
    };
    Some((kind, error?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Deformable, Density, ObstacleField, Scene};

    fn point(w_ob: f64, dynamics: Dynamics, n_vertices: usize) -> Point {
        let array = ObstacleField { w_ob, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 60.0 };
        let ring = Deformable { n_vertices, dynamics, ..Deformable::of_tension(1.0) };
        Point::new(Model::Deformable(ring), Scene::Obstacles(array))
    }

    #[test]
    fn the_error_is_that_of_the_kind_of_scene_and_of_the_ring() {
        let error = |w_ob, dynamics, n| discretisation_error(&point(w_ob, dynamics, n)).map(|(_, error)| error);
        assert_eq!(error(0.2, Dynamics::Darcy, 64), Some(0.002));
        assert_eq!(error(0.2, Dynamics::Darcy, 65), None, "not measured");
        assert_eq!(error(1.0, Dynamics::Darcy, 64), None, "not measured");
        let [lambda, speed] = [0.2, 1.0].map(|w_ob| error(w_ob, Dynamics::Vertex, 256).unwrap());
        assert!(speed < 0.01 && lambda > 0.02, "{speed} {lambda}");
        assert!(error(0.2, Dynamics::Vertex, 64).unwrap() > lambda, "fewer vertices are further off");
    }
}

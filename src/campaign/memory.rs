//! The memory that a run takes at most: what it records until it ends, and the obstacles around it.

use crate::parameters::{Density, Dynamics, Model, ObstacleField, Point, Scene};

/// Bytes of a recorded sample: eight numbers of eight bytes.
const SAMPLE: f64 = 64.0;

/// Bytes of a vertex of a kept shape, and of what else a shape has.
const VERTEX: f64 = 16.0;
const SHAPE: f64 = 200.0;

/// Up to this share of the plane, covered by discs as wide as the spacing, darts are thrown at the whole box.
const SPARSE: f64 = 0.3;

/// What a run takes beside all that, in bytes: forces, lists, matrices.
const WORK: f64 = 1e6;

/// What a run records until it ends, in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RecordBytes {
    pub(crate) samples: f64,
    pub(crate) shapes: f64,
}

/// What a run of this point records if it goes on until `t_max`.
pub(crate) fn record_bytes(point: &Point) -> RecordBytes {
    let vertices = match &point.model {
        Model::Deformable(ring) => ring.n_vertices as f64,
        Model::Soft(_) => 1.0,
    };
    let times = |every: f64| point.limits.t_max / every + 2.0;
    let shapes = point.shapes_every.map_or(2.0, times);
    RecordBytes { samples: SAMPLE * times(point.sample_every), shapes: shapes * (SHAPE + VERTEX * vertices) }
}

/// What an array of obstacles takes while its discs are placed, in bytes. The discs of a saturated array are placed
/// where droplets come, so what it takes grows with their way; counted is a way of 1000 sigma.
pub(crate) fn array_bytes(field: &ObstacleField) -> f64 {
    let spacing = field.sigma_ob + field.w_ob;
    let cells = (field.box_size / (spacing * std::f64::consts::FRAC_1_SQRT_2) + 1.0).powi(2);
    match field.density {
        // A place for a disc in each cell while darts are thrown, the list of discs, and the discs sorted by place.
        Density::Number(density) => {
            let covered = density * std::f64::consts::FRAC_PI_4 * spacing * spacing;
            let cell = if covered < SPARSE { 16.2 } else { 64.0 };
            cell * cells + 40.0 * density * field.box_size * field.box_size
        }
        Density::Saturated => {
            let on_the_way = 1000.0 * 10.0 / (spacing * spacing);
            let most = field.box_size * field.box_size / (spacing * spacing);
            8.0 * cells / 1024.0 + 40.0 * on_the_way.min(most)
        }
    }
}

/// What a run of this point takes at most, in bytes. What it records is there three times while it is saved: as it is,
/// as the snapshot, and as the bytes of the file.
pub(crate) fn run_bytes(point: &Point) -> f64 {
    let array = match &point.scene {
        Scene::Obstacles(field) => array_bytes(field),
        Scene::Channel(_) | Scene::Disc(_) | Scene::Plate => 0.0,
    };
    let matrices = match &point.model {
        Model::Deformable(ring) if ring.dynamics == Dynamics::Darcy => 64.0 * (ring.n_vertices as f64).powi(2),
        Model::Deformable(_) | Model::Soft(_) => 0.0,
    };
    let record = record_bytes(point);
    array + matrices + 3.0 * (record.samples + record.shapes) + WORK
}

/// A number of bytes in words.
pub(crate) fn size(bytes: f64) -> String {
    match bytes {
        bytes if bytes >= 1e9 => format!("{:.1} GB", bytes / 1e9),
        bytes if bytes >= 1e6 => format!("{:.0} MB", bytes / 1e6),
        bytes => format!("{:.0} KB", (bytes / 1e3).ceil()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Deformable;

    fn field(density: f64, box_size: f64) -> ObstacleField {
        ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(density), box_size }
    }

    #[test]
    fn samples_and_shapes_take_memory_in_proportion_to_their_number() {
        let mut point = Point::new(Model::Deformable(Deformable::of_tension(1.0)), Scene::Obstacles(field(0.5, 50.0)));
        point.limits.t_max = 1e6;
        point.sample_every = 10.0;
        assert_eq!(record_bytes(&point).samples, 64.0 * (1e5 + 2.0));
        let alone = record_bytes(&point).shapes;
        point.shapes_every = Some(10.0);
        assert_eq!(record_bytes(&point).shapes, alone / 2.0 * (1e5 + 2.0));
        assert!(run_bytes(&point) > 3.0 * (record_bytes(&point).samples + record_bytes(&point).shapes));
    }

    #[test]
    fn the_memory_of_an_array_grows_with_the_area_of_its_box() {
        let ratio = array_bytes(&field(2.0, 2000.0)) / array_bytes(&field(2.0, 1000.0));
        assert!((ratio - 4.0).abs() < 0.01, "{ratio}");
        assert!(array_bytes(&field(2.0, 5000.0)) > 4e9 && array_bytes(&field(0.39, 1000.0)) < 1e9);
    }

    #[test]
    fn sizes_are_told_in_the_unit_that_fits() {
        let told = [3e9, 2.5e6, 1.0].map(size);
        assert_eq!(told, ["3.0 GB", "2 MB", "1 KB"].map(str::to_owned));
    }
}

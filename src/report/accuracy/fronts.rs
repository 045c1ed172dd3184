//! The settings of a scene as a table.

use crate::report::rounding::significant;
use crate::report::text_table::{NOTHING, TextTable, owned};
use crate::study::accuracy::front::{ParetoFront, Spot};

/// What the columns of fronts mean.
pub(super) const FRONT_NOTE: &str = "\
error   largest error of the headline observables against the finest ring, with the error of that ring and two standard
        errors added
*       on the front: nothing measured is faster and as accurate (within 2%)
";

/// The settings of a scene as a table, the fastest first.
pub(super) fn front(front: &ParetoFront) -> TextTable {
    let headers = owned(["", "n_vertices", "integrator", "dt", "ms/t0", "error", "of"]);
    let row = |spot: &Spot| {
        let (n_vertices, integrator, dt) = spot.setting;
        let (error, of) = match spot.error {
            Some((error, of)) => (significant(error, 2), of.to_owned()),
            None => (spot.excuse.clone(), NOTHING.to_owned()),
        };
        let default = if Some(spot) == front.default() { "default " } else { "" };
        vec![
            format!("{default}{}", if spot.on_front { "*" } else { "" }),
            n_vertices.to_string(),
            integrator.name().to_owned(),
            dt.map_or_else(|| "auto".to_owned(), |dt| significant(dt, 3)),
            significant(spot.ms_per_t0, 3),
            error,
            of,
        ]
    };
    TextTable {
        title: format!("Error against time, {} ({})", front.scene.name(), front.conditions),
        headers,
        rows: front.spots.iter().map(row).collect(),
        names: 0,
        keys: 3,
    }
}

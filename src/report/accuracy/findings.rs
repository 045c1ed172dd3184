//! What the tables show, in sentences.

use crate::report::accuracy::ladders::order;
use crate::report::rounding::significant;
use crate::study::accuracy::Accuracy;
use crate::study::accuracy::front::ParetoFront;
use crate::study::accuracy::ladder::{Knob, Ladder};
use crate::study::accuracy::order::Order;

/// Sentences: orders of convergence, and where the default stands.
pub(super) fn findings(accuracy: &Accuracy) -> Vec<String> {
    let orders = accuracy.ladders.iter().filter(|ladder| ladder.knob != Knob::EkThreshold).filter_map(orders_of);
    orders.chain(accuracy.fronts.iter().filter_map(default_of)).collect()
}

fn orders_of(ladder: &Ladder) -> Option<String> {
    let all: Vec<String> = ladder
        .columns
        .iter()
        .filter_map(|column| {
            Some(format!("{} of {}", order(column.order.filter(Order::is_clear)?), column.observable.name))
        })
        .collect();
    (!all.is_empty()).then(|| format!("Order in {}, {}: {}.", ladder.knob.name(), ladder.scene.name(), all.join(", ")))
}

fn default_of(front: &ParetoFront) -> Option<String> {
    let default = front.default()?;
    let (error, of) = default.error?;
    let place = format!(
        "{}: the default is off by {} ({of}) at {} ms/t0",
        front.scene.name(),
        significant(error, 2),
        significant(default.ms_per_t0, 3)
    );
    Some(match front.instead_of_default() {
        Some(better) if !default.on_front && better != default => {
            let (n_vertices, integrator, dt) = better.setting;
            let dt = dt.map_or_else(String::new, |dt| format!(", dt = {}", significant(dt, 3)));
            format!(
                "{place}; n_vertices = {n_vertices}, {}{dt} is as accurate in {} of the time.",
                integrator.name(),
                significant(better.ms_per_t0 / default.ms_per_t0, 2)
            )
        }
        _ => format!("{place}, on the front."),
    })
}

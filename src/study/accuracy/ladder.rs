//! One knob varied alone: its rungs from coarse to fine, their errors, and the order of convergence.

use crate::parameters::{Point, Value, list, names};
use crate::study::accuracy::records::{Difference, PointRecords, scale};
use crate::study::accuracy::{observable::Observable, order::Order, scene::TestScene};

/// What a ladder varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// Number of vertices, under the automatic step of Verlet.
    NVertices,
    /// Step of Verlet.
    Dt,
    /// Step of the implicit integrator.
    Implicit,
    /// Perimeter stiffness over line tension.
    Kappa,
    /// Smoothing of the edge length.
    Eps,
    /// Wall stiffness.
    EW,
    /// E_k/E_t of a clog.
    EkThreshold,
    /// Error of a step of the liquid.
    StepError,
}

names!(pub(crate) Knob {
    NVertices = "n_vertices", Dt = "dt", Implicit = "implicit",
    Kappa = "kappa", Eps = "eps", EW = "e_w", EkThreshold = "ek_threshold",
    StepError = "step_error",
});

impl Knob {
    /// Whether it belongs to a setting (N_v, dt, integrator); the other knobs belong to the model.
    pub(crate) const fn is_setting(self) -> bool {
        matches!(self, Self::NVertices | Self::Dt | Self::Implicit)
    }

    /// Its value at a point; NaN if the point does not have it.
    pub(crate) fn value(self, point: &Point) -> f64 {
        let parameter = if self == Self::Implicit { "dt" } else { self.name() };
        list::value(point, parameter).and_then(Value::number).unwrap_or(f64::NAN)
    }

    /// The number that falls to zero as the knob gets finer.
    pub(crate) fn h(self, point: &Point) -> f64 {
        match self {
            Self::NVertices | Self::EW => 1.0 / self.value(point),
            Self::Dt | Self::Implicit | Self::Kappa | Self::Eps | Self::EkThreshold | Self::StepError => {
                self.value(point)
            }
        }
    }
}

/// One knob varied alone in one scene.
#[derive(Clone, Debug)]
pub struct Ladder {
    /// The scene.
    pub scene: TestScene,
    /// The knob.
    pub knob: Knob,
    /// The points, coarse to fine.
    pub rungs: Vec<PointRecords>,
    /// Its observables.
    pub columns: Vec<Column>,
}

/// One observable along a ladder.
#[derive(Clone, Debug)]
pub struct Column {
    /// The observable.
    pub observable: &'static Observable,
    /// Its value at each rung.
    pub values: Vec<Option<f64>>,
    /// Its error at each rung, against the exact value, or against the finest rung, which then has no error.
    pub errors: Vec<Option<Difference>>,
    /// The order at which it converges.
    pub order: Option<Order>,
    /// The error of the finest rung itself, in the unit of the errors. It is estimated from the order, or is the last
    /// difference if the order is not clear; two standard errors are added for an observable that can jump. It is 0 if
    /// the exact value is known.
    pub left_over: Option<f64>,
}

impl Ladder {
    /// Evaluates points that vary `knob`.
    pub(crate) fn of(scene: TestScene, knob: Knob, mut rungs: Vec<PointRecords>) -> Self {
        rungs.sort_by(|a, b| knob.h(&b.point).total_cmp(&knob.h(&a.point)));
        // The time to rest depends on the threshold by definition, so it is no error.
        let compared = |observable: &&Observable| knob != Knob::EkThreshold || observable.name != "time to rest";
        let columns = scene.observables().iter().filter(compared).map(|o| Column::of(o, knob, &rungs)).collect();
        Self { scene, knob, rungs, columns }
    }

    pub(crate) fn reference(&self) -> Option<&PointRecords> {
        self.rungs.last()
    }
}

impl Column {
    fn of(observable: &'static Observable, knob: Knob, rungs: &[PointRecords]) -> Self {
        let values: Vec<Option<f64>> = rungs.iter().map(|rung| rung.value(observable)).collect();
        // Coarse rungs may have no value. Only the rungs after the last gap are used.
        let sound = values.iter().rposition(Option::is_none).map_or(0, |last| last + 1);
        let h: Vec<f64> = rungs[sound..].iter().map(|rung| knob.h(&rung.point)).collect();
        let y: Vec<f64> = values[sound..].iter().flatten().copied().collect();
        match (observable.exact, rungs) {
            (Some(exact), [first, ..]) => Self::against_exact(observable, exact(&first.point), values, &h, &y),
            _ => Self::against_finest(observable, rungs, values, &h, &y),
        }
    }

    fn against_exact(
        observable: &'static Observable,
        exact: f64,
        values: Vec<Option<f64>>,
        h: &[f64],
        y: &[f64],
    ) -> Self {
        let size = |value: f64| (value - exact).abs() / scale(observable, exact);
        let errors = values.iter().map(|value| value.map(|value| Difference { size: size(value), spread: 0.0 }));
        let distances: Vec<f64> = y.iter().map(|y| y - exact).collect();
        Self {
            observable,
            errors: errors.collect(),
            values,
            order: Order::of_errors(h, &distances, exact.abs()),
            left_over: Some(0.0),
        }
    }

    fn against_finest(
        observable: &'static Observable,
        rungs: &[PointRecords],
        values: Vec<Option<f64>>,
        h: &[f64],
        y: &[f64],
    ) -> Self {
        let mut errors: Vec<Option<Difference>> = Vec::new();
        if let [coarser @ .., finest] = rungs {
            errors.extend(coarser.iter().map(|rung| rung.difference(finest, observable)));
            errors.push(None);
        }
        // If the standard error hides even the coarsest error, there is no order.
        let resolved = |error: &Difference| error.spread == 0.0 || error.size > 2.0 * error.spread;
        let order = Order::of_ladder(h, y).filter(|_| errors.iter().flatten().next().is_some_and(resolved));
        let left_over = match (h, y) {
            ([.., h_before, h_last], [.., before, last]) => {
                let difference = (before - last) / scale(observable, *last);
                let clear = order.filter(Order::is_clear);
                let known = clear.map_or(difference.abs(), |order| order.left_over(difference, h_before / h_last));
                // An observable that jumps from rung to rung may jump again beyond the last rung.
                let last_spread = errors[errors.len() - 2].map_or(0.0, |error| error.spread);
                Some(known + if observable.can_jump { 2.0 * last_spread } else { 0.0 })
            }
            _ => None,
        };
        Self { observable, errors, values, order, left_over }
    }
}

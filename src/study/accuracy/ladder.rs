//! One knob varied alone: its rungs from coarse to fine, their errors, and the order at which they fall.

use crate::parameters::{Point, Value, list};
use crate::study::accuracy::observable::Observable;
use crate::study::accuracy::order::Order;
use crate::study::accuracy::records::{Difference, PointRecords, scale};
use crate::study::accuracy::scene::TestScene;

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
}

impl Knob {
    /// All of them.
    pub(crate) const ALL: [Self; 7] =
        [Self::NVertices, Self::Dt, Self::Implicit, Self::Kappa, Self::Eps, Self::EW, Self::EkThreshold];

    /// The last part of the names of its blocks.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::NVertices => "n_vertices",
            Self::Dt => "dt",
            Self::Implicit => "implicit",
            Self::Kappa => "kappa",
            Self::Eps => "eps",
            Self::EW => "e_w",
            Self::EkThreshold => "ek_threshold",
        }
    }

    /// The knob of that name.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|knob| knob.name() == name)
    }

    /// Whether it decides what a step is and costs; the other knobs belong to the model.
    pub(crate) const fn is_setting(self) -> bool {
        matches!(self, Self::NVertices | Self::Dt | Self::Implicit)
    }

    /// Its value at a point.
    pub(crate) fn value(self, point: &Point) -> f64 {
        let parameter = if self == Self::Implicit { "dt" } else { self.name() };
        list::value(point, parameter).and_then(Value::number).unwrap_or(f64::NAN)
    }

    /// The number that falls to zero as the knob gets finer.
    pub(crate) fn h(self, point: &Point) -> f64 {
        match self {
            Self::NVertices | Self::EW => 1.0 / self.value(point),
            Self::Dt | Self::Implicit | Self::Kappa | Self::Eps | Self::EkThreshold => self.value(point),
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
    /// Its error at each rung, against the exact value or against the finest rung, which then has none itself.
    pub errors: Vec<Option<Difference>>,
    /// The order at which it converges.
    pub order: Option<Order>,
    /// What the finest rung itself is still off by, in the unit of the errors. It comes from the order, or is the last
    /// difference where the order is not clear; two standard errors are added for an observable that can jump. It is 0
    /// where errors are against the exact value.
    pub left_over: Option<f64>,
}

impl Ladder {
    /// Judges points that vary `knob`.
    pub(crate) fn of(scene: TestScene, knob: Knob, mut rungs: Vec<PointRecords>) -> Self {
        rungs.sort_by(|a, b| knob.h(&b.point).total_cmp(&knob.h(&a.point)));
        // Every threshold has its own time to rest, so these cannot be compared.
        let compared = |observable: &&Observable| knob != Knob::EkThreshold || observable.name != "time to rest";
        let columns = scene.observables().iter().filter(compared).map(|o| Column::of(o, knob, &rungs)).collect();
        Self { scene, knob, rungs, columns }
    }

    /// The finest rung.
    pub(crate) fn reference(&self) -> Option<&PointRecords> {
        self.rungs.last()
    }
}

impl Column {
    fn of(observable: &'static Observable, knob: Knob, rungs: &[PointRecords]) -> Self {
        let values: Vec<Option<f64>> = rungs.iter().map(|rung| rung.value(observable)).collect();
        // Coarse rungs may have no value; the rungs after the last gap count.
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
        // Where the spread over arrays hides even the coarsest error there is no order.
        let resolved = |error: &Difference| error.spread == 0.0 || error.size > 2.0 * error.spread;
        let order = Order::of_ladder(h, y).filter(|_| errors.iter().flatten().next().is_some_and(resolved));
        let left_over = match (h, y) {
            ([.., h_before, h_last], [.., before, last]) => {
                let difference = (before - last) / scale(observable, *last);
                let clear = order.filter(Order::is_clear);
                let known = clear.map_or(difference.abs(), |order| order.left_over(difference, h_before / h_last));
                // An observable that jumps from rung to rung may jump again beyond the last one.
                let last_spread = errors[errors.len() - 2].map_or(0.0, |error| error.spread);
                Some(known + if observable.can_jump { 2.0 * last_spread } else { 0.0 })
            }
            _ => None,
        };
        Self { observable, errors, values, order, left_over }
    }
}

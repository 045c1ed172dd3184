//! One knob varied alone: its rungs from coarse to fine, their errors, and the order at which they fall.

use crate::parameters::{Point, Value, list};
use crate::study::accuracy::order::Order;
use crate::study::accuracy::study::{Observable, Study};
use crate::study::accuracy::{Deviation, Measured, scale};

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
    pub const ALL: [Self; 7] =
        [Self::NVertices, Self::Dt, Self::Implicit, Self::Kappa, Self::Eps, Self::EW, Self::EkThreshold];

    /// The last part of the names of its blocks.
    pub const fn name(self) -> &'static str {
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
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|knob| knob.name() == name)
    }

    /// Whether it is one of what decides a step and what it costs; the others belong to the model.
    pub const fn is_setting(self) -> bool {
        matches!(self, Self::NVertices | Self::Dt | Self::Implicit)
    }

    /// Its value at a point.
    pub fn value(self, point: &Point) -> f64 {
        let parameter = if self == Self::Implicit { "dt" } else { self.name() };
        list::value(point, parameter).and_then(Value::number).unwrap_or(f64::NAN)
    }

    /// What falls to zero as it gets finer.
    pub fn h(self, point: &Point) -> f64 {
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
    pub study: Study,
    /// The knob.
    pub knob: Knob,
    /// The points, coarse to fine.
    pub rungs: Vec<Measured>,
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
    /// Its error at each rung, against the exact value or the finest rung; that one has none then.
    pub errors: Vec<Option<Deviation>>,
    /// The order at which it converges.
    pub order: Option<Order>,
    /// What the finest rung is still off by, as its errors are: from the order, or the last difference where there is no clear one, with two standard errors
    /// of what can jump; 0 if errors are against the exact value.
    pub left_over: Option<f64>,
}

impl Ladder {
    /// Judges points that vary `knob`.
    pub fn of(study: Study, knob: Knob, mut rungs: Vec<Measured>) -> Self {
        rungs.sort_by(|a, b| knob.h(&b.point).total_cmp(&knob.h(&a.point)));
        // The time to a threshold is another one at every threshold.
        let compared = |observable: &&Observable| knob != Knob::EkThreshold || observable.name != "time to rest";
        let columns = study.observables().iter().filter(compared).map(|o| Column::of(o, knob, &rungs)).collect();
        Self { study, knob, rungs, columns }
    }

    /// The finest rung.
    pub fn reference(&self) -> Option<&Measured> {
        self.rungs.last()
    }
}

impl Column {
    fn of(observable: &'static Observable, knob: Knob, rungs: &[Measured]) -> Self {
        let values: Vec<Option<f64>> = rungs.iter().map(|rung| rung.value(observable)).collect();
        // Coarse rungs may have none; what counts is the unbroken end.
        let sound = values.iter().rposition(Option::is_none).map_or(0, |last| last + 1);
        let h: Vec<f64> = rungs[sound..].iter().map(|rung| knob.h(&rung.point)).collect();
        let y: Vec<f64> = values[sound..].iter().flatten().copied().collect();
        if let (Some(exact), Some(first)) = (observable.exact, rungs.first()) {
            let exact = exact(&first.point);
            let against = |value: Option<f64>| {
                Some(Deviation { size: (value? - exact).abs() / scale(observable, exact), spread: 0.0 })
            };
            let errors: Vec<f64> = y.iter().map(|y| y - exact).collect();
            return Self {
                observable,
                errors: values.iter().map(|value| against(*value)).collect(),
                values,
                order: Order::of_errors(&h, &errors, exact.abs()),
                left_over: Some(0.0),
            };
        }
        let finest = rungs.last();
        let errors: Vec<Option<Deviation>> = rungs
            .iter()
            .enumerate()
            .map(|(k, rung)| {
                finest.filter(|_| k + 1 < rungs.len()).and_then(|finest| rung.deviation(finest, observable))
            })
            .collect();
        // Where arrays blur even the coarsest error there is no order.
        let resolved = |error: &Deviation| error.spread == 0.0 || error.size > 2.0 * error.spread;
        let order = Order::of_ladder(&h, &y).filter(|_| errors.iter().flatten().next().is_some_and(resolved));
        let left_over = match y[..] {
            [.., before, last] => {
                let (difference, ratio) = ((before - last) / scale(observable, last), h[h.len() - 2] / h[h.len() - 1]);
                let clear = order.filter(Order::is_clear);
                let known = clear.map_or(difference.abs(), |order| order.left_over(difference, ratio));
                // What may jump from rung to rung does so beyond the last one too.
                let last_spread = errors[errors.len() - 2].map_or(0.0, |error| error.spread);
                Some(known + if observable.can_jump { 2.0 * last_spread } else { 0.0 })
            }
            _ => None,
        };
        Self { observable, errors, values, order, left_over }
    }
}

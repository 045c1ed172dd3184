//! The way of a held droplet through a throat, and the steepest place on it.
//!
//! The path begins where a circle touches both walls. From there states are followed along their common tangent by
//! steps of given length in the space of all unknowns. So the path may also turn back in h, as it does at narrow
//! throats where a droplet snaps forward.

use crate::parameters::MASS;
use crate::study::threshold::balance::{Balance, FRONT, H, PRESSURE, REAR, SLOPE, State, scales};
use crate::study::threshold::quadrature::{DEFAULT_NODES, Rule};
use crate::study::threshold::throat::Throat;
use nalgebra::Vector6;
use std::f64::consts::PI;

/// The first, the longest and the shortest step along the path, in the scales of the unknowns.
const STEPS: [f64; 3] = [5e-3, 0.04, 1e-7];

/// Newton steps after which the next step along the path is longer.
const QUICK: usize = 3;

/// Most steps of a path.
const MOST_STEPS: usize = 4000;

/// A slope below this at h = 0 is zero: the droplet is its own mirror image there.
const LEVEL: f64 = 1e-6;

/// The droplet held at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// x of its centroid from the throat, in sigma.
    pub h: f64,
    /// Its perimeter P, in sigma.
    pub perimeter: f64,
    /// dP/dh.
    pub slope: f64,
    /// The pressure at its centroid over the tension, in 1/sigma.
    pub pressure: f64,
    /// Where its contact with a wall begins and ends: angles from the throat on a tip or a disc, in radians, and
    /// beyond them the distance along the face.
    pub contact: [f64; 2],
}

/// How a path ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The droplet is narrower than the throat and touches nothing.
    Free,
    /// The throat is no wider than delta, and no outline passes it.
    Closed,
    /// The droplet comes to h = 0 as its own mirror image. What follows is the mirror image of the path, downhill.
    Through,
    /// The droplet does not go through the gap: it folds round both discs from outside, until it closes round them or
    /// parts in two.
    Around,
}

/// The way of a droplet through a throat.
#[derive(Clone, Debug)]
pub struct Passage {
    /// Droplets along the path, from the first touch to its end; none where nothing is touched or all is closed.
    pub path: Vec<Held>,
    /// The one of largest dP/dh.
    pub steepest: Option<Held>,
    /// How the path ends.
    pub end: End,
    balance: Balance,
    states: Vec<State>,
}

/// A path that was lost.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
#[error(
    "the shape of least perimeter was followed to h = {h:.4} and lost there, for a throat with {room:.4} sigma of room; \
     ask for a wider one"
)]
pub struct PathLost {
    /// Where.
    pub h: f64,
    /// The gap less delta.
    pub room: f64,
}

impl Passage {
    /// The way of a droplet of this area through a throat.
    ///
    /// # Errors
    /// [`PathLost`] where Newton's method finds no further shape.
    pub fn of(throat: Throat, area: f64) -> Result<Self, PathLost> {
        Self::by_rule(throat, area, DEFAULT_NODES)
    }

    /// The same with so many nodes of quadrature to a free surface.
    ///
    /// # Errors
    /// [`PathLost`].
    pub fn by_rule(throat: Throat, area: f64, nodes: usize) -> Result<Self, PathLost> {
        let balance = Balance { throat, area, rule: Rule::new(nodes) };
        let radius = (area / PI).sqrt();
        let none = |end, balance| Ok(Self { path: vec![], steepest: None, end, balance, states: vec![] });
        let Some([h, place]) = throat.first_touch(radius) else { return none(End::Free, balance) };
        if throat.room() <= 0.0 {
            return none(End::Closed, balance);
        }
        let (states, end) = follow(&balance, Vector6::new(1.0 / radius, 0.0, place, place, h, -libm::log(radius)))?;
        let path = states.iter().filter_map(|state| held(&balance, state)).collect();
        let steepest = steepest(&balance, &states);
        Ok(Self { path, steepest, end, balance, states })
    }

    /// The largest tension at which the droplet passes, `Gamma_c = M / max dP/dh`, in g rho sigma^2.
    pub fn gamma_c(&self) -> f64 {
        match (self.steepest, self.end) {
            (Some(held), _) => MASS / held.slope,
            (None, End::Closed) => 0.0,
            (None, _) => f64::INFINITY,
        }
    }

    /// The upper half of the outline at the place `index` of the path, from rear to front, with `count` points to each
    /// free surface and to the contact; empty beyond the path.
    pub fn outline(&self, index: usize, count: usize) -> Vec<[f64; 2]> {
        self.states.get(index).and_then(|state| self.balance.outline(state, count)).unwrap_or_default()
    }
}

fn held(balance: &Balance, state: &State) -> Option<Held> {
    let perimeter = balance.shape(state)?.perimeter;
    Some(Held {
        h: state[H],
        perimeter,
        slope: balance.area * state[SLOPE],
        pressure: state[PRESSURE] + state[SLOPE] * state[H],
        contact: [state[REAR], state[FRONT]],
    })
}

/// The states from the first touch on, and how they end.
fn follow(balance: &Balance, begin: State) -> Result<(Vec<State>, End), PathLost> {
    let lost = |state: &State| PathLost { h: state[H], room: balance.throat.room() };
    let (mut state, mut onwards) = (begin, Vector6::zeros());
    onwards[H] = 1.0;
    let (mut states, [mut step, longest, shortest]) = (vec![begin], STEPS);
    for _ in 0..MOST_STEPS {
        let tangent = balance.tangent(&state, &onwards).ok_or_else(|| lost(&state))?;
        let (next, iterations) = loop {
            if step < shortest {
                return Err(lost(&state));
            }
            match balance.settle(&(state + tangent * step), &tangent) {
                Some(found) if is_near(&state, &found.0, step) => break found,
                _ => step *= 0.5,
            }
        };
        if next[H] >= 0.0 {
            let last = at_throat(balance, &state, &next).ok_or_else(|| lost(&state))?;
            states.push(last);
            return Ok((states, if last[SLOPE].abs() < LEVEL { End::Through } else { End::Around }));
        }
        let [rear, front] = balance.shape(&next).ok_or_else(|| lost(&next))?.ends;
        if rear >= front || !balance.throat.has(next[REAR]) {
            return Ok((states, End::Around));
        }
        states.push(next);
        (state, onwards) = (next, tangent);
        step = if iterations <= QUICK { (1.5 * step).min(longest) } else { step };
    }
    Err(lost(&state))
}

/// Whether a step went about as far as it should: one that went further has met another path.
fn is_near(from: &State, to: &State, step: f64) -> bool {
    (to - from).component_div(&scales(from)).norm() < 1.5 * step
}

/// The state at h = 0 between two others.
fn at_throat(balance: &Balance, before: &State, after: &State) -> Option<State> {
    let mut guess = before + (after - before) * (before[H] / (before[H] - after[H]));
    guess[H] = 0.0;
    let mut fixed = Vector6::zeros();
    fixed[H] = 1.0;
    balance.settle(&guess, &fixed).map(|(state, _)| state)
}

/// The place of largest slope: where the tangent of the path has none in the slope.
fn steepest(balance: &Balance, states: &[State]) -> Option<Held> {
    let best = (0..states.len()).max_by(|&a, &b| states[a][SLOPE].total_cmp(&states[b][SLOPE]))?;
    let (before, after) = (states.get(best.saturating_sub(1))?, states.get(best + 1).unwrap_or(&states[best]));
    let chord = after - before;
    let length = chord.component_div(&scales(before)).norm();
    let place = |share: f64| balance.settle(&(before + chord * share), &chord).map(|(state, _)| state);
    let (mut low, mut high, mut top) = (0.0, 1.0, states[best]);
    // The slope is level at its maximum, so an error of 1e-8 in its place is none in its value.
    while length > 0.0 && high - low > 1e-8 {
        let middle = 0.5 * (low + high);
        let Some(state) = place(middle) else { break };
        let Some(tangent) = balance.tangent(&state, &chord) else { break };
        if state[SLOPE] > top[SLOPE] {
            top = state;
        }
        if tangent[SLOPE] > 0.0 { low = middle } else { high = middle }
    }
    held(balance, &top)
}

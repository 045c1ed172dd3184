//! The droplet whose centroid is held at h: equations for the pressure, its slope, and the two ends of the contact.
//!
//! Least perimeter at given area a and centroid h means, for the free parts of the outline, the curvature `p + m x`,
//! where p and m are the multipliers of area and centroid; and tangents that join smoothly on the walls. Along such
//! shapes
//!
//! ```text
//! dP/dh = a m
//! ```
//!
//! The droplet is its own mirror image in the axis, so the upper half says all. From the rear to the front it is a free
//! surface, the contour of the wall between the places u_r and u_f, and a free surface. The unknowns are p, m, u_f,
//! u_r, h, and the logarithm of the curvature k_r of the rear surface on the axis. That surface is flat where the slope
//! is large: its k_r is then exponentially small, and would be lost in rounding if it were worked out from the others.
//! The equations are that both surfaces reach the axis, that area and centroid are those asked for, and that k_r fits
//! the pressure.

use crate::study::threshold::cap::{Cap, Surface};
use crate::study::threshold::quadrature::Rule;
use crate::study::threshold::throat::{Mark, Throat};
use nalgebra::{Matrix6, SMatrix, Vector5, Vector6};

/// Pressure and slope over the tension, front and rear of the contact, h, and the logarithm of k_r.
pub(super) type State = Vector6<f64>;

/// Places in a [`State`].
pub(super) const PRESSURE: usize = 0;
pub(super) const SLOPE: usize = 1;
pub(super) const FRONT: usize = 2;
pub(super) const REAR: usize = 3;
pub(super) const H: usize = 4;
pub(super) const FLATNESS: usize = 5;

/// The largest residual of a solution, in units of the lengths involved.
const TOLERANCE: f64 = 1e-11;

/// Most steps of Newton's method; more mean that the step along the path was too long.
const ITERATIONS: usize = 8;

/// The step of central differences, whose error is then 1e-11 or so.
const DIFFERENCE: f64 = 2e-5;

/// What a state is asked to be.
#[derive(Clone, Debug)]
pub(super) struct Balance {
    pub(super) throat: Throat,
    pub(super) area: f64,
    pub(super) rule: Rule,
}

/// What a state gives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    /// What is missing in each equation.
    pub(super) residual: Vector5<f64>,
    /// The whole perimeter.
    pub(super) perimeter: f64,
    /// x where the axis leaves the droplet at its rear and at its front.
    pub(super) ends: [f64; 2],
}

impl Balance {
    /// Where contact begins and ends, and the free surfaces there, the rear one seen in the mirror.
    fn surfaces(&self, state: &State) -> Option<([Mark; 2], [Surface; 2])> {
        let [rear, front] = [REAR, FRONT].map(|end| self.throat.mark(state[end]));
        let behind = Surface::from_axis(&rear.mirrored(), libm::exp(state[FLATNESS]), -state[SLOPE])?;
        let ahead = Surface::from_wall(&front, state[PRESSURE] + state[SLOPE] * front.at[0], state[SLOPE])?;
        Some(([rear, front], [behind, ahead]))
    }

    /// The shape of a state; `None` if there is no surface that leaves the wall as the state says.
    pub(super) fn shape(&self, state: &State) -> Option<Shape> {
        let ([rear, front], surfaces) = self.surfaces(state)?;
        let [behind, ahead]: [Cap; 2] = [surfaces[0].cap(&self.rule)?, surfaces[1].cap(&self.rule)?];
        let area = 2.0 * (behind.area + ahead.area + front.area - rear.area);
        let moment = 2.0 * (ahead.moment - behind.moment + front.moment - rear.moment);
        let misfit = state[PRESSURE] + state[SLOPE] * rear.at[0] - surfaces[0].at_wall();
        let residual = Vector5::new(
            ahead.height - front.at[1],
            behind.height - rear.at[1],
            area - self.area,
            moment - self.area * state[H],
            misfit / scales(state)[PRESSURE],
        );
        let perimeter = 2.0 * (behind.length + ahead.length + front.way - rear.way);
        Some(Shape { residual, perimeter, ends: [-behind.apex, ahead.apex] })
    }

    /// The upper half of the outline from rear to front, `count` points to each of its three parts.
    pub(super) fn outline(&self, state: &State, count: usize) -> Option<Vec<[f64; 2]>> {
        let (_, [behind, ahead]) = self.surfaces(state)?;
        let behind = behind.points(&self.rule, count)?;
        let mut outline: Vec<[f64; 2]> = behind.into_iter().rev().map(|[x, y]| [-x, y]).collect();
        let place = |k: usize| state[REAR] + (state[FRONT] - state[REAR]) * k as f64 / count as f64;
        outline.extend((0..=count).map(|k| self.throat.mark(place(k)).at));
        outline.extend(ahead.points(&self.rule, count)?);
        Some(outline)
    }

    /// Derivatives of the residual.
    fn slopes(&self, state: &State) -> Option<SMatrix<f64, 5, 6>> {
        let mut slopes = SMatrix::<f64, 5, 6>::zeros();
        for variable in 0..state.len() {
            let step = DIFFERENCE * scales(state)[variable];
            let there = |step: f64| {
                let mut moved = *state;
                moved[variable] += step;
                self.shape(&moved).map(|shape| shape.residual)
            };
            slopes.set_column(variable, &((there(step)? - there(-step)?) / (2.0 * step)));
        }
        Some(slopes)
    }

    /// The direction in which states keep their balance, of length 1 in the [`scales`] and with a positive share of
    /// `onwards`.
    pub(super) fn tangent(&self, state: &State, onwards: &State) -> Option<State> {
        let scales = scales(state);
        let rows = self.slopes(state)?;
        let row = onwards.component_div(&scales.component_mul(&scales));
        let mut right = Vector6::zeros();
        right[5] = 1.0;
        let tangent = bordered(&rows, &row).lu().solve(&right)?;
        let length = tangent.component_div(&scales).norm();
        length.is_finite().then(|| tangent / length)
    }

    /// The balanced state in the plane through `guess` across `direction`, and the number of Newton steps to it.
    pub(super) fn settle(&self, guess: &State, direction: &State) -> Option<(State, usize)> {
        let scales = scales(guess);
        let row = direction.component_div(&scales.component_mul(&scales));
        let size = (1.0 + guess[H].abs()) * (1.0 + self.throat.size());
        let mut state = *guess;
        for iteration in 0..ITERATIONS {
            let residual = self.shape(&state)?.residual;
            if residual.amax() < TOLERANCE * size {
                return Some((state, iteration));
            }
            let right = residual.push(0.0);
            state -= bordered(&self.slopes(&state)?, &row).lu().solve(&right)?;
        }
        None
    }
}

/// The unit of each variable along the path.
pub(super) fn scales(state: &State) -> State {
    Vector6::new(1.0 + state[PRESSURE].abs(), 1.0 + state[SLOPE].abs(), 1.0, 1.0, 1.0, 4.0)
}

/// The derivatives of the residual above one further row.
fn bordered(rows: &SMatrix<f64, 5, 6>, row: &State) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_rows_mut::<5>(0).copy_from(rows);
    matrix.set_row(5, &row.transpose());
    matrix
}

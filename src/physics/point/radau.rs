//! One implicit step of a soft particle: Radau IIA with three stages, of order five.
//!
//! With places X_i, velocities V_i and accelerations A_i at the times `t + c_i h`, and the matrix a of the method,
//!
//! ```text
//! V_i = v + h sum_j a_ij A_j,    X_i = x + h c_i v + h^2 sum_j (a^2)_ij A_j,    A_i = F(X_i)/M - lambda(X_i) V_i
//! ```
//!
//! Newton's method solves the six equations for the A_i. The last stage is the end of the step. The method damps what is
//! faster than a step (it is L-stable), so a step may be far longer than the relaxation time `V_t`. Method, coefficients
//! and error estimate: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.8.

use nalgebra::{Matrix6, Vector6};

/// sqrt(6).
const ROOT: f64 = 2.449_489_742_783_178;

/// c, where the stages lie in the step.
const NODES: [f64; 3] = [(4.0 - ROOT) / 10.0, (4.0 + ROOT) / 10.0, 1.0];

/// a.
const STAGES: [[f64; 3]; 3] = [
    [(88.0 - 7.0 * ROOT) / 360.0, (296.0 - 169.0 * ROOT) / 1800.0, (-2.0 + 3.0 * ROOT) / 225.0],
    [(296.0 + 169.0 * ROOT) / 1800.0, (88.0 + 7.0 * ROOT) / 360.0, (-2.0 - 3.0 * ROOT) / 225.0],
    [(16.0 - ROOT) / 36.0, (16.0 + ROOT) / 36.0, 1.0 / 9.0],
];

/// a^2.
const SQUARED: [[f64; 3]; 3] = squared();

/// The weights of the stages in the error estimate, and the inverse of the real eigenvalue of the inverse of a.
const ERROR: [f64; 3] = [-(13.0 + 7.0 * ROOT) / 3.0, (-13.0 + 7.0 * ROOT) / 3.0, -1.0 / 3.0];
const REAL: f64 = 0.274_888_829_595_676_7;

/// A step is given up after so many iterations.
const MOST_ITERATIONS: u32 = 10;

/// The acceleration at a place and velocity, and its derivatives: `[[dA_k/dx_l]]` and the rate `-dA/dv`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Acceleration {
    pub(super) value: [f64; 2],
    pub(super) by_place: [[f64; 2]; 2],
    pub(super) rate: f64,
}

/// Place and velocity.
pub(in crate::physics) type Phase = [[f64; 2]; 2];

/// The end of a step of length `h`, and its estimated error in sigma. `None` if Newton's method does not come within
/// `precision`, in sigma.
pub(super) fn step(
    from: Phase,
    h: f64,
    precision: f64,
    mut acceleration: impl FnMut(Phase) -> Acceleration,
) -> Option<(Phase, f64)> {
    let [place, velocity] = from;
    let begin = acceleration(from);
    let mut a = [begin.value; 3];
    let stages = |a: &[[f64; 2]; 3]| -> [Phase; 3] {
        [0, 1, 2].map(|i| {
            let sum = |row: &[f64; 3], k: usize| row[0] * a[0][k] + row[1] * a[1][k] + row[2] * a[2][k];
            let x = [0, 1].map(|k| place[k] + h * NODES[i] * velocity[k] + h * h * sum(&SQUARED[i], k));
            [x, [0, 1].map(|k| velocity[k] + h * sum(&STAGES[i], k))]
        })
    };
    for _ in 0..MOST_ITERATIONS {
        let (mut matrix, mut residual) = (Matrix6::<f64>::identity(), Vector6::<f64>::zeros());
        for (i, phase) in stages(&a).into_iter().enumerate() {
            let here = acceleration(phase);
            for k in 0..2 {
                residual[2 * i + k] = here.value[k] - a[i][k];
                for j in 0..3 {
                    matrix[(2 * i + k, 2 * j + k)] += h * STAGES[i][j] * here.rate;
                    for l in 0..2 {
                        matrix[(2 * i + k, 2 * j + l)] -= h * h * SQUARED[i][j] * here.by_place[k][l];
                    }
                }
            }
        }
        let change = matrix.lu().solve(&residual)?;
        for i in 0..3 {
            (a[i][0], a[i][1]) = (a[i][0] + change[2 * i], a[i][1] + change[2 * i + 1]);
        }
        // A sum, because a maximum would pass over what is no number.
        let moved: f64 = SQUARED.iter().flat_map(|row| [0, 1].map(|k| corrected(row, &change, k))).map(f64::abs).sum();
        let moved = h * h * moved;
        if !moved.is_finite() {
            return None;
        }
        if moved <= precision {
            let ends = stages(&a);
            let error = error(from, h, begin, &ends);
            return error.is_finite().then_some((ends[2], error));
        }
    }
    None
}

/// How far the end is from that of an embedded method of order three, filtered by `(1 - gamma h J)^-1`.
fn error([place, velocity]: Phase, h: f64, begin: Acceleration, ends: &[Phase; 3]) -> f64 {
    let off = |part: usize, k: usize, from: f64| (0..3).map(|i| ERROR[i] * (ends[i][part][k] - from)).sum::<f64>();
    let x = [0, 1].map(|k| REAL * (h * velocity[k] + off(0, k, place[k])));
    let v = [0, 1].map(|k| REAL * (h * begin.value[k] + off(1, k, velocity[k])));
    // (1 - s J) (e_x, e_v) = (x, v) with s = gamma h, solved for e_x.
    let s = REAL * h;
    let damped = 1.0 + s * begin.rate;
    let [[xx, xy], [yx, yy]] = begin.by_place.map(|row| row.map(|slope| -s * s * slope));
    let (xx, yy) = (xx + damped, yy + damped);
    let right = [0, 1].map(|k| damped * x[k] + s * v[k]);
    let determinant = xx * yy - xy * yx;
    libm::hypot((yy * right[0] - xy * right[1]) / determinant, (xx * right[1] - yx * right[0]) / determinant)
}

/// Component k of a row of a^2 times a correction of the accelerations.
fn corrected(row: &[f64; 3], change: &Vector6<f64>, k: usize) -> f64 {
    row[0] * change[k] + row[1] * change[2 + k] + row[2] * change[4 + k]
}

const fn squared() -> [[f64; 3]; 3] {
    let (a, mut product, mut entry) = (STAGES, [[0.0; 3]; 3], 0);
    while entry < 9 {
        let (i, j) = (entry / 3, entry % 3);
        product[i][j] = a[i][0] * a[0][j] + a[i][1] * a[1][j] + a[i][2] * a[2][j];
        entry += 1;
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damped pendulum in the plane, with a drag that depends on the place.
    fn pendulum([[x, y], [u, v]]: Phase) -> Acceleration {
        let rate = 1.0 + 0.5 * x * x;
        let value = [-4.0 * libm::sin(x) - rate * u, -y - rate * v];
        Acceleration { value, by_place: [[-4.0 * libm::cos(x) - x * u, 0.0], [-x * v, -1.0]], rate }
    }

    fn end(steps: u32) -> Phase {
        let mut phase = [[0.7, 0.2], [0.0, 1.0]];
        for _ in 0..steps {
            phase = step(phase, 2.0 / f64::from(steps), 1e-14, pendulum).unwrap().0;
        }
        phase
    }

    #[test]
    fn the_error_falls_with_the_fifth_power_of_the_step() {
        let exact = end(512);
        let off = |steps| (end(steps)[0][0] - exact[0][0]).abs();
        let order = libm::log2(off(8) / off(16));
        assert!((4.7..5.5).contains(&order), "{order}");
    }

    #[test]
    fn the_estimate_falls_with_the_fourth_power_and_is_not_below_the_error() {
        let first = |h: f64| step([[0.7, 0.2], [0.0, 1.0]], h, 1e-14, pendulum).unwrap();
        // At ten times this step the order is 3.4 and still rises.
        let order = libm::log2(first(0.0125).1 / first(0.00625).1);
        assert!((3.9..4.1).contains(&order), "{order}");
        let exact = (0..64).fold([[0.7, 0.2], [0.0, 1.0]], |p, _| step(p, 0.1 / 64.0, 1e-15, pendulum).unwrap().0);
        let (end, estimate) = first(0.1);
        assert!((end[0][0] - exact[0][0]).abs() < estimate, "{estimate}");
    }

    #[test]
    fn a_step_far_longer_than_the_relaxation_ends_on_the_terminal_speed() {
        let falls = |[_, v]: Phase| Acceleration {
            value: [1.0 - 33.0 * v[0], -33.0 * v[1]],
            by_place: [[0.0; 2]; 2],
            rate: 33.0,
        };
        let (end, _) = step([[0.0; 2]; 2], 1e5, 1e-9, falls).unwrap();
        assert!((end[1][0] * 33.0 - 1.0).abs() < 1e-4, "{}", end[1][0]);
    }
}

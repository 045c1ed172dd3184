//! One implicit step: the shape that minimises energy plus dissipation.
//!
//! With the drag matrix B and the directions J of even motions at the shape that was foreseen, the step solves
//!
//! ```text
//! J^T [grad U(y) + B (alpha_0 y + alpha_1 x + alpha_2 x1)/h] = 0,    y = foreseen shape + J nu,
//! ```
//!
//! which is the gradient of `U + |alpha_0 y + ...|_B^2/(2 alpha_0 h)`. Newton's method minimises that function; where a
//! contact opens or closes, a search along the direction finds the place where the slope has fallen by half.

use crate::on_instruction_set;
use crate::physics::liquid::dense::{Matrix, solve_symmetric};
use crate::physics::liquid::dissipation::Dissipation;
use crate::physics::liquid::even::Even;
use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::{Evaluation, Potential};
use crate::physics::motion::darcy::scheme::Scheme;
use crate::physics::simd::{InstructionSet, Instructions, padded};
use crate::physics::walls::wall::Walls;

/// Newton's method gives up after this many iterations.
const MOST_ITERATIONS: u32 = 25;

/// The largest change of a shape along a normal in one iteration, in sigma.
const LARGEST_CHANGE: f64 = 0.3;

/// Iterations end when the shape changes by less than this share of the step.
const PRECISION: f64 = 1e-4;

/// Changes below this are rounding, in sigma.
const ROUNDING: f64 = 3e-15;

/// Why a step was not solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unsolved {
    /// Newton's method does not converge.
    Diverges,
    /// The energy has no minimum nearby: the matrix is not positive definite.
    Saddle,
    /// The shape left the list of what is near.
    TooFar,
}

/// Storage of the solver, for rings of one size.
#[derive(Debug)]
pub(super) struct Solver {
    n: usize,
    instruction_set: InstructionSet,
    pub(super) dissipation: Dissipation,
    pub(super) even: Even,
    /// The drag in the space of even motions, and the matrix of an iteration.
    drag: Matrix,
    matrix: Matrix,
    /// A matrix in the space of vertices, and half of it reduced.
    full: Matrix,
    half: Matrix,
    scratch: Vec<f64>,
    velocity: Vec<f64>,
    resistance: Vec<f64>,
    direction: Vec<f64>,
    unknown: Vec<f64>,
    slope: Vec<f64>,
    reduced: [Vec<f64>; 2],
    /// Changes below this end a step, in sigma.
    pub(super) rounding: f64,
    /// The shape of the last evaluation.
    pub(super) shape: Polygon,
    pub(super) here: Evaluation,
    /// Integral of the squared velocity of the liquid at `shape`.
    pub(super) squares: f64,
}

impl Solver {
    pub(super) fn new(n: usize, dissipation: Dissipation, instruction_set: InstructionSet) -> Self {
        let vector = || vec![0.0; 2 * n];
        Self {
            n,
            instruction_set,
            dissipation,
            even: Even::default(),
            drag: Matrix::new(n, n),
            matrix: Matrix::new(n, n),
            full: Matrix::new(2 * n, 2 * n),
            half: Matrix::new(n, 2 * n),
            scratch: vec![0.0; 2 * padded(2 * n)],
            velocity: vector(),
            resistance: vector(),
            direction: vector(),
            unknown: vec![0.0; n],
            slope: vec![0.0; n],
            reduced: [vec![0.0; n], vec![0.0; n]],
            rounding: ROUNDING,
            shape: Polygon::default(),
            here: Evaluation::default(),
            squares: 0.0,
        }
    }

    /// Takes drag and directions at the foreseen shape, which `self.here` evaluates. False if that cannot be done.
    pub(super) fn set_out(&mut self, foreseen: &Polygon, origin: [f64; 2]) -> bool {
        if !self.dissipation.take(foreseen, origin, &self.here, &self.even) {
            return false;
        }
        self.dissipation.fill(&mut self.full.values, self.full.width);
        let Self { n, instruction_set, even, full, half, drag, scratch, .. } = self;
        on_instruction_set!(*instruction_set, simd => congruence(simd, *n, even, full, half, drag, scratch));
        true
    }

    /// Solves the step from `self.shape` on. `before` are the last two shapes.
    ///
    /// # Errors
    /// [`Unsolved`], if there is no solution near.
    pub(super) fn solve<W: Walls>(
        &mut self,
        potential: &Potential<W>,
        nearby: &Nearby<W::Obstacle>,
        scheme: &Scheme,
        h: f64,
        before: [&Polygon; 2],
    ) -> Result<u32, Unsolved> {
        self.evaluate(potential, nearby, scheme, h, before)?;
        for iteration in 1..=MOST_ITERATIONS {
            let slope = self.newton(potential, scheme.alpha[0] / h)?;
            let share = self.search(slope, |solver| solver.evaluate(potential, nearby, scheme, h, before))?;
            let change = self.unknown.iter().fold(0.0_f64, |most, nu| most.max(nu.abs())) * share;
            if change <= PRECISION * self.shape.largest_distance(before[0]) + self.rounding {
                return Ok(iteration);
            }
        }
        Err(Unsolved::Diverges)
    }

    /// The velocity of the centroid at `self.shape`.
    pub(super) fn centroid_velocity(&self) -> [f64; 2] {
        self.dissipation.centroid_velocity(&self.velocity)
    }

    /// Energy, velocity and drag at `self.shape`.
    fn evaluate<W: Walls>(
        &mut self,
        potential: &Potential<W>,
        nearby: &Nearby<W::Obstacle>,
        scheme: &Scheme,
        h: f64,
        [x, x1]: [&Polygon; 2],
    ) -> Result<(), Unsolved> {
        if !nearby.covers(&self.shape) {
            return Err(Unsolved::TooFar);
        }
        potential.evaluate(&self.shape, nearby, &mut self.here);
        let [a, b, c] = scheme.alpha.map(|alpha| alpha / h);
        for i in 0..self.n {
            self.velocity[2 * i] = a * self.shape.x[i] + b * x.x[i] + c * x1.x[i];
            self.velocity[2 * i + 1] = a * self.shape.y[i] + b * x.y[i] + c * x1.y[i];
        }
        self.squares = self.dissipation.drag(&self.velocity, &mut self.resistance);
        Ok(())
    }

    /// Sets the direction of Newton's method; returns the slope along it, which is negative.
    fn newton<W: Walls>(&mut self, potential: &Potential<W>, rate: f64) -> Result<f64, Unsolved> {
        let n = self.n;
        for k in 0..2 * n {
            self.direction[k] = -self.here.gradient[k] - self.resistance[k];
        }
        self.even.reduce(&self.direction, &mut self.unknown);
        self.slope.copy_from_slice(&self.unknown);
        self.full.values.fill(0.0);
        let (full, width) = (&mut self.full.values, self.full.width);
        self.here.curvature.for_each_entry(|row, value, column| full[row * width + column] += value);
        let [area, x] = &mut self.reduced;
        self.even.reduce(&self.here.area_gradient, area);
        self.even.reduce(&self.here.x_gradient, x);
        let Self { instruction_set, even, full, half, matrix, scratch, .. } = self;
        on_instruction_set!(*instruction_set, simd => congruence(simd, n, even, full, half, matrix, scratch));
        // The second derivatives of area and centroid: K_a g_a g_a^T + (M/a)(g_a g_x^T + g_x g_a^T).
        let couple = potential.weight / self.here.area;
        let [area, x] = &self.reduced;
        for i in 0..n {
            let (from_area, from_x) = (potential.k_a * area[i] + couple * x[i], couple * area[i]);
            let row = i * self.matrix.width;
            for j in 0..n {
                let drag = rate * self.drag.values[row + j];
                self.matrix.values[row + j] += drag + from_area * area[j] + from_x * x[j];
            }
        }
        if !solve_symmetric(self.instruction_set, &mut self.matrix, n, &mut self.unknown) {
            return Err(Unsolved::Saddle);
        }
        let largest = self.unknown.iter().fold(0.0, |most: f64, nu| if nu.abs() <= most { most } else { nu.abs() });
        if !(largest <= LARGEST_CHANGE) {
            return Err(Unsolved::Diverges);
        }
        let slope: f64 = -self.slope.iter().zip(&self.unknown).map(|(a, b)| a * b).sum::<f64>();
        self.even.displace(&self.unknown, &mut self.direction);
        Ok(slope)
    }

    /// Goes along the direction until the slope has fallen by half; returns how far, as a share of the direction.
    fn search(
        &mut self,
        begin: f64,
        mut evaluate: impl FnMut(&mut Self) -> Result<(), Unsolved>,
    ) -> Result<f64, Unsolved> {
        let (mut low, mut high) = ((0.0, begin), None);
        let (mut share, mut at) = (1.0, 0.0);
        for _ in 0..=8 {
            for i in 0..self.n {
                self.shape.x[i] += (share - at) * self.direction[2 * i];
                self.shape.y[i] += (share - at) * self.direction[2 * i + 1];
            }
            at = share;
            evaluate(self)?;
            let forces = self.here.gradient.iter().zip(&self.resistance);
            let slope: f64 = forces.zip(&self.direction).map(|((force, drag), d)| (force + drag) * d).sum();
            if slope.abs() <= 0.5 * begin.abs() || (slope < 0.0 && high.is_none()) || begin.abs() < 1e-24 {
                break;
            }
            if slope > 0.0 {
                high = Some((share, slope));
            } else {
                low = (share, slope);
            }
            let Some((top, above)) = high else { break };
            let (bottom, below) = low;
            let root = (bottom * above - top * below) / (above - below);
            let room = 0.05 * (top - bottom);
            share = root.clamp(bottom + room, top - room);
        }
        Ok(at)
    }
}

/// `out = J^T X J` for a symmetric matrix X in the space of vertices.
#[inline(always)]
fn congruence<S: Instructions>(
    simd: S,
    n: usize,
    even: &Even,
    full: &mut Matrix,
    half: &mut Matrix,
    out: &mut Matrix,
    scratch: &mut [f64],
) {
    even.reduce_rows(simd, &full.values, full.width, &mut half.values, scratch);
    // The first 2n rows of `full` now take the transpose of `half`.
    for row in 0..2 * n {
        for column in 0..n {
            full.values[row * out.width + column] = half.values[column * half.width + row];
        }
    }
    even.reduce_rows(simd, &full.values, out.width, &mut out.values, scratch);
}

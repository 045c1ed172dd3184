//! One implicit step: the shape that minimises energy plus dissipation.
//!
//! With the drag matrix B and the directions J of even motions at the shape that was foreseen, the step solves
//!
//! ```text
//! J^T [grad U(y) + B (alpha_0 y + alpha_1 x + alpha_2 x1)/h] = 0,    y = foreseen shape + J nu,
//! ```
//!
//! which is the gradient of `U + |alpha_0 y + ...|_B^2/(2 alpha_0 h)`. Newton's method minimises that function. Whole
//! steps find out in a few iterations which contacts are closed. Where they do not, a second attempt begins anew and goes
//! along each direction to where the slope has fallen by half, which takes more evaluations and always comes nearer.

use crate::on_instruction_set;
use crate::physics::liquid::curvature::Work;
use crate::physics::liquid::dense::{Matrix, factorise, solve_factorised};
use crate::physics::liquid::dissipation::Dissipation;
use crate::physics::liquid::even::Even;
use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::{Evaluation, Foreseen, Potential};
use crate::physics::simd::{InstructionSet, LANES, fma, load, padded, store};
use crate::physics::walls::wall::Walls;
use fearless_simd::{f64x8, prelude::*};

/// Newton's method gives up after this many iterations with whole steps.
const WHOLE_STEPS: u32 = 12;

/// Newton's method gives up after this many iterations with searches.
const MOST_ITERATIONS: u32 = 25;

/// The largest change of a shape along a normal in one iteration, in sigma.
const LARGEST_CHANGE: f64 = 0.3;

/// Iterations end when the shape changes by less than this share of the step.
const PRECISION: f64 = 1e-3;

/// Factors are kept as long as each iteration changes the shape by no more than this share of the one before it.
const CONTRACTION: f64 = 0.1;

/// Changes below this are rounding, in sigma.
const ROUNDING: f64 = 3e-15;

/// The equations of one step.
pub(super) struct Step<'a, W: Walls> {
    pub(super) potential: &'a Potential<W>,
    pub(super) nearby: &'a Nearby<W::Obstacle>,
    /// The coefficients of the velocity, `alpha_0/h` and so on.
    pub(super) alpha: [f64; 3],
    /// The last two shapes.
    pub(super) before: [&'a Polygon; 2],
}

/// Why a step was not solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unsolved {
    /// Newton's method does not converge.
    Diverges,
    /// The energy has no minimum nearby: the matrix is not positive definite.
    Saddle,
    /// The shape left the list of what is near.
    TooFar,
    /// An obstacle lies inside of the shape.
    Swallows,
}

/// Storage of the solver, for rings of one size.
#[derive(Debug)]
pub(super) struct Solver {
    n: usize,
    instruction_set: InstructionSet,
    pub(super) dissipation: Dissipation,
    pub(super) even: Even,
    /// The drag in the space of even motions, and the factors of the matrix of an iteration.
    drag: Matrix,
    matrix: Matrix,
    work: Work,
    velocity: Vec<f64>,
    resistance: Vec<f64>,
    direction: Vec<f64>,
    /// The contacts for which the last direction was found.
    active: Vec<u32>,
    unknown: Vec<f64>,
    slope: Vec<f64>,
    reduced: [Vec<f64>; 2],
    /// The pressure as Newton's method foresees it. That of a shape on the way is off by K_a times a second-order change
    /// of its area, which would make the matrix indefinite.
    pub(super) pressure: f64,
    /// Changes below this end a step, in sigma.
    pub(super) rounding: f64,
    /// Whether only minima of the energy itself are looked for, downhill.
    pub(super) is_strict: bool,
    /// The shape that the first iteration begins with.
    begin: Polygon,
    /// The shape that an iteration begins with.
    left: Polygon,
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
            work: Work::new(n),
            velocity: vector(),
            resistance: vector(),
            direction: vector(),
            active: Vec::new(),
            unknown: vec![0.0; n],
            slope: vec![0.0; n],
            reduced: [vec![0.0; padded(n)], vec![0.0; padded(n)]],
            pressure: 0.0,
            rounding: ROUNDING,
            is_strict: false,
            begin: Polygon::default(),
            left: Polygon::default(),
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
        let Self { instruction_set, dissipation, even, work, drag, .. } = self;
        on_instruction_set!(*instruction_set, simd => even.spread(simd));
        dissipation.fill(even, work, drag);
        true
    }

    /// Solves the step from `self.shape` on; returns the number of iterations.
    ///
    /// # Errors
    /// [`Unsolved`], if there is no solution near.
    pub(super) fn solve<W: Walls>(&mut self, step: &Step<'_, W>) -> Result<u32, Unsolved> {
        if self.is_strict {
            return self.iterate(step, MOST_ITERATIONS, true);
        }
        self.begin.clone_from(&self.shape);
        let pressure = self.pressure;
        self.iterate(step, WHOLE_STEPS, false).or_else(|_| {
            self.shape.clone_from(&self.begin);
            self.pressure = pressure;
            self.iterate(step, MOST_ITERATIONS, true)
        })
    }

    /// Solves the step in at most so many iterations, with searches along each direction if it `is_careful`.
    fn iterate<W: Walls>(&mut self, step: &Step<'_, W>, most: u32, is_careful: bool) -> Result<u32, Unsolved> {
        self.evaluate(step)?;
        let (mut last, mut is_fit, mut is_stuck) = (f64::INFINITY, false, false);
        for iteration in 1..=most {
            if !is_fit {
                self.factorise_somehow(step)?;
            }
            self.active.clone_from(&self.here.active);
            let slope = self.newton(step.potential)?;
            // Half steps end a to and fro between two sets of contacts.
            let share = match is_careful {
                true => self.search(step, slope)?,
                false => self.go(step, if is_stuck { 0.5 } else { 1.0 }, true)?,
            };
            let change = self.unknown.iter().fold(0.0_f64, |most, nu| most.max(nu.abs())) * share;
            let enough = PRECISION * self.shape.largest_distance(step.before[0]) + self.rounding;
            let is_steady = share == 1.0 && self.active == self.here.active;
            // What the next iteration would change, from how fast the changes fall.
            if change <= enough || (is_fit && is_steady && change * change <= enough * last) {
                return Ok(iteration);
            }
            // The factors serve again while no contact opens or closes and they bring the solution near quickly.
            is_fit = is_steady && change <= CONTRACTION * last;
            is_stuck = !is_stuck && change > 0.5 * last && self.active != self.here.active;
            last = change;
        }
        Err(Unsolved::Diverges)
    }

    /// The velocity of the centroid at `self.shape`.
    pub(super) fn centroid_velocity(&self) -> [f64; 2] {
        self.dissipation.centroid_velocity(&self.velocity)
    }

    /// Energy, velocity and drag at `self.shape`.
    fn evaluate<W: Walls>(&mut self, step: &Step<'_, W>) -> Result<(), Unsolved> {
        let Step { potential, nearby, before: [x, x1], .. } = step;
        if !nearby.covers(&self.shape) {
            return Err(Unsolved::TooFar);
        }
        potential.evaluate(&self.shape, nearby, &mut self.here);
        let [a, b, c] = step.alpha;
        for i in 0..self.n {
            self.velocity[2 * i] = a * self.shape.x[i] + b * x.x[i] + c * x1.x[i];
            self.velocity[2 * i + 1] = a * self.shape.y[i] + b * x.y[i] + c * x1.y[i];
        }
        self.squares = self.dissipation.drag(&self.velocity, &mut self.resistance);
        Ok(())
    }

    /// Factorises the matrix of Newton's method. If it is not positive definite, this leaves out the negative stiffness of
    /// pushes from round walls, and that of strings round walls.
    fn factorise_somehow<W: Walls>(&mut self, step: &Step<'_, W>) -> Result<(), Unsolved> {
        if self.is_strict {
            return self.factorise(step, f64::INFINITY);
        }
        let push = step.potential.largest_push(self.n);
        self.factorise(step, push).or_else(|_| self.factorise(step, 0.0))
    }

    /// Sets the direction of Newton's method with the matrix that was [factorised](Self::factorise) last; returns the
    /// slope along it, which is negative.
    fn newton<W: Walls>(&mut self, potential: &Potential<W>) -> Result<f64, Unsolved> {
        let n = self.n;
        for k in 0..2 * n {
            self.direction[k] = -self.here.gradient[k] - self.resistance[k];
        }
        self.even.reduce(&self.direction, &mut self.unknown);
        self.slope.copy_from_slice(&self.unknown);
        let Self { instruction_set, matrix, unknown, .. } = self;
        on_instruction_set!(*instruction_set, simd => solve_factorised(simd, matrix, n, unknown));
        let largest = self.unknown.iter().fold(0.0, |most: f64, nu| if nu.abs() <= most { most } else { nu.abs() });
        if !(largest <= LARGEST_CHANGE) {
            return Err(Unsolved::Diverges);
        }
        let slope = -dot(&self.slope, &self.unknown);
        self.even.displace(&self.unknown, &mut self.direction);
        let growth = dot(&self.reduced[0], &self.unknown);
        self.pressure = -potential.k_a * (self.here.area + growth - potential.rest);
        Ok(slope)
    }

    /// Factorises the matrix of Newton's method at `self.shape`: second derivatives of the energy, for pushes of at most
    /// `push`, and the drag.
    fn factorise<W: Walls>(&mut self, step: &Step<'_, W>, push: f64) -> Result<(), Unsolved> {
        let Step { potential, nearby, alpha: [rate, ..], .. } = step;
        let foreseen = Foreseen { pressure: self.pressure, push };
        potential.differentiate_twice(&self.shape, nearby, foreseen, &mut self.here);
        let [area, x] = &mut self.reduced;
        self.even.reduce(&self.here.area_gradient, area);
        self.even.reduce(&self.here.x_gradient, x);
        let Self { n, instruction_set, even, here, work, drag, matrix, reduced: [area, x], .. } = self;
        let couple = potential.weight / here.area;
        let is_positive = on_instruction_set!(*instruction_set, simd => {
            here.curvature.reduce(simd, even, work, matrix);
            let (width, rate) = (matrix.width, f64x8::splat(simd, *rate));
            for i in 0..*n {
                // The second derivatives of area and centroid: K_a g_a g_a^T + (M/a)(g_a g_x^T + g_x g_a^T).
                let of_area = f64x8::splat(simd, potential.k_a * area[i] + couple * x[i]);
                let of_x = f64x8::splat(simd, couple * area[i]);
                for k in (i / LANES * LANES..width).step_by(LANES) {
                    let sum = fma(rate, load(simd, &drag.values, i * width + k), load(simd, &matrix.values, i * width + k));
                    let sum = fma(of_area, load(simd, area, k), fma(of_x, load(simd, x, k), sum));
                    store(sum, &mut matrix.values, i * width + k);
                }
            }
            factorise(simd, matrix, *n)
        });
        if is_positive { Ok(()) } else { Err(Unsolved::Saddle) }
    }

    /// Goes along the direction until the slope has fallen by half; returns how far, as a share of the direction.
    fn search<W: Walls>(&mut self, step: &Step<'_, W>, begin: f64) -> Result<f64, Unsolved> {
        let (mut low, mut high) = ((0.0, begin), None);
        let (mut share, mut at) = (1.0, 0.0);
        for _ in 0..=8 {
            self.go(step, share - at, false)?;
            at = share;
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

    /// Goes a share of the direction, onto the walls if it `settles`, and evaluates what is there. Returns the share.
    fn go<W: Walls>(&mut self, step: &Step<'_, W>, share: f64, settles: bool) -> Result<f64, Unsolved> {
        self.left.clone_from(&self.shape);
        for i in 0..self.n {
            self.shape.x[i] += share * self.direction[2 * i];
            self.shape.y[i] += share * self.direction[2 * i + 1];
        }
        if settles {
            step.potential.settle_on_walls(&self.left, &mut self.shape, step.nearby);
        }
        self.evaluate(step)?;
        Ok(share)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

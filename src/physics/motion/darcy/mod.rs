//! The motion of a droplet that is a liquid: without inertia, in implicit steps whose length follows their error.
//!
//! Friction and forces balance at every instant, `B(x) dx/dt = -grad U(x)`, because inertia is a thousandth of
//! anything else at the speeds of such droplets. A step is taken by the [`scheme`] and solved by the [`solver`]. Steps
//! depend on the trajectory only, not on when it is looked at: the droplet is ahead of the present time by part of a
//! step, and what is asked of the present is read off between the last two shapes ([`crate::physics::motion::reading`]).
//!
//! A step is taken again, shorter, if it is not solved, if its error is too large, or if the energy rises. A step of
//! backward Euler without respacing of the vertices lowers the energy however short it is, so it is what comes after a
//! rise.

mod loads;
mod refusal;
mod scheme;
mod sight;
mod sinking;
mod solver;
mod state;

pub use state::DarcyState;

use crate::physics::liquid::dissipation::Dissipation;
use crate::physics::liquid::nearby::Nearby;
use crate::physics::liquid::polygon::Polygon;
use crate::physics::liquid::potential::Potential;
use crate::physics::motion::descent::{Equilibrium, descend};
use crate::physics::motion::reading::{Reading, between};
use crate::physics::motion::{Interruption, Motion, MotionState, step_length};
use crate::physics::observation::Observation;
use crate::physics::simd::InstructionSet;
use crate::physics::walls::wall::Walls;
use crate::results::outline::Outline;
use crate::results::trajectory::Failure;
use refusal::Refused;
use scheme::Scheme;
use solver::{Solver, Step, Unsolved};
use state::{Course, Shapes};
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest distance that a vertex may move in one step at the speed of the last one, in sigma. No droplet jumps over an
/// obstacle.
const LARGEST_MOVE: f64 = 0.05;

/// Rounding of the energy, in g rho sigma^3.
const ENERGY_ROUNDING: f64 = 1e-12;

/// Respacing is complete where vertices move by this share of an edge in a step, and in proportion below.
const RESPACING: f64 = 0.1;

/// A liquid droplet among walls, in motion.
#[derive(Debug)]
pub(crate) struct DarcyMotion<W: Walls> {
    potential: Potential<W>,
    nearby: Nearby<W::Obstacle>,
    solver: Solver,
    shapes: Shapes,
    course: Course,
    /// Readings at the last two ends of steps.
    readings: [Reading; 2],
    /// Largest error of a vertex along its normal in one step, in sigma.
    step_error: f64,
    /// Time between two nominal steps.
    dt: f64,
    /// Whether a step was taken in the last call.
    is_fresh: bool,
}

impl<W: Walls> DarcyMotion<W> {
    /// A droplet of this shape at rest. Nominal steps have the length `dt`.
    pub(crate) fn start(
        shape: Polygon,
        origin: [f64; 2],
        potential: Potential<W>,
        dissipation: Dissipation,
        [dt, step_error]: [f64; 2],
        instruction_set: InstructionSet,
    ) -> Self {
        let course = Course { next: step_length::FIRST, ..Course::default() };
        let mut motion =
            Self::with(Shapes::of(shape, origin), course, potential, dissipation, [dt, step_error], instruction_set);
        motion.look();
        motion.readings = [motion.reading(0.0, [0.0; 2], 0.0); 2];
        motion
    }

    fn with(
        shapes: Shapes,
        course: Course,
        potential: Potential<W>,
        dissipation: Dissipation,
        [dt, step_error]: [f64; 2],
        instruction_set: InstructionSet,
    ) -> Self {
        let solver = Solver::new(shapes.latest().len(), dissipation, instruction_set);
        let readings = [Reading::default(); 2];
        Self { potential, nearby: Nearby::none(), solver, shapes, course, readings, step_error, dt, is_fresh: true }
    }

    /// Goes on from `state`. `None` if it does not belong to a ring of `n` vertices.
    pub(crate) fn resume(
        state: &DarcyState,
        n: usize,
        potential: Potential<W>,
        dissipation: Dissipation,
        times: [f64; 2],
        instruction_set: InstructionSet,
    ) -> Option<Self> {
        if !state.is_of(n) {
            return None;
        }
        let mut motion = Self::with(state.shapes.clone(), state.course, potential, dissipation, times, instruction_set);
        motion.readings = state.readings;
        Some(motion)
    }

    /// Lists what is near the latest shape, and evaluates it.
    fn look(&mut self) {
        let Potential { walls, reach, folds, .. } = &self.potential;
        self.nearby.list(walls.as_ref(), self.shapes.origin, self.shapes.latest(), *reach, folds.as_ref());
        self.potential.evaluate(self.shapes.latest(), &self.nearby, &mut self.solver.here);
    }

    /// The reading of the shape that the solver has evaluated.
    fn reading(&self, t: f64, velocity: [f64; 2], squares: f64) -> Reading {
        let (here, [x0, y0]) = (&self.solver.here, self.shapes.origin);
        Reading {
            t,
            place: [here.x + x0, here.y + y0],
            velocity,
            kinetic: 0.5 * squares,
            // Relative to the origin of the world, as all energies that are recorded.
            potential: here.energy - self.potential.weight * x0,
            shape: here.perimeter * here.perimeter / (4.0 * PI * here.area),
            area_error: here.area / self.potential.rest - 1.0,
            overlap: here.overlap,
            contacts: here.touched.len() as u32,
        }
    }

    /// Takes one step of whatever length can be taken.
    fn step(&mut self) -> Result<(), Failure> {
        self.shapes.follow();
        loop {
            let h = self.length();
            match self.attempt(h) {
                Ok(()) => return Ok(()),
                Err(refused) => self.retreat(h, refused)?,
            }
        }
    }

    /// The length of the next step: no vertex moves too far at the speed of the last step.
    fn length(&self) -> f64 {
        let Course { next, known, .. } = self.course;
        if known == 0 {
            return next;
        }
        let [now, before, _] = &self.shapes.last;
        let speed = now.largest_distance(before) / self.shapes.steps[0];
        if speed * next > LARGEST_MOVE { LARGEST_MOVE / speed } else { next }
    }

    fn attempt(&mut self, h: f64) -> Result<(), Refused> {
        let [h1, h2] = self.shapes.steps;
        let scheme = Scheme::new(h, h1, h2, self.course.known);
        let [now, before, earlier] = &self.shapes.last;
        let mut foreseen = now.clone();
        for i in 0..now.len() {
            foreseen.x[i] = scheme.foresee(now.x[i], before.x[i], earlier.x[i]);
            foreseen.y[i] = scheme.foresee(now.y[i], before.y[i], earlier.y[i]);
        }
        let Potential { walls, reach, folds, .. } = &self.potential;
        self.nearby.list(walls.as_ref(), self.shapes.origin, &foreseen, *reach, folds.as_ref());
        let solver = &mut self.solver;
        self.potential.evaluate(&foreseen, &self.nearby, &mut solver.here);
        solver.even.measure(&solver.here.edges);
        if !solver.set_out(&foreseen, self.shapes.origin) {
            return Err(Unsolved::Diverges.into());
        }
        solver.shape.clone_from(&foreseen);
        let share = self.course.respacing(now, before, solver.here.edges.perimeter);
        let mut scratch = vec![0.0; 2 * now.len()];
        solver.even.space(&mut solver.shape, &solver.here.edges, share, now, &mut scratch);
        solver.pressure = -self.potential.k_a * self.potential.rest * self.readings[1].area_error;
        self.potential.settle_on_walls(now, &mut solver.shape, &self.nearby);
        let alpha = scheme.alpha.map(|alpha| alpha / h);
        let step = Step { potential: &self.potential, nearby: &self.nearby, alpha, before: [now, before] };
        let iterations = solver.solve(&step)?;
        if sight::swallows(&solver.shape, &solver.here.strings, &self.nearby) {
            return Err(Unsolved::Swallows.into());
        }
        let error = scheme.error_share() * solver.even.largest_normal(&solver.shape, &foreseen) / self.step_error;
        if self.course.known > 0 && error > 2.0 {
            return Err(Refused::Inexact(error));
        }
        let rise = solver.here.energy - self.course.energy(&self.potential, &self.shapes, self.readings[1]);
        if rise > ENERGY_ROUNDING {
            return Err(Refused::EnergyRises(rise));
        }
        self.accept(h, &scheme, error, iterations);
        Ok(())
    }

    fn accept(&mut self, h: f64, scheme: &Scheme, error: f64, iterations: u32) {
        let velocity = self.solver.centroid_velocity();
        let t = self.readings[1].t + h;
        let [x0, y0] = self.shapes.origin;
        self.course.pinched = self.solver.here.closing.map(|[x, y]| [x + x0, y + y0]);
        self.shapes.push(&self.solver.shape, h);
        let squares = self.solver.squares;
        self.readings = [self.readings[1], self.reading(t, velocity, squares)];
        let course = &mut self.course;
        let order = f64::from(scheme.order());
        let root =
            if course.known == 0 { f64::INFINITY } else { libm::pow(1.0 / error.max(1e-30), 1.0 / (order + 1.0)) };
        course.next = step_length::after(h, root);
        course.known = (course.known + 1).min(2);
        course.spaces = true;
        course.counts.accepted += 1;
        course.counts.iterations += u64::from(iterations);
    }

    fn now(&self) -> f64 {
        self.course.steps as f64 * self.dt
    }
}

impl<W: Walls> Motion for DarcyMotion<W> {
    fn advance(&mut self, steps: u64, stop: &AtomicBool) -> Result<(), Interruption> {
        self.is_fresh = false;
        let until = (self.course.steps + steps) as f64 * self.dt;
        while self.readings[1].t < until && self.course.pinched.is_none() {
            if stop.load(Ordering::Relaxed) {
                return Err(Interruption::Stopped);
            }
            self.step()?;
            self.is_fresh = true;
        }
        self.course.steps += steps;
        Ok(())
    }

    fn state(&self) -> MotionState {
        let (shapes, course, readings) = (self.shapes.clone(), self.course, self.readings);
        MotionState::Darcy(Box::new(DarcyState { shapes, course, readings }))
    }

    /// The droplet moves its origin by itself, because its steps do not depend on when it is looked at.
    fn follow(&mut self) {}

    fn observe(&mut self) -> Observation {
        between(&self.readings[0], &self.readings[1], self.now())
    }

    fn outline(&self, t: f64) -> Outline {
        self.outline_at(t)
    }

    fn is_fresh(&self) -> bool {
        self.is_fresh
    }

    fn engulfed(&self) -> Option<[f64; 2]> {
        self.engulfed_now()
    }

    fn pinched(&self) -> Option<[f64; 2]> {
        self.course.pinched
    }

    fn refused(&self) -> u64 {
        self.course.counts.refused
    }

    fn descend(&mut self, farthest: f64, stop: &AtomicBool) -> Result<Option<Equilibrium>, Interruption> {
        (self.solver.rounding, self.solver.is_strict) = (sinking::PRECISION, true);
        descend(self, farthest, stop)
    }
}

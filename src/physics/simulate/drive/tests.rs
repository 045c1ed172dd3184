//! A scripted droplet is driven through everything that can happen to one.

use super::*;
use crate::parameters::{Channel, Deformable, Density, MASS, Model, ObstacleField, Scene, Soft};
use crate::physics::point::{SoftEffects, SoftMotion};
use crate::physics::ring::Ring;
use crate::physics::simd::InstructionSet;
use crate::physics::simulate::NoKeeper;
use crate::physics::walls::plate::Plate;
use crate::results::outline::Outline;
use crate::results::trajectory::FailureClass;
use std::sync::Arc;

#[derive(Clone, Copy)]
struct Seen {
    x: f64,
    ek_ratio: f64,
    potential: f64,
}

const MOVING: Seen = Seen { x: 0.0, ek_ratio: 1.0, potential: 0.0 };
const AT_REST: Seen = Seen { ek_ratio: 1e-20, ..MOVING };

/// A droplet that follows a script. Line k is observed after k checks, and the last line for ever after.
struct Scripted {
    script: Vec<Seen>,
    checks: usize,
    /// After how many checks an advance is interrupted, and by what.
    interrupted: Option<(usize, Interruption)>,
    engulfed_from: usize,
    /// The droplet has this ring from some check on.
    ring: Option<(usize, Ring)>,
}

impl Scripted {
    fn of(script: &[Seen]) -> Self {
        Self { script: script.to_vec(), checks: 0, interrupted: None, engulfed_from: usize::MAX, ring: None }
    }
}

impl Motion for Scripted {
    fn advance(&mut self, _: u64, _: &AtomicBool) -> Result<(), Interruption> {
        if let Some((_, interruption)) = self.interrupted.take_if(|(after, _)| *after == self.checks) {
            return Err(interruption);
        }
        self.checks += 1;
        Ok(())
    }

    /// A state that differs for each number of checks.
    fn state(&self) -> MotionState {
        let effects = SoftEffects { stiffness: 1.0, weight: 0.0, far_rate: 1.0, b0: 0.0, alpha: 1.0 };
        let position = [-10.0 - self.checks as f64, 0.0];
        MotionState::Soft(SoftMotion::start(position, effects, 1e-3, Arc::new(Plate), InstructionSet::new()).state())
    }

    fn follow(&mut self) {}

    fn observe(&mut self) -> Observation {
        let Seen { x, ek_ratio, potential } = self.script[self.checks.min(self.script.len() - 1)];
        let kinetic = ek_ratio * 0.5 * MASS * V_T * V_T;
        let (shape, area_error) = (None, None);
        Observation { x, y: 0.0, velocity: V_T, kinetic, potential, shape, area_error, overlap: 0.0, contacts: 0 }
    }

    fn outline(&self, t: f64) -> Outline {
        Outline { t, x: vec![self.checks as f64], y: vec![0.0], loads: Vec::new() }
    }

    fn engulfed(&self) -> Option<[f64; 2]> {
        (self.checks >= self.engulfed_from).then_some([1.0, 2.0])
    }

    fn ring(&self) -> Option<&Ring> {
        self.ring.as_ref().filter(|(from, _)| self.checks >= *from).map(|(_, ring)| ring)
    }

    fn refused(&self) -> u64 {
        7
    }
}

const V_T: f64 = 0.03;

/// Ten checks of 1 t0, a sample at every second one.
fn point() -> Point {
    let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Saturated, box_size: 30.0 };
    let mut point = Point::new(Model::Soft(Soft { e_w: 1.0 }), Scene::Obstacles(field));
    (point.limits.t_max, point.sample_every) = (10.0, 2.0);
    point
}

fn ring_point() -> Point {
    Point { model: Model::Deformable(Deformable::of_tension(1.0)), ..point() }
}

fn run(mut droplet: Scripted, point: &Point) -> Result<RunEnded, Failure> {
    let course = begin(&mut droplet, point);
    drive(&mut droplet, point, course, &AtomicBool::new(false), &mut NoKeeper)
}

fn finished(script: &[Seen], point: &Point) -> Trajectory {
    match run(Scripted::of(script), point) {
        Ok(RunEnded::Finished(trajectory)) => *trajectory,
        ended => panic!("{ended:?}"),
    }
}

#[test]
fn a_clog_needs_two_checks_in_a_row_below_the_threshold_after_a_movement() {
    let turns_back = finished(&[MOVING, MOVING, AT_REST, MOVING, AT_REST, AT_REST], &point());
    assert_eq!((turns_back.outcome, turns_back.t_end), (Outcome::Clogged, 5.0));
    assert_eq!(turns_back.clog.unwrap().t, 5.0);
    let never_moved = finished(&[AT_REST], &point());
    assert_eq!((never_moved.outcome, never_moved.t_end), (Outcome::TimeLimit, 10.0));
    let on_plate = finished(&[MOVING, MOVING, AT_REST, AT_REST], &Point { scene: Scene::Plate, ..point() });
    assert_eq!((on_plate.outcome, on_plate.clog, on_plate.delta_s), (Outcome::Settled, None, Some(0.0)));
}

#[test]
fn a_distance_an_exit_and_the_time_limit_end_a_run() {
    let falls: Vec<Seen> = (0..20).map(|k| Seen { x: f64::from(k), ..MOVING }).collect();
    let mut limited = point();
    let time = finished(&falls, &limited);
    assert_eq!((time.outcome, time.steps, time.refused), (Outcome::TimeLimit, 10_000, 7));
    limited.limits.distance = Some(4.0);
    let far = finished(&falls, &limited);
    assert_eq!((far.outcome, far.r_end), (Outcome::Distance, 4.0));
    let channel = Channel { w: 0.7, angle: 45.0, tip_radius: 0.0, h_start: 0.0, h_end: 3.0 };
    let through = finished(&falls, &Point { scene: Scene::Channel(channel), ..limited });
    assert_eq!((through.outcome, through.t_end), (Outcome::Exited, 3.0));
}

#[test]
fn samples_and_outlines_are_recorded_on_the_timetable_and_at_the_end() {
    let outlines = Point { shapes_every: Some(3.0), ..point() };
    let script = [MOVING, MOVING, MOVING, MOVING, AT_REST, AT_REST, AT_REST];
    let run = finished(&script, &outlines);
    assert_eq!(run.samples.t, [0.0, 2.0, 4.0, 5.0]);
    assert_eq!(run.outlines.iter().map(|outline| outline.t).collect::<Vec<_>>(), [0.0, 3.0, 5.0]);
    let last_alone = finished(&script, &point());
    assert_eq!(last_alone.outlines.iter().map(|outline| outline.t).collect::<Vec<_>>(), [5.0]);
}

#[test]
fn a_rise_of_the_energy_fails_with_the_outline_of_the_check_before() {
    for high in [0.06, f64::NAN] {
        let sinks = |potential| Seen { potential, ..MOVING };
        let failure = run(Scripted::of(&[sinks(0.0), sinks(-0.01), sinks(high - 0.01)]), &point()).unwrap_err();
        assert_eq!((failure.class, failure.step), (FailureClass::Unstable, 2000));
        assert_eq!(failure.outline.unwrap().t, 1.0);
    }
    let little = finished(&[MOVING, Seen { potential: 0.04, ..MOVING }], &point());
    assert!((little.energy_rise_max - 0.04).abs() < 1e-12);
}

#[test]
fn an_engulfed_obstacle_fails_or_is_marked() {
    let swallows = || Scripted { engulfed_from: 3, ..Scripted::of(&[MOVING]) };
    let failure = run(swallows(), &ring_point()).unwrap_err();
    assert_eq!((failure.class, failure.step), (FailureClass::Engulfed, 3000));
    assert!(failure.reason.contains("(1.000, 2.000)") && failure.outline.unwrap().t == 3.0);
    let Ok(RunEnded::Finished(marked)) = run(swallows(), &point()) else { panic!("a soft particle has no inside") };
    assert_eq!(marked.engulfed_t, Some(3.0));
}

#[test]
fn a_ring_that_crosses_itself_fails() {
    let mut crossed = Ring::regular(64, [0.0, 0.0], 0.5);
    (crossed.x[20], crossed.x[40]) = (crossed.x[40], crossed.x[20]);
    (crossed.y[20], crossed.y[40]) = (crossed.y[40], crossed.y[20]);
    let droplet = Scripted { ring: Some((2, crossed)), ..Scripted::of(&[MOVING]) };
    let failure = run(droplet, &ring_point()).unwrap_err();
    assert_eq!((failure.class, failure.step), (FailureClass::Crossed, 2000));
}

#[test]
fn a_failed_step_keeps_its_class_and_gets_the_outline_of_its_time() {
    let failed = Failure { class: FailureClass::Unstable, reason: "burst".to_owned(), step: 2500, outline: None };
    let droplet = Scripted { interrupted: Some((2, failed.into())), ..Scripted::of(&[MOVING]) };
    let failure = run(droplet, &point()).unwrap_err();
    assert_eq!((failure.class, &*failure.reason, failure.step), (FailureClass::Unstable, "burst", 2500));
    assert_eq!(failure.outline.unwrap().t, 2.5);
}

#[test]
fn a_stop_keeps_the_snapshot_of_the_last_check_and_the_run_goes_on_from_there() {
    let script: Vec<Seen> = (0..20).map(|k| Seen { x: f64::from(k), ..MOVING }).collect();
    let mut droplet = Scripted { interrupted: Some((4, Interruption::Stopped)), ..Scripted::of(&script) };
    let course = begin(&mut droplet, &point());
    let never = AtomicBool::new(false);
    let ended = drive(&mut droplet, &point(), course, &never, &mut NoKeeper).unwrap();
    let RunEnded::Stopped(Some(snapshot)) = ended else { panic!("{ended:?}") };
    assert_eq!((snapshot.step(), snapshot.motion.clone()), (4000, droplet.state()));
    let goes_on = drive(&mut droplet, &point(), snapshot.course, &never, &mut NoKeeper).unwrap();
    let RunEnded::Finished(trajectory) = goes_on else { panic!("{goes_on:?}") };
    assert_eq!(*trajectory, finished(&script, &point()));
}

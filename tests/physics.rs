//! Laws of the ring: forces, energy, terminal speed, Laplace pressure, and equal bits on every instruction set.

use meniscus::parameters::{ContactKind, MASS, regular_edge};
use meniscus::physics::motion::verlet::VerletMotion;
use meniscus::physics::ring::Ring;
use meniscus::physics::ring::effects::RingEffects;
use meniscus::physics::ring::forces::area::Area;
use meniscus::physics::ring::forces::contact::Contact;
use meniscus::physics::ring::forces::drag::Drag;
use meniscus::physics::ring::forces::gravity::Gravity;
use meniscus::physics::ring::forces::hydrostatic::Hydrostatic;
use meniscus::physics::ring::forces::tension::EdgeTension;
use meniscus::physics::simd::InstructionSet;
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use meniscus::physics::walls::plate::Plate;
use meniscus::physics::walls::wall::Walls;
use meniscus::physics::walls::wedge::ChannelWalls;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const N: usize = 100;
const NO_AREA: Area = Area { stiffness: 0.0, rest: MASS };
const AREA: Area = Area { stiffness: 1e4, rest: MASS };
const DT: f64 = 1e-3;

/// Nobody stops these droplets.
static NEVER: AtomicBool = AtomicBool::new(false);

fn discs() -> Arc<ObstacleArray> {
    Arc::new(ObstacleArray::from_centres(40.0, 0.15, &[10.6, 10.55, 9.9], &[10.2, 9.7, 10.6]))
}

fn nothing() -> Arc<ObstacleArray> {
    Arc::new(ObstacleArray::from_centres(40.0, 0.15, &[], &[]))
}

/// Effects among `discs`, on the instruction set `instruction_set`.
fn among(
    discs: Arc<ObstacleArray>,
    instruction_set: InstructionSet,
    tension: EdgeTension,
    area: Area,
    gravity: Gravity,
    rate: f64,
    e_w: f64,
) -> RingEffects {
    let eps = 0.1 * regular_edge(N);
    let walls = Box::new(Contact::new(discs, ContactKind::Edge, N, e_w / N as f64, 0.0123, instruction_set));
    RingEffects { tension, area, gravity, drag: Drag::Far { rate }, eps_squared: eps * eps, walls, others: Vec::new() }
}

/// One effect alone, among three discs that touch the ring.
fn alone(tension: EdgeTension, area: Area, gravity: Gravity, e_w: f64) -> RingEffects {
    among(discs(), InstructionSet::new(), tension, area, gravity, 0.0, e_w)
}

/// The whole droplet under gravity, among `discs`.
fn falling(discs: Arc<ObstacleArray>, instruction_set: InstructionSet) -> RingEffects {
    among(discs, instruction_set, general(), AREA, Gravity::new(N), 33.0, 1e4)
}

/// A ring bent out of shape, on no symmetry.
fn bent() -> Ring {
    let mut ring = Ring::regular(N, [10.0, 10.0], 0.5);
    for i in 0..N {
        let angle = 0.37 + 2.0 * std::f64::consts::PI * i as f64 / N as f64;
        ring.x[i] *= 1.0 + 0.1 * libm::sin(3.0 * angle) + 0.01 * libm::cos(17.0 * angle);
        ring.y[i] *= 1.0 + 0.07 * libm::cos(2.0 * angle);
    }
    ring.close();
    ring
}

/// Central differences of the energy against the force, relative to the largest force.
fn check_gradient(effects: RingEffects) {
    check_gradient_of(bent(), effects);
}

fn check_gradient_of(ring: Ring, effects: RingEffects) {
    let mut motion = VerletMotion::start(ring, effects, 1e-9, InstructionSet::new());
    let (fx, fy) = motion.forces();
    let largest = fx.iter().chain(&fy).fold(0.0, |a: f64, f| a.max(f.abs()));
    assert!(largest > 0.0, "the term must act on this ring");
    let h = 1e-6;
    for i in 0..N {
        for (axis, force) in [(0, fx[i]), (1, fy[i])] {
            let mut energy_at = |shift: f64| {
                let ring = motion.ring.clone();
                let coordinate = if axis == 0 { &mut motion.ring.x[i] } else { &mut motion.ring.y[i] };
                *coordinate += shift;
                motion.ring.close();
                let energy = motion.effects.potential_energy(&motion.ring);
                motion.ring = ring;
                energy
            };
            let slope = (energy_at(h) - energy_at(-h)) / (2.0 * h);
            assert!((force + slope).abs() < 1e-6 * largest, "vertex {i} axis {axis}: force {force}, slope {slope}");
        }
    }
}

#[test]
fn tension_is_minus_the_gradient_of_its_energy() {
    check_gradient(alone(EdgeTension::Line { gamma: 1.3 }, NO_AREA, Gravity::off(), 0.0));
}

#[test]
fn perimeter_elasticity_is_minus_the_gradient_of_its_energy() {
    let springs = EdgeTension::Springs { gamma: 0.0, stiffness: 80.0, rest: regular_edge(N) };
    check_gradient(alone(springs, NO_AREA, Gravity::off(), 0.0));
}

#[test]
fn linear_tension_is_minus_the_gradient_of_its_energy() {
    let rest = regular_edge(N);
    check_gradient(alone(EdgeTension::Linear { stiffness: 1.3 / rest, rest }, NO_AREA, Gravity::off(), 0.0));
}

#[test]
fn pressure_is_minus_the_gradient_of_the_area_energy() {
    check_gradient(alone(EdgeTension::NONE, Area { stiffness: 1.0, rest: 0.7 }, Gravity::off(), 0.0));
}

#[test]
fn weight_is_minus_the_gradient_of_the_gravity_energy() {
    check_gradient(alone(EdgeTension::NONE, NO_AREA, Gravity::new(N), 0.0));
}

#[test]
fn contact_is_minus_the_gradient_of_its_energy() {
    check_gradient(alone(EdgeTension::NONE, NO_AREA, Gravity::off(), 1e4));
}

fn general() -> EdgeTension {
    EdgeTension::Springs { gamma: 1.0, stiffness: 1e-3 * N as f64, rest: regular_edge(N) }
}

#[test]
fn without_drag_and_contact_energy_is_conserved_to_second_order_in_dt() {
    let worst = |dt: f64| {
        let free = among(nothing(), InstructionSet::new(), general(), AREA, Gravity::off(), 0.0, 1e4);
        let mut motion = VerletMotion::start(bent(), free, dt, InstructionSet::new());
        let begin = motion.observe().energy();
        (0..100).fold(0.0, |worst: f64, _| {
            motion.advance((0.01 / dt).round() as u64, &NEVER).unwrap();
            worst.max((motion.observe().energy() - begin).abs())
        })
    };
    let (coarse, fine) = (worst(2e-4), worst(1e-4));
    let order = libm::log2(coarse / fine);
    assert!((1.8..2.2).contains(&order), "errors {coarse:.2e} and {fine:.2e}, order {order}");
}

#[test]
fn with_drag_the_total_energy_never_rises() {
    let start = Ring::regular(N, [9.2, 10.0], Ring::regular_radius(N));
    let mut motion = VerletMotion::start(start, falling(discs(), InstructionSet::new()), DT, InstructionSet::new());
    let mut lowest = motion.observe().energy();
    for _ in 0..600 {
        motion.advance(100, &NEVER).unwrap();
        let energy = motion.observe().energy();
        assert!(energy <= lowest + 1e-12, "rose by {:.2e}", energy - lowest);
        lowest = lowest.min(energy);
    }
    assert!(motion.observe().contacts > 0, "the droplet must have met an obstacle");
}

#[test]
fn a_free_droplet_reaches_its_terminal_speed_and_stays_a_circle() {
    let v_t = 0.03;
    let free = among(nothing(), InstructionSet::new(), general(), AREA, Gravity::new(N), 1.0 / v_t, 1e4);
    let start = Ring::regular(N, [10.0, 10.0], Ring::regular_radius(N));
    let mut motion = VerletMotion::start(start, free, DT, InstructionSet::new());
    motion.advance(20_000, &NEVER).unwrap();
    let seen = motion.observe();
    assert!((seen.velocity / v_t - 1.0).abs() < 1e-9);
    let regular_polygon = 1.0 + std::f64::consts::PI.powi(2) / (3.0 * (N * N) as f64);
    assert!((seen.shape.unwrap() - regular_polygon).abs() < 1e-6);
}

#[test]
fn a_free_circle_holds_the_pressure_gamma_over_radius() {
    let gamma = 1.7;
    let resting = among(nothing(), InstructionSet::new(), EdgeTension::Line { gamma }, AREA, Gravity::off(), 33.0, 1e4);
    let mut motion = VerletMotion::start(Ring::regular(N, [10.0, 10.0], 0.5), resting, DT, InstructionSet::new());
    motion.advance(50_000, &NEVER).unwrap();
    let (area, _) = motion.ring.area_and_perimeter();
    let radius = (area / std::f64::consts::PI).sqrt();
    // eps = 0.1 l0 weakens the tension by l/l_eps = 0.995.
    let smoothed = gamma / 1.01_f64.sqrt();
    assert!((AREA.pressure(area) * radius / smoothed - 1.0).abs() < 1e-3);
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let run = |instruction_set| {
        let mut motion = VerletMotion::start(bent(), falling(discs(), instruction_set), DT, instruction_set);
        motion.advance(20_000, &NEVER).unwrap();
        (motion.ring.x, motion.ring.y, motion.ring.ux, motion.ring.uy)
    };
    let plain = run(InstructionSet::fallback());
    assert!(run(InstructionSet::new()) == plain);
    #[cfg(target_arch = "x86_64")]
    if let Some(avx2) = InstructionSet::new().as_avx2() {
        assert!(run(InstructionSet::Avx2(avx2)) == plain);
    }
}

#[test]
fn a_trajectory_does_not_depend_on_how_its_steps_are_cut() {
    let begin = || VerletMotion::start(bent(), falling(discs(), InstructionSet::new()), DT, InstructionSet::new());
    let (mut whole, mut cut) = (begin(), begin());
    whole.advance(5000, &NEVER).unwrap();
    for steps in [1, 7, 992, 3000, 1000] {
        cut.advance(steps, &NEVER).unwrap();
        cut.observe();
    }
    assert!(whole.ring.x == cut.ring.x && whole.ring.uy == cut.ring.uy);
}

#[test]
fn hydrostatic_gravity_is_minus_the_gradient_of_its_energy_and_carries_the_whole_weight() {
    let mut effects = alone(EdgeTension::NONE, NO_AREA, Gravity::off(), 0.0);
    effects.others.push(Box::new(Hydrostatic));
    let mut motion = VerletMotion::start(bent(), effects, DT, InstructionSet::new());
    let (fx, fy) = motion.forces();
    assert!((fx[..N].iter().sum::<f64>() - MASS).abs() < 1e-12);
    assert!(fy[..N].iter().sum::<f64>().abs() < 1e-12);
    let mut effects = alone(EdgeTension::NONE, NO_AREA, Gravity::off(), 0.0);
    effects.others.push(Box::new(Hydrostatic));
    check_gradient(effects);
}

#[test]
fn contact_with_wedges_and_plates_is_minus_the_gradient_of_its_energy() {
    // Round, and no deeper than half a vertex: inside a sharp wedge the nearer face changes, and with it the force.
    fn touching<W: Walls>(walls: W, kind: ContactKind, centre: [f64; 2]) {
        let walls = Contact::new(Arc::new(walls), kind, N, 100.0, 0.0123, InstructionSet::new());
        let effects = RingEffects { walls: Box::new(walls), ..alone(EdgeTension::NONE, NO_AREA, Gravity::off(), 0.0) };
        check_gradient_of(Ring::regular(N, centre, 0.5), effects);
    }
    // Distances from the tip at (0, 0.35), or from the plate, of 0.503.
    touching(ChannelWalls::new(0.7, 45.0, 0.0), ContactKind::Edge, [-0.361_26, 0.0]);
    touching(ChannelWalls::new(0.7, 60.0, 0.0), ContactKind::Edge, [-0.361_26, 0.0]);
    touching(ChannelWalls::new(0.7, 45.0, 0.1), ContactKind::Edge, [-0.36, 0.02]);
    touching(ChannelWalls::new(0.7, 45.0, 0.1), ContactKind::Vertex, [-0.36, 0.02]);
    touching(Plate, ContactKind::Edge, [-0.503, 0.0]);
}

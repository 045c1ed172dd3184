//! Laws of the implicit integrator: its order, and the physics it shares with velocity-Verlet.

use meniscus::parameters::{ContactKind, MASS, regular_edge};
use meniscus::physics::motion::implicit::ImplicitMotion;
use meniscus::physics::motion::verlet::VerletMotion;
use meniscus::physics::motion::{Interruption, Motion};
use meniscus::physics::ring::Ring;
use meniscus::physics::ring::effects::RingEffects;
use meniscus::physics::ring::forces::area::Area;
use meniscus::physics::ring::forces::contact::Contact;
use meniscus::physics::ring::forces::drag::Drag;
use meniscus::physics::ring::forces::gravity::Gravity;
use meniscus::physics::ring::forces::tension::EdgeTension;
use meniscus::physics::simd::InstructionSet;
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use meniscus::results::trajectory::FailureClass;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Nobody stops these droplets.
static NEVER: AtomicBool = AtomicBool::new(false);

const N: usize = 128;
const V_T: f64 = 0.03;
const DELTA: f64 = std::f64::consts::PI / 256.0;
const DT: f64 = 0.02;

/// The literal stiffness of [C24] eq. 3, `4 eps_w/delta^2`.
const LITERAL: f64 = 4.0 * 1e4 / (DELTA * DELTA);
/// E_w = 1e4 shared by all edges.
const TOTAL: f64 = 1e4 / N as f64;

fn discs(x: &[f64], y: &[f64]) -> Arc<ObstacleArray> {
    Arc::new(ObstacleArray::from_centres(40.0, 0.15, x, y))
}

/// Two discs with a gap of 0.3 between them, across the way of a droplet that starts at x = 10.
fn funnel() -> Arc<ObstacleArray> {
    discs(&[10.6, 10.6], &[10.3, 9.7])
}

fn effects(
    discs: &Arc<ObstacleArray>,
    n: usize,
    tension: EdgeTension,
    k_a: f64,
    k_w: f64,
    instruction_set: InstructionSet,
) -> RingEffects {
    let eps = 0.1 * regular_edge(n);
    RingEffects {
        tension,
        area: Area { stiffness: k_a, rest: MASS },
        gravity: Gravity::new(n),
        drag: Drag::Far { rate: 1.0 / V_T },
        eps_squared: eps * eps,
        walls: Box::new(Contact::new(discs.clone(), ContactKind::Edge, n, k_w, DELTA, instruction_set)),
        others: Vec::new(),
    }
}

fn elastic(n: usize, gamma: f64, kappa: f64) -> EdgeTension {
    EdgeTension::Springs { gamma, stiffness: kappa * gamma * n as f64, rest: regular_edge(n) }
}

fn circle(n: usize, x: f64) -> Ring {
    Ring::regular(n, [x, 10.0], Ring::regular_radius(n))
}

/// A ring bent out of shape around `centre`, on no symmetry.
fn bent(n: usize, centre: [f64; 2]) -> Ring {
    let mut ring = Ring::regular(n, [0.0, 0.0], 0.5);
    for i in 0..n {
        let angle = 0.37 + 2.0 * std::f64::consts::PI * i as f64 / n as f64;
        ring.x[i] = centre[0] + ring.x[i] * (1.0 + 0.1 * libm::sin(3.0 * angle) + 0.004 * libm::cos(17.0 * angle));
        ring.y[i] = centre[1] + ring.y[i] * (1.0 + 0.07 * libm::cos(2.0 * angle));
    }
    ring.close();
    ring
}

fn ek_ratio(kinetic: f64) -> f64 {
    kinetic / (0.5 * MASS * V_T * V_T)
}

#[test]
fn a_free_droplet_reaches_its_terminal_speed_exactly() {
    let mut motion = ImplicitMotion::start(
        circle(N, 10.0),
        effects(&discs(&[], &[]), N, elastic(N, 1.0, 1e-3), 1e4, TOTAL, InstructionSet::new()),
        DT,
        InstructionSet::new(),
    );
    motion.advance(500, &NEVER).unwrap();
    let seen = motion.observe();
    assert!((seen.velocity / V_T - 1.0).abs() < 1e-9, "{}", seen.velocity / V_T - 1.0);
    assert_eq!(motion.counts.refused, 0);
}

#[test]
fn the_scheme_is_of_second_order() {
    // A droplet that relaxes and falls; fast modes have died when it is looked at.
    let at_one = |steps: u32| {
        let edge = elastic(64, 1.0, 0.1);
        let free = effects(&discs(&[], &[]), 64, edge, 1e2, 0.0, InstructionSet::new());
        let mut motion =
            ImplicitMotion::start(bent(64, [10.0, 10.0]), free, 1.0 / f64::from(steps), InstructionSet::new());
        motion.largest_move = 1.0;
        motion.advance(u64::from(steps), &NEVER).unwrap();
        assert_eq!(motion.counts.refused, 0);
        (motion.ring.x, motion.ring.y)
    };
    let exact = at_one(12_800);
    let error = |steps| {
        let (x, y) = at_one(steps);
        (0..64).fold(0.0_f64, |a, i| a.max((x[i] - exact.0[i]).abs()).max((y[i] - exact.1[i]).abs()))
    };
    let errors = [100, 200, 400, 800].map(error);
    for pair in errors.windows(2) {
        let order = libm::log2(pair[0] / pair[1]);
        assert!((1.8..2.3).contains(&order), "errors {errors:?}, order {order:.2}");
    }
}

#[test]
fn with_drag_the_total_energy_never_rises() {
    for k_w in [TOTAL, LITERAL] {
        let edge = elastic(N, 1.0, 1e-3);
        let mut motion = ImplicitMotion::start(
            circle(N, 9.9),
            effects(&funnel(), N, edge, 1e4, k_w, InstructionSet::new()),
            DT,
            InstructionSet::new(),
        );
        let mut lowest = f64::INFINITY;
        for _ in 0..1000 {
            motion.advance(1, &NEVER).unwrap();
            let seen = motion.observe();
            let energy = seen.energy();
            assert!(energy <= lowest + 1e-12, "rose by {:.2e}", energy - lowest);
            lowest = lowest.min(energy);
        }
        assert!(motion.observe().contacts == 2, "the droplet must have met both discs");
    }
}

/// Falls into the funnel until E_k/E_t < 1e-17; the time, and the centroid, of that.
fn settle(motion: &mut ImplicitMotion, longest: u32) -> (u32, [f64; 2]) {
    for t in 1..=longest {
        motion.advance(50, &NEVER).expect("every step can be solved");
        motion.follow();
        let seen = motion.observe();
        if t > 5 && ek_ratio(seen.kinetic) < 1e-17 {
            assert!(motion.engulfed().is_none() && seen.contacts == 2);
            return (t, [seen.x, seen.y]);
        }
    }
    panic!("E_k/E_t is still {:.2e}", ek_ratio(motion.observe().kinetic));
}

#[test]
fn a_droplet_clogs_where_verlet_has_it_clog_whatever_the_wall_stiffness() {
    let edge = elastic(N, 1.5, 1e-3);
    let mut verlet = VerletMotion::start(
        circle(N, 9.9),
        effects(&funnel(), N, edge, 1e4, TOTAL, InstructionSet::new()),
        1e-3,
        InstructionSet::new(),
    );
    let mut seen = verlet.observe();
    for t in 0..1000 {
        verlet.advance(1000, &NEVER).unwrap();
        seen = verlet.observe();
        if t > 5 && ek_ratio(seen.kinetic) < 1e-17 {
            break;
        }
    }
    assert!(ek_ratio(seen.kinetic) < 1e-17, "{:.2e}", ek_ratio(seen.kinetic));
    for k_w in [TOTAL, LITERAL] {
        let mut motion = ImplicitMotion::start(
            circle(N, 9.9),
            effects(&funnel(), N, edge, 1e4, k_w, InstructionSet::new()),
            DT,
            InstructionSet::new(),
        );
        let (_, at) = settle(&mut motion, 1000);
        let off = ((at[0] - seen.x).powi(2) + (at[1] - seen.y).powi(2)).sqrt();
        // With the same stiffness it is the same minimum of the energy, kept from merging by round-off alone.
        assert!(off < if k_w == TOTAL { 1e-6 } else { 0.02 }, "{at:?} is {off:.2e} away from Verlet");
    }
}

#[test]
fn the_hard_corner_settles_with_its_area_kept() {
    let n = 256;
    let edge = elastic(n, 10.0, 1e-4);
    let mut motion = ImplicitMotion::start(
        circle(n, 9.9),
        effects(&funnel(), n, edge, 1e6, LITERAL, InstructionSet::new()),
        DT,
        InstructionSet::new(),
    );
    settle(&mut motion, 1000);
    let seen = motion.observe();
    // Gamma/R over K_a is 2.5e-5 of the area, and the wall gives by less than 1e-6.
    assert!(seen.area_error.unwrap().abs() < 1e-4 && seen.overlap < 1e-6, "{seen:?}");
}

#[test]
fn a_droplet_thrown_at_a_disc_takes_shorter_steps_and_does_not_pass_through_it() {
    let disc = discs(&[11.0], &[10.0]);
    let thrown = |dt: f64| {
        let mut motion = ImplicitMotion::start(
            circle(N, 10.0),
            effects(&disc, N, elastic(N, 1.0, 1e-3), 1e4, LITERAL, InstructionSet::new()),
            dt,
            InstructionSet::new(),
        );
        motion.ring.ux[..N].fill(10.0);
        motion
    };
    let mut motion = thrown(DT);
    for _ in 0..50 {
        motion.advance(1, &NEVER).unwrap();
        assert!(motion.engulfed().is_none());
        assert!(motion.observe().overlap < 0.5 * DELTA);
    }
    assert!(motion.counts.refused > 0 && motion.counts.accepted > 50);
}

#[test]
fn a_step_that_cannot_be_solved_is_an_unstable_run_and_says_so() {
    let mut motion = ImplicitMotion::start(
        circle(N, 9.9),
        effects(&funnel(), N, elastic(N, 1.0, 1e-3), 1e4, TOTAL, InstructionSet::new()),
        DT,
        InstructionSet::new(),
    );
    motion.advance(3, &NEVER).unwrap();
    motion.effects.area.rest = f64::NAN;
    let interruption = motion.advance(1, &NEVER).unwrap_err();
    let Interruption::Failed(failure) = interruption else { panic!("{interruption:?}") };
    assert_eq!((failure.class, failure.step), (FailureClass::Unstable, 3));
    assert!(failure.reason.contains("no longer finite"), "{failure}");
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let run = |instruction_set| {
        let mut motion = ImplicitMotion::start(
            circle(N, 9.9),
            effects(&funnel(), N, elastic(N, 1.0, 1e-3), 1e4, LITERAL, instruction_set),
            DT,
            instruction_set,
        );
        motion.advance(500, &NEVER).unwrap();
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
    let begin = || {
        ImplicitMotion::start(
            circle(N, 9.9),
            effects(&funnel(), N, elastic(N, 1.0, 1e-3), 1e4, LITERAL, InstructionSet::new()),
            DT,
            InstructionSet::new(),
        )
    };
    let (mut whole, mut cut) = (begin(), begin());
    whole.advance(500, &NEVER).unwrap();
    for steps in [1, 7, 92, 300, 100] {
        cut.advance(steps, &NEVER).unwrap();
        cut.observe();
    }
    assert!(whole.ring.x == cut.ring.x && whole.ring.uy == cut.ring.uy);
}

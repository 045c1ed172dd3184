//! Compares second derivatives with central differences of the gradient, term by term.

use super::*;
use crate::parameters::{ContactKind, MASS, regular_edge};
use crate::physics::ring::forces::contact::{Contact, WallContact};
use crate::physics::ring::forces::{
    area::Area, drag::Drag, gravity::Gravity, hydrostatic::Hydrostatic, tension::EdgeTension,
};
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::physics::walls::{plate::Plate, wall::Walls, wedge::ChannelWalls};
use std::sync::Arc;

const N: usize = 128;
const DELTA: f64 = std::f64::consts::PI / 256.0;
const NO_AREA: Area = Area { stiffness: 0.0, rest: MASS };

fn contact<W: Walls>(walls: W, kind: ContactKind, k_w: f64, delta: f64) -> Box<dyn WallContact> {
    Box::new(Contact::new(Arc::new(walls), kind, N, k_w, delta, InstructionSet::new()))
}

fn no_walls() -> Box<dyn WallContact> {
    contact(ObstacleArray::from_centres(40.0, 0.15, &[], &[]), ContactKind::Edge, 0.0, DELTA)
}

/// A deformed ring around `centre` without any symmetry.
fn bent(centre: [f64; 2]) -> Ring {
    let mut ring = Ring::regular(N, [0.0, 0.0], 0.5);
    for i in 0..N {
        let angle = 0.37 + 2.0 * std::f64::consts::PI * i as f64 / N as f64;
        ring.x[i] = centre[0] + ring.x[i] * (1.0 + 0.1 * libm::sin(3.0 * angle) + 0.004 * libm::cos(17.0 * angle));
        ring.y[i] = centre[1] + ring.y[i] * (1.0 + 0.07 * libm::cos(2.0 * angle));
    }
    ring.close();
    ring
}

fn shifted(ring: &Ring, h: f64, [vx, vy]: [&[f64]; 2]) -> Ring {
    let mut moved = ring.clone();
    for i in 0..N {
        moved.x[i] += h * vx[i];
        moved.y[i] += h * vy[i];
    }
    moved.close();
    moved
}

/// `A v`.
fn times(a: &Stiffness, [vx, vy]: [&[f64]; 2]) -> [Vec<f64>; 2] {
    let (mut x, mut y) = (vec![0.0; N], vec![0.0; N]);
    for i in 0..N {
        let j = (i + 1) % N;
        x[i] += a.own_xx[i] * vx[i] + a.own_xy[i] * vy[i] + a.next_xx[i] * vx[j] + a.next_xy[i] * vy[j];
        y[i] += a.own_xy[i] * vx[i] + a.own_yy[i] * vy[i] + a.next_yx[i] * vx[j] + a.next_yy[i] * vy[j];
        x[j] += a.next_xx[i] * vx[i] + a.next_yx[i] * vy[i];
        y[j] += a.next_xy[i] * vx[i] + a.next_yy[i] * vy[i];
    }
    [x, y]
}

fn along(field: &Field, [vx, vy]: [&[f64]; 2]) -> f64 {
    (0..N).map(|i| field.x[i] * vx[i] + field.y[i] * vy[i]).sum()
}

/// Gradient, matrix and gradient of the area at `ring`.
fn derivatives(effects: &RingEffects, ring: &Ring) -> (Field, Stiffness, Field) {
    let (mut potential, mut here) = (Potential::new(N, InstructionSet::new()), ring.clone());
    potential.evaluate(&Field::zero(N), &mut here, effects);
    potential.assemble(&here, effects, Parts::All, false);
    (potential.gradient, potential.stiffness, potential.area_gradient)
}

/// Compares along 20 directions, with differences of step `h`, to `tolerance` times the largest value. `more` adds to
/// the product of matrix and direction the terms that are kept apart from the matrix.
fn check(
    effects: &RingEffects,
    ring: &Ring,
    h: f64,
    tolerance: f64,
    more: impl Fn(&Field, &Field, [&[f64]; 2], [&mut [f64]; 2]),
) {
    let (gradient, matrix, area_gradient) = derivatives(effects, ring);
    assert!(gradient.largest(InstructionSet::new()) > 0.0, "the term must act on this ring");
    for k in 0..20 {
        let direction = |phase: f64| -> Vec<f64> {
            (0..N).map(|i| libm::sin(phase + (1.0 + 0.1 * f64::from(k)) * i as f64)).collect()
        };
        let (vx, vy) = (direction(0.3), direction(1.9));
        let v = [&vx[..], &vy[..]];
        let (ahead, ..) = derivatives(effects, &shifted(ring, h, v));
        let (behind, ..) = derivatives(effects, &shifted(ring, -h, v));
        let [mut ax, mut ay] = times(&matrix, v);
        more(&gradient, &area_gradient, v, [&mut ax, &mut ay]);
        let scale = ax.iter().chain(&ay).fold(0.0_f64, |a, b| a.max(b.abs()));
        for i in 0..N {
            for (exact, a, b) in [(ax[i], ahead.x[i], behind.x[i]), (ay[i], ahead.y[i], behind.y[i])] {
                let slope = (a - b) / (2.0 * h);
                assert!(
                    (exact - slope).abs() < tolerance * scale,
                    "direction {k} vertex {i}: {exact} {slope} of {scale}"
                );
            }
        }
    }
}

/// Checks one term alone; the area's term of rank one is added to the matrix.
fn check_stiffness(tension: EdgeTension, area: Area, walls: Box<dyn WallContact>, ring: &Ring) {
    let eps = 0.1 * regular_edge(N);
    let (gravity, drag, eps_squared) = (Gravity::off(), Drag::Far { rate: 0.0 }, eps * eps);
    let mut effects = RingEffects { tension, area, gravity, drag, eps_squared, walls, others: Vec::new() };
    effects.walls.moved(f64::INFINITY, ring);
    check(&effects, ring, 1e-8, 2e-5, |_, area_gradient, v, [ax, ay]| {
        let push = area.stiffness * along(area_gradient, v);
        for i in 0..N {
            ax[i] += push * area_gradient.x[i];
            ay[i] += push * area_gradient.y[i];
        }
    });
}

#[test]
fn tension_has_the_second_derivatives_it_states() {
    check_stiffness(EdgeTension::Line { gamma: 1.3 }, NO_AREA, no_walls(), &bent([10.0, 10.0]));
}

#[test]
fn perimeter_elasticity_has_the_second_derivatives_it_states() {
    let springs = EdgeTension::Springs { gamma: 0.0, stiffness: 80.0, rest: regular_edge(N) };
    check_stiffness(springs, NO_AREA, no_walls(), &bent([10.0, 10.0]));
}

#[test]
fn linear_tension_has_the_second_derivatives_it_states() {
    let rest = regular_edge(N);
    check_stiffness(EdgeTension::Linear { stiffness: 1.3 / rest, rest }, NO_AREA, no_walls(), &bent([10.0, 10.0]));
}

#[test]
fn area_elasticity_has_the_second_derivatives_it_states() {
    check_stiffness(EdgeTension::NONE, Area { stiffness: 2.0, rest: 0.5 }, no_walls(), &bent([0.0, 0.0]));
}

#[test]
fn contact_has_the_second_derivatives_it_states_for_every_shape_and_form() {
    // A large delta gives deep overlaps, at which the turning of the normals matters.
    fn touching<W: Walls>(walls: impl Fn() -> W, ring: &Ring) {
        for kind in [ContactKind::Edge, ContactKind::Vertex] {
            check_stiffness(EdgeTension::NONE, NO_AREA, contact(walls(), kind, 10.0, 0.1), ring);
        }
    }
    let ring = bent([0.0, 0.0]);
    touching(|| ObstacleArray::from_centres(40.0, 0.15, &[0.64, 0.1, 39.4], &[0.17, 0.66, 0.2]), &ring);
    let (mut top, mut nearest) = (0.0, f64::INFINITY);
    for i in 0..N {
        if ring.y[i] > 0.0 && ring.x[i].abs() < nearest {
            (top, nearest) = (ring.y[i], ring.x[i].abs());
        }
    }
    for tip_radius in [0.0, 0.1] {
        touching(|| ChannelWalls::new(2.0 * (top + 0.02), 45.0, tip_radius), &ring);
    }
    touching(|| Plate, &bent([-0.5, 0.0]));
}

#[test]
fn hydrostatic_gravity_has_the_second_derivatives_it_states_but_for_changes_of_the_area() {
    let ring = bent([0.3, -0.2]);
    let mut effects = RingEffects {
        tension: EdgeTension::NONE,
        area: NO_AREA,
        gravity: Gravity::off(),
        drag: Drag::Far { rate: 0.0 },
        eps_squared: 0.0,
        walls: no_walls(),
        others: vec![Box::new(Hydrostatic)],
    };
    effects.walls.moved(f64::INFINITY, &ring);
    let (area, _) = ring.area_and_perimeter();
    // The full second derivative is the matrix minus (g grad a^T + grad a g^T)/a, with g the gradient of the energy.
    check(&effects, &ring, 1e-6, 1e-6, |g, a, v, [ax, ay]| {
        let (of_g, of_a) = (along(g, v), along(a, v));
        for i in 0..N {
            ax[i] -= (g.x[i] * of_a + a.x[i] * of_g) / area;
            ay[i] -= (g.y[i] * of_a + a.y[i] * of_g) / area;
        }
    });
}

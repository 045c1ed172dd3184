use super::*;
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::physics::walls::wedge::ChannelWalls;
use std::f64::consts::PI;

const DELTA: f64 = PI / 256.0;

fn potential<W: Walls>(walls: W) -> Potential<W> {
    let (n, k_w) = (48, 2e4);
    let reach = walls.surface() + 0.5 * DELTA;
    let folds = Some(SelfContact::new(n, DELTA, k_w));
    Potential { walls: Arc::new(walls), gamma: 0.7, k_a: 300.0, rest: 0.25 * PI, weight: 0.25 * PI, k_w, reach, folds }
}

/// A droplet that two tips, or some discs, press in.
fn pressed(n: usize) -> Polygon {
    let angle = |i: usize| 2.0 * PI * (i as f64 + 0.3) / n as f64;
    let radius = |a: f64| 0.47 + 0.03 * libm::cos(2.0 * a) + 0.01 * libm::sin(3.0 * a);
    let x = (0..n).map(|i| 0.02 + radius(angle(i)) * libm::cos(angle(i))).collect();
    let y = (0..n).map(|i| radius(angle(i)) * libm::sin(angle(i))).collect();
    Polygon { x, y }
}

fn evaluation<W: Walls>(potential: &Potential<W>, shape: &Polygon) -> Evaluation {
    let (mut nearby, mut seen) = (Nearby::none(), Evaluation::default());
    nearby.list(potential.walls.as_ref(), [0.0; 2], shape, potential.reach, potential.folds.as_ref());
    potential.evaluate(shape, &nearby, &mut seen);
    let of_shape = Foreseen { pressure: seen.load.pressure, push: f64::INFINITY };
    potential.differentiate_twice(shape, &nearby, of_shape, &mut seen);
    seen
}

fn moved(shape: &Polygon, k: usize, by: f64) -> Polygon {
    let mut shape = shape.clone();
    if k.is_multiple_of(2) {
        shape.x[k / 2] += by
    } else {
        shape.y[k / 2] += by
    }
    shape
}

/// All second derivatives as one matrix.
fn hessian<W: Walls>(potential: &Potential<W>, seen: &Evaluation) -> Vec<Vec<f64>> {
    let size = seen.gradient.len();
    let mut full = vec![vec![0.0; size]; size];
    for &(i, j, block) in seen.curvature.clone().blocks() {
        for (k, value) in block.into_iter().enumerate() {
            full[2 * i + k / 2][2 * j + k % 2] += value;
        }
    }
    let couple = potential.weight / seen.area;
    let (a, x) = (&seen.area_gradient, &seen.x_gradient);
    for i in 0..size {
        for j in 0..size {
            full[i][j] += potential.k_a * a[i] * a[j] + couple * (a[i] * x[j] + x[i] * a[j]);
        }
    }
    full
}

fn derivatives_agree<W: Walls>(potential: &Potential<W>, shape: &Polygon, strings: usize) {
    let seen = evaluation(potential, shape);
    assert!(
        seen.strings.iter().filter(|string| !string.is_straight()).count() >= strings,
        "edges bend round the walls"
    );
    let (full, h) = (hessian(potential, &seen), 1e-7);
    for k in 0..seen.gradient.len() {
        let (ahead, behind) = (evaluation(potential, &moved(shape, k, h)), evaluation(potential, &moved(shape, k, -h)));
        let slope = (ahead.energy - behind.energy) / (2.0 * h);
        assert!((slope - seen.gradient[k]).abs() < 1e-6, "force {k}: {slope} {}", seen.gradient[k]);
        for j in 0..seen.gradient.len() {
            let second = (ahead.gradient[j] - behind.gradient[j]) / (2.0 * h);
            let scale = potential.k_w * 1e-3;
            assert!((second - full[j][k]).abs() < scale, "stiffness {j} {k}: {second} {}", full[j][k]);
        }
    }
}

#[test]
fn force_and_stiffness_are_the_derivatives_of_the_energy_between_tips() {
    derivatives_agree(&potential(ChannelWalls::new(0.87, 45.0, 0.0)), &pressed(48), 2);
}

#[test]
fn force_and_stiffness_are_the_derivatives_of_the_energy_among_discs() {
    let discs = ObstacleArray::from_centres(20.0, 0.15, &[0.02, 0.672, -0.6], &[0.581, 0.02, 0.3]);
    derivatives_agree(&potential(discs), &pressed(48), 1);
}

#[test]
fn the_pressure_of_a_circle_at_rest_is_that_of_laplace() {
    let walls = ChannelWalls::new(50.0, 45.0, 0.0);
    let potential = Potential { weight: 0.0, ..potential(walls) };
    let n = 64;
    let radius = 0.5;
    let circle = |r: f64| Polygon {
        x: (0..n).map(|i| r * libm::cos(2.0 * PI * i as f64 / n as f64)).collect(),
        y: (0..n).map(|i| r * libm::sin(2.0 * PI * i as f64 / n as f64)).collect(),
    };
    // The radius at which nothing pulls.
    let pull = |r: f64| evaluation(&potential, &circle(r)).gradient[0];
    let (mut low, mut high) = (0.9 * radius, 1.1 * radius);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if pull(middle) > 0.0 { high = middle } else { low = middle }
    }
    let seen = evaluation(&potential, &circle(low));
    let pressure = -potential.k_a * (seen.area - potential.rest);
    assert!((pressure / (potential.gamma / low) - 1.0).abs() < 2e-3, "{pressure}");
}

#[test]
fn a_string_takes_over_smoothly_from_a_wall_that_gives_way() {
    // Energy and force of an edge that is pressed ever deeper against a tip have no jump.
    let load = Load { gamma: 0.8, k_w: 1e5, pressure: 1.5, weight: 1.0, centroid: 0.1 };
    let at = |depth: f64| {
        let (a, b) = ([-0.03, -0.005 + depth], [0.02, -0.005 + depth]);
        // The liquid is below the edge, which runs towards -x.
        Taut::of(0, 0, b, a, [0.0, 0.0], 0.006).map(|mut string| {
            string.settle(&load);
            (string.is_straight(), string.force(&load))
        })
    };
    let (mut last, mut kinds) = (None::<f64>, [false; 2]);
    for step in 0..4000 {
        let depth = -0.0011 + 1e-6 * f64::from(step);
        let (straight, push) =
            at(depth).map_or((true, 0.0), |(straight, term)| (straight, term.gradient[1] + term.gradient[3]));
        kinds[usize::from(straight)] = true;
        if let Some(last) = last {
            assert!((push - last).abs() < 1e5 * 1.1e-6 + 1e-4, "the force jumps from {last} to {push} at {depth}");
        }
        last = Some(push);
    }
    assert!(kinds[0] && kinds[1], "both kinds occur");
}

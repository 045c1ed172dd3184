//! What holds for every array, whatever method placed its discs.

use crate::parameters::{Density, ObstacleField};
use crate::physics::walls::arrays::obstacles::ObstacleArray;
use crate::physics::walls::disc::Disc;

fn field(density: Density) -> ObstacleField {
    ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density, box_size: 30.0 }
}

fn all(array: &ObstacleArray) -> Vec<Disc> {
    let mut discs = Vec::new();
    let end = array.box_size * (1.0 - 1e-15);
    array.for_each_in([0.0, 0.0], [0.0, end, 0.0, end], |disc| discs.push(disc));
    discs
}

#[test]
fn no_two_discs_come_closer_than_the_gap() {
    let fields = [
        field(Density::Saturated),
        field(Density::Number(2.7)),
        // Boxes of few cells, where most neighbours are periodic images.
        ObstacleField { w_ob: 5.0, sigma_ob: 5.0, density: Density::Saturated, box_size: 20.0 },
        ObstacleField { w_ob: 2.0, sigma_ob: 3.0, density: Density::Saturated, box_size: 20.0 },
    ];
    for field in fields {
        let spacing = field.w_ob + field.sigma_ob;
        let array = ObstacleArray::generate(&field, 3).unwrap();
        assert!(array.len() > 2);
        for disc in all(&array) {
            let mut near = 0;
            array.for_each_in([disc.x, disc.y], [-spacing, spacing, -spacing, spacing], |other| {
                near += usize::from(other.x * other.x + other.y * other.y <= spacing * spacing);
            });
            assert_eq!(near, 1, "only the disc itself");
        }
        if field.density == Density::Saturated {
            let step = field.box_size / 100.0;
            let point = |k: u32| [f64::from(k % 100) * step, f64::from(k / 100) * step];
            let room = spacing - array.radius + 1e-9;
            assert!((0..10_000).all(|k| array.clearance(point(k), 2.0 * spacing) <= room), "no room is left");
        }
    }
}

#[test]
fn a_saturated_array_has_the_known_coverage_and_no_room_left() {
    // Jamming coverage of random sequential addition of discs: 0.5470 (Feder 1980; Zhang and Torquato 2013).
    let array = ObstacleArray::generate(&ObstacleField { box_size: 100.0, ..field(Density::Saturated) }, 1).unwrap();
    let coverage = array.len() as f64 * std::f64::consts::PI * 0.25 * 0.25 / 1e4;
    assert!((coverage - 0.547).abs() < 0.004, "{coverage}");
    for k in 0..20_000_u32 {
        let point = [f64::from(k % 151) * 0.66, f64::from(k / 151) * 0.75];
        assert!(array.clearance(point, 1.0) <= 0.35 + 1e-9);
    }
}

#[test]
fn a_given_density_is_met_and_an_impossible_one_refused() {
    let array = ObstacleArray::generate(&field(Density::Number(0.35)), 0).unwrap();
    assert_eq!(array.len(), 315);
    let error = ObstacleArray::generate(&field(Density::Number(2.95)), 0).unwrap_err();
    assert!(error.reason.contains("density = 2.95"), "{error}");
}

#[test]
fn the_same_seed_gives_the_same_array_and_another_seed_another() {
    for density in [Density::Number(1.0), Density::Number(2.7), Density::Saturated] {
        let make = |seed| all(&ObstacleArray::generate(&field(density), seed).unwrap());
        assert_eq!(make(5), make(5));
        assert_ne!(make(5), make(6));
    }
}

#[test]
fn threads_that_look_here_and_there_see_the_same_discs() {
    let field = ObstacleField { box_size: 60.0, ..field(Density::Saturated) };
    let seen = [1, 2, 3].map(|step| {
        let array = ObstacleArray::generate(&field, 7).unwrap();
        std::thread::scope(|scope| {
            for thread in 0..2 {
                let array = &array;
                scope.spawn(move || {
                    for k in (thread..60).step_by(step) {
                        array.clearance([f64::from(k), f64::from(37 * k % 60)], 2.0);
                    }
                });
            }
        });
        all(&array)
    });
    assert_eq!(seen[0], seen[1]);
    assert_eq!(seen[0], seen[2]);
}

#[test]
fn discs_repeat_with_the_box() {
    for density in [Density::Number(1.0), Density::Saturated] {
        let array = ObstacleArray::generate(&field(density), 2).unwrap();
        let look = |origin: [f64; 2]| {
            let mut seen = Vec::new();
            array.for_each_in(origin, [-2.0, 2.0, -2.0, 2.0], |disc| seen.push(disc));
            seen.sort_by_key(|disc| disc.id);
            seen
        };
        assert_eq!(look([29.0, 1.0]), look([29.0 - 30.0, 1.0 + 90.0]));
        assert!(look([29.0, 1.0]).len() > 8);
    }
}

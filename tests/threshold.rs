//! Laws of the static theory of passages.

use meniscus::parameters::MASS;
use meniscus::study::threshold::{DEFAULT_NODES, End, Passage, Throat};
use std::f64::consts::PI;

const DELTA: f64 = PI / 256.0;

fn passage(throat: Throat) -> Passage {
    Passage::of(throat, MASS).unwrap_or_else(|lost| panic!("{throat:?}: {lost}"))
}

fn orifice(w: f64) -> Throat {
    Throat::channel(w, 45.0, 0.0, DELTA)
}

/// Orifices and gaps of many kinds, from wide to narrow.
fn throats() -> impl Iterator<Item = Throat> {
    let wedges = [5.0, 45.0, 85.0].into_iter().flat_map(|angle| [0.0, 0.3, 3.0].map(move |tip| (angle, tip)));
    let channels = wedges.flat_map(|(angle, tip)| [0.1, 0.4, 0.9].map(|w| Throat::channel(w, angle, tip, DELTA)));
    let pairs = [0.1, 0.3, 1.0].into_iter().flat_map(|sigma| [0.2, 0.5, 0.9].map(|w| Throat::discs(w, sigma, DELTA)));
    channels.chain(pairs)
}

#[test]
fn a_droplet_that_nothing_presses_is_a_circle_and_pulls_at_nothing() {
    for throat in throats() {
        let first = passage(throat).path[0];
        assert!((first.perimeter - PI).abs() < 1e-12 && first.slope == 0.0);
        assert!((first.pressure - 2.0).abs() < 1e-12, "Laplace's law, over the tension");
    }
    let wide = passage(orifice(1.0 + 2.0 * DELTA));
    assert_eq!((wide.end, wide.path.len(), wide.gamma_c()), (End::Free, 0, f64::INFINITY));
    let shut = passage(orifice(0.9 * DELTA));
    assert_eq!((shut.end, shut.path.len(), shut.gamma_c()), (End::Closed, 0, 0.0));
}

#[test]
fn between_nearly_parallel_walls_it_has_two_straight_sides_and_two_half_circles() {
    let (gap, delta) = (0.7 + DELTA, DELTA);
    let d = gap - delta;
    let exact = PI * d + 2.0 * (MASS - 0.25 * PI * d * d) / d;
    let errors = [2.0, 1.0, 0.5].map(|angle| {
        let way = passage(Throat::channel(gap, angle, 0.0, delta));
        way.path.last().map_or(f64::NAN, |held| held.perimeter / exact - 1.0).abs()
    });
    assert!(errors[0] < 0.02 && errors[2] < 0.3 * errors[0], "{errors:?}");
}

#[test]
fn the_slope_is_that_of_the_perimeter() {
    for throat in throats() {
        let way = passage(throat);
        let work: f64 =
            way.path.windows(2).map(|pair| 0.5 * (pair[0].slope + pair[1].slope) * (pair[1].h - pair[0].h)).sum();
        let [first, last] = [0, way.path.len() - 1].map(|k| way.path[k].perimeter);
        assert!((work / (last - first) - 1.0).abs() < 5e-3, "{throat:?}: {work} {}", last - first);
    }
}

#[test]
fn in_the_middle_of_a_throat_it_is_its_own_mirror_image_and_nothing_pulls() {
    for w in [0.2, 0.4, 0.7, 0.9] {
        let way = passage(orifice(w));
        assert_eq!(way.end, End::Through);
        let last = way.path.len() - 1;
        let held = way.path[last];
        assert!(held.h == 0.0 && held.slope.abs() < 1e-8, "{held:?}");
        assert!((held.contact[0] + held.contact[1]).abs() < 1e-8);
        let outline = way.outline(last, 40);
        for (a, b) in outline.iter().zip(outline.iter().rev()) {
            assert!((a[0] + b[0]).abs() < 1e-8 && (a[1] - b[1]).abs() < 1e-8);
        }
    }
}

#[test]
fn thresholds_settle_with_the_number_of_nodes_to_ten_digits() {
    for throat in throats() {
        let exact = passage(throat).gamma_c();
        let error =
            |nodes| Passage::by_rule(throat, MASS, nodes).map_or(f64::NAN, |way| (way.gamma_c() / exact - 1.0).abs());
        let errors = [8, 16, 32].map(error);
        assert!(errors[0] < 0.02 && errors[1] < 1e-5 && errors[2] < 1e-10, "{throat:?}: {errors:?}");
        let finest = error(2 * DEFAULT_NODES);
        assert!(finest < 1e-10, "{throat:?}: {finest}");
    }
}

#[test]
fn a_threshold_does_not_depend_on_the_unit_of_length_apart_from_the_weight() {
    let [small, large] = [1.0, 3.0].map(|s| {
        Passage::of(Throat::channel(0.7 * s, 60.0, 0.1 * s, DELTA * s), MASS * s * s).expect("it is followed")
    });
    let slopes = [small, large].map(|way| way.steepest.expect("it touches").slope);
    assert!((slopes[0] / slopes[1] - 1.0).abs() < 1e-9, "{slopes:?}");
}

#[test]
fn wider_orifices_let_stiffer_droplets_pass() {
    let thresholds: Vec<f64> = (1..20).map(|k| passage(orifice(0.05 * f64::from(k))).gamma_c()).collect();
    assert!(thresholds.windows(2).all(|pair| pair[0] < pair[1]), "{thresholds:?}");
    // The paper's droplets of its Figure 3, which pass.
    for (w, gamma) in [(0.4, 0.16), (0.7, 1.08), (0.9, 1.7)] {
        assert!(passage(orifice(w)).gamma_c() > gamma);
    }
}

#[test]
fn discs_are_wedges_with_round_tips_as_long_as_contact_stays_on_the_tips() {
    let steep = 85.0_f64;
    for gap in [0.4, 0.5, 0.7, 0.9] {
        let [pair, wedges] = [Throat::discs(gap, 0.3, DELTA), Throat::channel(gap, steep, 0.15, DELTA)].map(passage);
        let farthest = pair.path.iter().flat_map(|held| held.contact).fold(0.0, |far: f64, place| far.max(place.abs()));
        assert!(farthest < steep.to_radians(), "{gap}: {farthest}");
        assert!((pair.gamma_c() / wedges.gamma_c() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn round_narrow_pairs_of_small_discs_it_folds_from_outside() {
    let ends = |sigma_ob: f64| [0.1, 0.2, 0.3, 0.4, 0.5].map(|gap| passage(Throat::discs(gap, sigma_ob, DELTA)).end);
    assert_eq!(ends(0.3), [End::Around, End::Around, End::Around, End::Through, End::Through]);
    assert!(ends(3.0).iter().all(|end| *end == End::Through), "no droplet is wide enough for large ones");
}

/// Area, moment of x, and length of the upper half of an outline, closed along the axis.
fn integrals(outline: &[[f64; 2]]) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for pair in outline.windows(2) {
        let ([x0, y0], [x1, y1]) = (pair[0], pair[1]);
        let (dx, dy) = (x1 - x0, y1 - y0);
        sums[0] += 0.5 * (y0 + y1) * dx;
        sums[1] += dx * (x0 * y0 + 0.5 * (x0 * dy + y0 * dx) + dx * dy / 3.0);
        sums[2] += libm::hypot(dx, dy);
    }
    sums
}

/// The outline moved along its normals by `amount` of a place (0 to 1) on the free surfaces, and not at the wall.
fn moved(outline: &[[f64; 2]], count: usize, amount: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let last = outline.len() - 1;
    let normal = |k: usize| {
        let [a, b] = [outline[k.saturating_sub(1)], outline[(k + 1).min(last)]];
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        // On the axis the mirror image is the other neighbour.
        if k == 0 || k == last {
            [if k == 0 { -1.0 } else { 1.0 }, 0.0]
        } else {
            [-dy / libm::hypot(dx, dy), dx / libm::hypot(dx, dy)]
        }
    };
    let place = |k: usize| match k {
        k if k < count => (count - k) as f64 / count as f64,
        k if k > last - count => (k - (last - count)) as f64 / count as f64,
        _ => 0.0,
    };
    let there = |k: usize| {
        let ([x, y], [nx, ny]) = (outline[k], normal(k));
        let by = if place(k) > 0.0 { amount(if k < count { -place(k) } else { place(k) }) } else { 0.0 };
        [x + by * nx, y + by * ny]
    };
    (0..=last).map(there).collect()
}

#[test]
fn no_other_free_surface_with_that_area_and_centroid_is_shorter() {
    let (way, count) = (passage(orifice(0.6)), 400);
    for k in [way.path.len() / 3, way.path.len() / 2, way.path.len() - 1] {
        let outline = way.outline(k, count);
        let least = integrals(&outline);
        assert!((2.0 * least[0] - MASS).abs() < 1e-4 && (2.0 * least[2] - way.path[k].perimeter).abs() < 1e-4);
        for (mode, sign) in (1..6).flat_map(|mode| [(mode, 1.0), (mode, -1.0)]) {
            // A bump of either sign on either surface; two smooth ones restore area and moment.
            let bump = |s: f64, size: f64| sign * size * libm::sin(PI * f64::from(mode) * s) * s * s;
            let repaired = |size: f64, [p, q]: [f64; 2]| {
                moved(&outline, count, |s| bump(s, size) + s * s * if s > 0.0 { p } else { q })
            };
            let mut repair = [0.0; 2];
            for _ in 0..8 {
                let miss = |repair| {
                    let got = integrals(&repaired(0.01, repair));
                    [got[0] - least[0], got[1] - least[1]]
                };
                let (here, e) = (miss(repair), 1e-6);
                let [a, b] = [[e, 0.0], [0.0, e]].map(|d| {
                    let there = miss([repair[0] + d[0], repair[1] + d[1]]);
                    [(there[0] - here[0]) / e, (there[1] - here[1]) / e]
                });
                let det = a[0] * b[1] - b[0] * a[1];
                repair[0] -= (here[0] * b[1] - b[0] * here[1]) / det;
                repair[1] -= (a[0] * here[1] - here[0] * a[1]) / det;
            }
            let got = integrals(&repaired(0.01, repair));
            assert!((got[0] - least[0]).abs() < 1e-12 && (got[1] - least[1]).abs() < 1e-12);
            assert!(got[2] > least[2], "mode {mode}: {} is shorter by {:.1e}", got[2], least[2] - got[2]);
        }
    }
}

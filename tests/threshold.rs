//! Laws of the static theory of passages.

use meniscus::parameters::MASS;
use meniscus::study::threshold::{DEFAULT_NODES, End, Passage, Throat};
use std::f64::consts::PI;

const DELTA: f64 = PI / 256.0;

#[test]
#[ignore = "exploration"]
fn explore() {
    for angle in [5.0, 20.0, 45.0, 70.0, 85.0] {
        for (w, tip) in [
            (0.02, 0.0),
            (0.05, 0.0),
            (0.1, 0.0),
            (0.2, 0.0),
            (0.4, 0.0),
            (0.7, 0.0),
            (0.9, 0.0),
            (0.99, 0.0),
            (0.05, 0.3),
            (0.4, 0.3),
            (0.9, 0.3),
            (0.05, 3.0),
            (0.9, 3.0),
            (0.9, 10.0),
            (0.1, 10.0),
        ] {
            show(&format!("{angle} {w} {tip}"), Throat::channel(w, angle, tip, DELTA));
        }
    }
    for sigma in [0.1, 0.3, 1.0, 3.0] {
        for w in [0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9, 1.0, 1.02] {
            show(&format!("disc {sigma} {w}"), Throat::discs(w, sigma, DELTA));
        }
    }
}

fn show(name: &str, throat: Throat) {
    let begin = std::time::Instant::now();
    match Passage::of(throat, MASS) {
        Err(error) => println!("{name}: {error}"),
        Ok(passage) => {
            let less = Passage::by_rule(throat, MASS, DEFAULT_NODES / 2).map_or(f64::NAN, |p| p.gamma_c());
            let lowest = passage.path.windows(2).map(|p| p[1].h - p[0].h).fold(1.0, f64::min);
            println!(
                "{name}: {:?} {} {:.6} {:.1e} {:?} {:.0} ms; min dh {lowest:.1e} last {:?}",
                passage.end,
                passage.path.len(),
                passage.gamma_c(),
                less / passage.gamma_c() - 1.0,
                passage.steepest.map(|s| (s.h, s.contact)),
                begin.elapsed().as_secs_f64() * 1e3,
                passage.path.last().map(|p| p.contact),
            );
        }
    }
}

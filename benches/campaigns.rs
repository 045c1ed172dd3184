//! Everything around the kernels: arrays, executor, store, fits. Seeded, and checked for the right answer first.
//!
//! ```text
//! cargo bench --bench campaigns
//! ```

#![allow(missing_docs, reason = "a program")]
#![allow(clippy::print_stdout, reason = "a program that answers on stdout")]
#![allow(clippy::unwrap_used, reason = "a bench that cannot go on has failed")]

use meniscus::parameters::{Density, ObstacleField};
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use meniscus::study::survival::decay_length::{DecayLength, Lifetime, Lifetimes, maximum_likelihood};
use std::process::Command;
use std::time::Instant;

/// Median seconds of `runs` runs of `work`.
fn seconds<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let begin = Instant::now();
            std::hint::black_box(work());
            begin.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[runs / 2]
}

fn arrays() {
    let (few, many) = (Density::Number(0.39), Density::Number(2.0));
    for (name, density, expected) in
        [("saturated", Density::Saturated, 6.96e5), ("0.39 a sigma^2", few, 97_500.0), ("2 a sigma^2", many, 500_000.0)]
    {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density, box_size: 500.0 };
        let whole = || {
            let array = ObstacleArray::generate(&field, 1).unwrap();
            (array.len(), array)
        };
        let (discs, array) = whole();
        assert!((discs as f64 / expected - 1.0).abs() < 0.01, "{discs} discs");
        let bytes = array.bytes() as f64 / discs as f64;
        // What a run of 100 sigma asks for.
        let path = seconds(3, || {
            let array = ObstacleArray::generate(&field, 1).unwrap();
            let (start, _) = array.widest_gap_near_centre();
            (0..1000).map(|k| array.clearance([start[0] + 0.1 * f64::from(k), start[1]], 1.5)).sum::<f64>()
        });
        let time = seconds(3, whole);
        println!(
            "array of {discs} discs, {name}: along a path of 100 sigma {path:.3} s, the whole {time:.3} s, {bytes:.0} bytes a disc"
        );
    }
}

fn fits() {
    // Quantiles of the exponential distribution of decay length 25.
    let lifetimes = || {
        let of = |i: u32| Lifetime { r: -25.0 * libm::log(1.0 - (f64::from(i) + 0.5) / 1000.0), clogged: true };
        Lifetimes::new((0..1000).map(of).collect())
    };
    let fit = maximum_likelihood(&lifetimes());
    assert!(matches!(fit, DecayLength::Measured { lambda, .. } if (lambda / 25.0 - 1.0).abs() < 0.01), "{fit:?}");
    println!("lambda of 1000 runs with its interval: {:.1} us", 1e6 * seconds(21, || maximum_likelihood(&lifetimes())));
}

/// Jobs of no length: what planning, executor, writer and store cost each.
fn jobs() {
    let folder = tempfile::tempdir().unwrap();
    let text = "name = \"short\"\nmodel = \"SP\"\nscene = \"channel\"\nw = 0.7\ne_w = 1.0\nh_start = -20.0\nruns_per_point = 20000\nlimits = { t_max = 1.0 }\n";
    std::fs::write(folder.path().join("short.toml"), text).unwrap();
    let mut store = 0;
    let time = seconds(3, || {
        store += 1;
        let done = Command::new(env!("CARGO_BIN_EXE_meniscus"))
            .args(["run", "short.toml", "--quiet", "--store"])
            .arg(format!("store{store}"))
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert!(done.status.success());
    });
    println!("20000 jobs of 1 t0 on all cores, durable: {time:.2} s, {:.0} jobs a second", 2e4 / time);
}

fn main() {
    arrays();
    fits();
    jobs();
}

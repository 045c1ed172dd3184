//! Laws of the integrators as jobs take them: the same physics, and what happens where one of them gives up.

#[path = "common/single.rs"]
mod single;

use meniscus::campaign::file::Campaign;
use meniscus::parameters::Integrator;
use meniscus::results::trajectory::{FailureClass, Outcome};
use single::{job, run};

const ARRAY: &str =
    "sample_every = 1.0\nscene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\ndensity = 0.7\nbox_size = 20.0\n";

#[test]
fn all_integrators_take_a_droplet_through_the_channel_alike() {
    for physics in ["", "b0 = 0.1"] {
        let passage = |integrator: &str, step: &str| {
            let keys = "sample_every = 1.0\nscene = \"channel\"\nw = 0.9\ngamma = 0.5\nh_start = -1.0\nn_vertices = 128\nv_t = 0.08";
            let passage = run(&format!("{keys}\nintegrator = \"{integrator}\"\n{step}\n{physics}"), 0).unwrap();
            assert_eq!(passage.outcome, Outcome::Exited);
            passage
        };
        let verlet = passage("verlet", "dt = 5e-4");
        for (integrator, step) in [("implicit", "dt = 0.02"), ("adaptive", ""), ("adaptive", "step_error = 1e-3")] {
            let other = passage(integrator, step);
            let (a, b) = (verlet.shape_max.unwrap(), other.shape_max.unwrap());
            assert!((a - b).abs() < 0.02 * (a - 1.0), "{physics} {integrator}: A_max {a} and {b}");
            let (a, b) = (verlet.v_g_mean.unwrap(), other.v_g_mean.unwrap());
            assert!((a / b - 1.0).abs() < 0.01, "{physics} {integrator}: mean speeds {a} and {b}");
            for (i, h) in other.samples.h.iter().enumerate().take(verlet.samples.len()) {
                assert_eq!(other.samples.t[i], verlet.samples.t[i]);
                let t = other.samples.t[i];
                assert!((h - verlet.samples.h[i]).abs() < 5e-3, "{physics} {integrator}: {h} at t = {t}");
            }
        }
    }
}

const FREE: &str =
    "model = \"DP\"\nscene = \"channel\"\nw = 90.0\nh_start = -900.0\nn_vertices = 32\nlimits.t_max = 100.0\n";

/// Words that a campaign can put together, each with those of the others.
const CHOICES: [&[&str]; 6] = [
    &[
        "dynamics = \"vertex\"",
        "dynamics = \"vertex\"\nkappa = 0.0",
        "dynamics = \"vertex\"\nkappa = 0.3183",
        "dynamics = \"darcy\"",
    ],
    &["integrator = \"verlet\"", "integrator = \"implicit\"", "integrator = \"adaptive\""],
    &["gravity = \"vertex\"", "gravity = \"centroid\""],
    &["", "contact = \"vertex\"\nwall = \"per_vertex\"\ne_w = 1e4"],
    &["", "self_contact = \"off\""],
    &["", "b0 = 0.4"],
];

#[test]
fn every_droplet_that_a_campaign_can_name_falls_freely_as_a_circle_at_its_terminal_speed() {
    let combinations: usize = CHOICES.iter().map(|words| words.len()).product();
    let mut fallen = 0;
    for number in 0..combinations {
        let mut rest = number;
        let chosen = CHOICES.map(|words| {
            let word = words[rest % words.len()];
            rest /= words.len();
            word
        });
        for gamma in [0.01, 10.0] {
            let keys = format!("{FREE}gamma = {gamma}\n{}", chosen.join("\n"));
            let is_sound =
                Campaign::parse("falls.toml", &format!("name = \"falls\"\nruns_per_point = 1\n{keys}")).is_ok();
            if !is_sound {
                continue;
            }
            let fall = run(&keys, 0).unwrap();
            let (shape, v_g) = (fall.shape_max.unwrap(), fall.samples.v_g.last().unwrap());
            // An inscribed polygon of 32 edges has 1.0032.
            assert!(shape < 1.0034, "{keys}: shape {shape}");
            assert!((v_g - 1.0).abs() < 2e-3, "{keys}: {v_g} V_t");
            fallen += 1;
        }
    }
    assert_eq!(fallen, 2 * (3 * 3 * 2 * 2 * 2 + 2 * 2), "so many combinations are not refused");
}

#[test]
fn a_tip_that_pierces_the_ring_is_found() {
    let through = |contact: &str, engulfed: &str| {
        let keys = "scene = \"channel\"\nw = 0.7\ngamma = 1.85\nh_start = -1.2\nlimits.t_max = 300.0";
        run(&format!("{keys}\ncontact = \"{contact}\"\nengulfed = \"{engulfed}\""), 0)
    };
    let pierced = through("vertex", "fail").unwrap_err();
    assert_eq!(pierced.class, FailureClass::Engulfed);
    assert!(pierced.reason.contains("(0.000, "), "it names the tip: {}", pierced.reason);
    let goes_on = through("vertex", "record").unwrap();
    assert!(goes_on.engulfed_t.is_some());
    assert_eq!(through("edge", "fail").unwrap().engulfed_t, None, "edges are impenetrable");
}

#[test]
fn the_literal_wall_clogs_a_droplet_where_the_shared_one_does() {
    let clog = |keys: &str, seed| {
        let keys = format!("{ARRAY}gamma = 1.5\nn_vertices = 64\n{keys}\nlimits.ek_threshold = 1e-13");
        let trajectory = run(&keys, seed).unwrap();
        assert!(trajectory.energy_rise_max < 1e-9);
        (trajectory.overlap_max, trajectory.clog.expect("it clogs"))
    };
    for seed in [1, 2] {
        let (_, verlet) = clog("integrator = \"verlet\"", seed);
        let (_, implicit) = clog("integrator = \"implicit\"", seed);
        let (overlap, literal) = clog("wall = \"per_vertex\"", seed);
        let apart =
            |a: &meniscus::results::trajectory::Clog| ((a.x - verlet.x).powi(2) + (a.y - verlet.y).powi(2)).sqrt();
        assert!(apart(&implicit) < 1e-5, "seed {seed}: {:.2e}", apart(&implicit));
        assert!(apart(&literal) < 0.03 && overlap < 1e-7, "seed {seed}: {:.2e}", apart(&literal));
    }
}

#[test]
fn steps_do_not_depend_on_when_the_droplet_is_looked_at() {
    let keys = format!("{ARRAY}gamma = 1.09\nn_vertices = 64\nlimits.t_max = 64.0\nintegrator = \"adaptive\"");
    let seen = |looks: &str| {
        // ARRAY samples every t0.
        let keys = keys.replace("sample_every = 1.0", &format!("sample_every = {looks}"));
        run(&keys, 3).unwrap()
    };
    let (often, seldom) = (seen("0.25"), seen("16.0"));
    assert_eq!(often.refused, seldom.refused);
    assert_eq!((often.r_end, often.ek_ratio_end), (seldom.r_end, seldom.ek_ratio_end));
    for (i, t) in seldom.samples.t.iter().enumerate() {
        let same = often.samples.t.iter().position(|other| other == t).expect("a quarter divides 16");
        assert_eq!(seldom.samples.h[i].to_bits(), often.samples.h[same].to_bits(), "t = {t}");
    }
}

#[test]
fn steps_that_follow_their_error_end_where_much_finer_steps_end() {
    for (gamma, seed) in [(0.8, 0), (1.09, 1), (1.09, 2), (3.0, 3)] {
        let clog = |step: &str| {
            let keys = format!("{ARRAY}gamma = {gamma}\nn_vertices = 64\nlimits.ek_threshold = 1e-13\n{step}");
            let trajectory = run(&keys, seed).unwrap();
            assert!(trajectory.energy_rise_max < 1e-9, "{step}: {}", trajectory.energy_rise_max);
            trajectory
        };
        let (fine, adaptive) = (clog("integrator = \"implicit\"\ndt = 0.00625"), clog(""));
        assert_eq!(fine.outcome, Outcome::Clogged);
        assert!((fine.r_end - adaptive.r_end).abs() < 1e-3, "seed {seed}: {} and {}", fine.r_end, adaptive.r_end);
        assert!((fine.t_end / adaptive.t_end - 1.0).abs() < 0.02, "seed {seed}: {} and {}", fine.t_end, adaptive.t_end);
    }
}

#[test]
fn a_fine_and_stiff_ring_takes_implicit_steps_by_itself_and_keeps_its_area() {
    let keys = format!("{ARRAY}gamma = 10.0\nn_vertices = 1024\nlimits.t_max = 20.0");
    assert_eq!(job(&keys, 0).1, Integrator::Adaptive);
    let trajectory = run(&keys, 0).unwrap();
    assert_eq!(trajectory.outcome, Outcome::TimeLimit);
    // Gamma/R over K_a is 0.25% of the area.
    assert!(trajectory.area_error_max.unwrap() < 4e-3 && trajectory.energy_rise_max < 1e-9);
}

#[test]
fn a_step_that_cannot_be_taken_ends_the_run_as_unstable_with_the_shape_kept() {
    let channel = "scene = \"channel\"\nw = 0.7\n";
    let keys = format!("{channel}gamma = 1.0\nv_t = 10.0\nintegrator = \"implicit\"\ndt = 1e5\nlimits.t_max = 1e6");
    let failure = run(&keys, 0).unwrap_err();
    assert_eq!(failure.class, FailureClass::Unstable);
    assert!(failure.reason.contains("dt"), "{failure}");
    assert_eq!(failure.outline.unwrap().x.len(), 256);
}

#[test]
fn a_soft_particle_clogs_at_the_same_place_in_steps_that_follow_its_error() {
    for (e_w, b0) in [(1.0, 0.0), (10.0, 0.0), (200.0, 0.0), (10.0, 0.1)] {
        for seed in 0..3 {
            let end = |stepping: &str| {
                let keys = format!("{ARRAY}model = \"SP\"\ne_w = {e_w:?}\nb0 = {b0:?}\nlimits.t_max = 1e4\n{stepping}");
                let trajectory = run(&keys, seed).unwrap();
                assert!(trajectory.energy_rise_max < 1e-9, "{stepping}: {}", trajectory.energy_rise_max);
                trajectory
            };
            let (fine, adaptive) = (end("dt = 2.5e-4"), end("integrator = \"adaptive\""));
            assert_eq!(fine.outcome, adaptive.outcome, "e_w = {e_w}, b0 = {b0}, seed {seed}");
            let (a, b) = (fine.r_end, adaptive.r_end);
            assert!((a - b).abs() < 1e-3, "e_w = {e_w}, b0 = {b0}, seed {seed}: {a} and {b}");
        }
    }
}

#[test]
fn how_often_a_soft_particle_is_looked_at_does_not_change_its_steps() {
    let end = |dt: &str| {
        let keys = format!("{ARRAY}model = \"SP\"\ne_w = 10.0\nintegrator = \"adaptive\"\nlimits.t_max = 200.0\n{dt}");
        run(&keys, 1).unwrap()
    };
    let (often, seldom) = (end("dt = 0.0625"), end("dt = 0.5"));
    assert_eq!((often.r_end, often.refused), (seldom.r_end, seldom.refused));
    assert_eq!(often.samples.h, seldom.samples.h);
}

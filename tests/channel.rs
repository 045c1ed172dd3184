//! A droplet through one constriction, and on a plate: the numbers of the source paper.

#[path = "common/single.rs"]
mod single;

use meniscus::results::trajectory::{Failure, Outcome, Samples, Trajectory};

/// Runs a campaign of one job, at the terminal speed of the paper's channel.
fn run(keys: &str) -> Result<Trajectory, Failure> {
    single::run(&format!("sample_every = 0.25\nv_t = 0.032\n{keys}"), 0)
}

/// Largest and smallest speed, and where, for centroids within a range.
fn extremes(samples: &Samples, from: f64, to: f64) -> [(f64, f64); 2] {
    let inside = || (0..samples.len()).filter(|&i| (from..to).contains(&samples.h[i]));
    let place = |i: usize| (samples.h[i], samples.v_g[i]);
    let fastest = inside().max_by(|&a, &b| samples.v_g[a].total_cmp(&samples.v_g[b]));
    let slowest = inside().min_by(|&a, &b| samples.v_g[a].total_cmp(&samples.v_g[b]));
    [fastest, slowest].map(|i| place(i.expect("the droplet passes there")))
}

#[test]
fn squeezing_through_deforms_the_droplet_as_the_paper_says_and_it_passes_with_the_papers_speeds() {
    let passage = run("scene = \"channel\"\nw = 0.7\ngamma = 1.08\nh_start = -2.0").unwrap();
    assert_eq!(passage.outcome, Outcome::Exited);
    let shape = passage.shape_max.unwrap();
    assert!((1.09..1.11).contains(&shape), "the paper has 1.093: {shape}");
    assert!(passage.area_error_max.unwrap() < 1e-3 && passage.energy_rise_max < 1e-9);
    let samples = &passage.samples;
    let [_, (h_slowest, slowest)] = extremes(samples, -1.0, 0.1);
    assert!((-0.5..0.0).contains(&h_slowest) && slowest < 0.5, "slowest at {h_slowest}: {slowest}");
    let [(h_fastest, fastest), _] = extremes(samples, 0.0, 1.0);
    assert!((0.1..0.4).contains(&h_fastest) && fastest > 1.0, "fastest at {h_fastest}: {fastest}");
    let [_, (h_second, second)] = extremes(samples, 0.3, 0.7);
    assert!(second < fastest && second > slowest, "a second, shallow minimum near {h_second}: {second}");
    // The vertices, dragged apart, take long to spread evenly again; until then the area moves a little faster than
    // they do.
    let last = *samples.v_g.last().unwrap();
    assert!((last - 1.0).abs() < 0.05, "at last it falls freely again: {last}");
    assert!((passage.ek_ratio_end - 1.0).abs() < 0.01);
}

#[test]
fn a_stiff_droplet_stays_stuck_and_comes_wholly_to_rest() {
    let stuck = run("scene = \"channel\"\nw = 0.7\ngamma = 2.4\nh_start = -1.0\nlimits = { t_max = 2000.0 }").unwrap();
    assert_eq!(stuck.outcome, Outcome::Clogged);
    assert!(stuck.ek_ratio_end < 1e-17 && stuck.clog.unwrap().contacts == 2);
}

#[test]
fn a_droplet_sinks_less_on_a_plate_the_stiffer_it_is() {
    let sunk = |gamma: f64| {
        let keys = format!("scene = \"plate\"\ngamma = {gamma}\nn_vertices = 128\nlimits = {{ t_max = 3000.0 }}");
        let settled = run(&keys).unwrap();
        assert_eq!(settled.outcome, Outcome::Settled);
        settled.delta_s.unwrap()
    };
    let depths = [0.3, 1.0, 3.0].map(sunk);
    assert!(depths[0] > depths[1] && depths[1] > depths[2], "{depths:?}");
}

#[test]
fn near_the_walls_drag_slows_the_droplet_down() {
    let time = |b0: f64| {
        let keys = format!("scene = \"channel\"\nw = 0.9\ngamma = 0.5\nh_start = -1.0\nn_vertices = 128\nb0 = {b0}");
        let passage = run(&keys).unwrap();
        assert_eq!(passage.outcome, Outcome::Exited);
        passage.t_end
    };
    let times = [0.0, 0.1, 0.3].map(time);
    assert!(times[0] < times[1] && times[1] < times[2], "{times:?}");
}

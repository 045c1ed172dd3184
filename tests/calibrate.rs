//! Calibration: frames made with known parameters and noise give these back; bad frames are refused in words that help.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{expect, meniscus};
use meniscus::parameters::{Channel, Deformable, Limits, Model, Point, Scene};
use meniscus::study::calibrate::frames::{Frame, Trial};
use meniscus::study::calibrate::profile::{Laboratory, Parameters, Profile};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A coarse ring; at sharp tips its corners would catch.
const N: usize = 40;
const DELTA: f64 = 0.03;
const TIP: f64 = 0.2;

fn template() -> Point {
    let ring = Deformable { n_vertices: N, e_w: 1e6, delta: DELTA, ..Deformable::of_tension(1.0) };
    let channel = Channel { w: 0.7, angle: 45.0, tip_radius: TIP, h_start: -1.0, h_end: 1.0 };
    let point = Point::new(Model::Deformable(ring), Scene::Channel(channel));
    let limits = Limits { t_max: 1.0, ek_threshold: 1e-10, ..point.limits };
    Point { v_t: 0.032, limits, sample_every: 1.0, ..point }
}

/// Where the camera sees the droplet.
fn places() -> impl Iterator<Item = f64> {
    (0..31).map(|k| -0.75 + 0.05 * f64::from(k))
}

/// The passage of a droplet of known parameters.
fn passage(truth: Parameters) -> Profile {
    // Slow frames, so that the time limit taken from them is a long one.
    let frame = |h| Frame { h, v_g: 0.1, shape: 1.0, v_g_error: 1.0, shape_error: 1.0 };
    let trial = Trial { name: None, frames: places().map(frame).collect() };
    let profile = Laboratory::new(template(), &[trial], &|_| ()).profile(truth).unwrap();
    Profile::clone(&profile)
}

/// A draw from the standard normal distribution, by Box and Muller.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let mut uniform = || ((random.next_u64() >> 12) as f64 + 0.5) / (1_u64 << 52) as f64;
    (-2.0 * libm::log(uniform())).sqrt() * libm::cos(std::f64::consts::TAU * uniform())
}

/// Runs a calibration in the coarse channel.
fn calibrate(dir: &Path, arguments: &[&str]) -> String {
    let (n, delta, tip) = (N.to_string(), DELTA.to_string(), TIP.to_string());
    let coarse = ["--n-vertices", &n, "--delta", &delta, "--tip-radius", &tip, "--w", "0.7", "--v-t", "0.032"];
    let output = expect(0, dir, &[&["calibrate"], arguments, &coarse].concat());
    String::from_utf8(output.stdout).unwrap()
}

/// The numbers in the row of a table that begins with `name`.
fn row(table: &str, name: &str) -> Vec<f64> {
    let line = table.lines().map(str::trim).find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{table}"));
    line[name.len()..].split_whitespace().map(|cell| cell.parse().unwrap()).collect()
}

#[test]
fn frames_with_five_percent_noise_give_back_the_parameters_they_were_made_with() {
    let truth = Parameters { gamma: 1.08, b0: 0.07 };
    let (profile, mut random) = (passage(truth), ChaCha8Rng::seed_from_u64(7));
    let mut text = "h,v_g,shape\n".to_owned();
    for h in places() {
        let noisy = profile.at(h).unwrap().map(|exact| exact * (1.0 + 0.05 * normal(&mut random)));
        writeln!(text, "{h},{},{}", noisy[0], noisy[1]).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("frames.csv"), text).unwrap();
    let table = calibrate(dir, &["frames.csv", "--gamma", "0.5..2", "--b0", "0..0.2"]);
    let [frames, gamma, b0, delta_v, delta_a] = row(&table, "frames ")[..] else { panic!("{table}") };
    assert_eq!(frames, 31.0);
    assert!((gamma / truth.gamma - 1.0).abs() < 0.1 && (b0 / truth.b0 - 1.0).abs() < 0.1, "{table}");
    // What is left is the noise: a twentieth of speeds up to some V_t, and of A.
    assert!((0.0..0.2).contains(&delta_v) && (0.02..0.1).contains(&delta_a), "{table}");
    let [error_gamma, error_b0] = row(&table, "std")[..] else { panic!("{table}") };
    assert!(error_gamma > 0.0 && error_gamma < 0.1 * truth.gamma && error_b0 > 0.0 && error_b0 < 0.1 * truth.b0);

    let fit = fs::read_to_string(dir.join("frames.fit.csv")).unwrap();
    assert_eq!(fit.lines().next(), Some("h,v_g,shape,v_g_exp,shape_exp"));
    let cells: Vec<Vec<f64>> =
        fit.lines().skip(1).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect();
    let squares: f64 = cells.iter().map(|row| (row[1] - row[3]) * (row[1] - row[3])).sum();
    assert!(((squares / 31.0).sqrt() / delta_v - 1.0).abs() < 1e-3, "the file holds what the table says");
    let svg = fs::read_to_string(dir.join("frames.fit.svg")).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let of_class = |class| document.descendants().filter(|node| node.attribute("class") == Some(class)).count();
    assert_eq!([of_class("frame"), of_class("curve")], [62, 2]);
    assert!(fs::read(dir.join("frames.fit.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn several_trials_give_a_mean_and_its_spread_and_each_file_its_fit() {
    // Wide enough that droplets hardly touch, so that simulations are short.
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    let shape = ["-0.6,0.83,1,a", "-0.3,0.71,1,a", "0.0,0.64,1,a", "0.3,0.7,1,a"];
    let text = format!("h,v_g,shape,trial\n{}\n{}\n", shape.join("\n"), shape.join("\n").replace(",a", ",b"));
    fs::write(dir.join("one.csv"), &text).unwrap();
    fs::write(dir.join("two.csv"), "h,v_g,shape\n-0.6,0.8,1\n-0.3,0.67,1\n0.0,0.6,1\n0.3,0.66,1\n").unwrap();
    let options = ["--w", "1.3", "--v-t", "0.1", "--n-vertices", "16", "--delta", "0.1", "--gamma", "1..2"];
    let output = expect(0, dir, &[&["calibrate", "one.csv", "two.csv"], &options[..]].concat());
    let table = String::from_utf8(output.stdout).unwrap();
    let b0 = ["one: a", "one: b", "two"].map(|name| row(&table, name)[2]);
    assert!(b0[0] == b0[1] && b0[2] > b0[0], "equal frames give equal fits, slower ones more drag:\n{table}");
    let mean = row(&table, "mean")[1];
    assert!((mean - (b0[0] + b0[1] + b0[2]) / 3.0).abs() < 0.01 * mean, "{table}");
    assert!(table.contains("[") && row(&table, "std")[1] > 0.0, "{table}");
    let one = fs::read_to_string(dir.join("one.fit.csv")).unwrap();
    assert!(one.starts_with("h,v_g,shape,v_g_exp,shape_exp,trial\n") && one.lines().count() == 9);
    assert!(dir.join("two.fit.svg").exists());
    // Threads change nothing.
    let single = [&["calibrate", "one.csv", "two.csv", "--threads", "1"], &options[..]].concat();
    assert_eq!(String::from_utf8(expect(0, dir, &single).stdout).unwrap(), table);
}

#[test]
fn bad_frames_are_refused_by_file_line_and_column_and_nothing_is_written() {
    let cases: [(&str, &[u8], &[&str]); 15] = [
        ("empty.csv", b"", &["empty.csv:1:1", "the file is empty", "h,v_g,shape"]),
        ("header.csv", b"h,v_g,shape\n", &["header.csv:1:1", "no frames follow", "give 3 frames or more"]),
        ("one.csv", b"h,v_g,shape\n0,1,1\n", &["one.csv:2:1", "one frame, too few", "give 3 frames or more"]),
        ("missing.csv", b"h,shape\n0,1\n", &["missing.csv:1:1", "no column is named `v_g`", "h,v_g,shape"]),
        (
            "unknown.csv",
            b"h,vg,shape\n0,1,1\n",
            &["unknown.csv:1:3", "`vg` is not a column", "did you mean `v_g`", "trial"],
        ),
        (
            "semicolons.csv",
            b"h;v_g;shape\n0;1;1\n",
            &["semicolons.csv:1:1", "`h;v_g;shape` is not a column", "h,v_g,shape"],
        ),
        ("twice.csv", b"h,v_g,h,shape\n0,1,1,1\n", &["twice.csv:1:7", "appears twice", "keep one"]),
        (
            "nan.csv",
            b"h,v_g,shape\n0,1,1\n0.1,NaN,1\n",
            &["nan.csv:3:5", "v_g: `NaN` is not finite", "take the line out"],
        ),
        (
            "inf.csv",
            b"h,v_g,shape\n\n0,1, -inf\n",
            &["inf.csv:3:5", "shape: `-inf` is not finite", "take the line out"],
        ),
        ("gap.csv", b"h,v_g,shape\n0,,1\n", &["gap.csv:2:3", "v_g: the cell is empty", "write a number"]),
        ("text.csv", b"h,v_g,shape\nzero,1,1\n", &["text.csv:2:1", "h: `zero` is not a number", "write a number"]),
        (
            "ragged.csv",
            b"h,v_g,shape\n0,1\n",
            &["ragged.csv:2:1", "2 cells, where the header has 3", "parted by commas"],
        ),
        ("error.csv", b"h,v_g,shape,v_g_error\n0,1,1,0\n", &["error.csv:2:7", "an error of 0", "above 0"]),
        ("few.csv", b"h,v_g,shape,trial\n0,1,1,a\n1,1,1,a\n", &["few.csv:3:1", "trial `a` has 2 frames", "3 frames"]),
        ("latin.csv", b"h,v_g,shape\n0,1,\xe9\n", &["latin.csv", "line 2", "UTF-8"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    for (name, bytes, words) in cases {
        fs::write(dir.join(name), bytes).unwrap();
        let output = expect(1, dir, &["calibrate", name, "--w", "0.7", "--v-t", "0.032"]);
        let said = String::from_utf8(output.stderr).unwrap();
        for word in words {
            assert!(said.contains(word), "{name}: `{word}` is not in\n{said}");
        }
        assert!(output.stdout.is_empty());
    }
    assert_eq!(fs::read_dir(dir).unwrap().count(), cases.len(), "nothing was written");
}

#[test]
fn options_out_of_range_are_refused_with_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path();
    fs::write(dir.join("good.csv"), "h,v_g,shape\n-0.5,1,1\n0,1,1\n0.5,1,1\n").unwrap();
    let cases: [(i32, &[&str], &str); 9] = [
        (
            1,
            &["good.csv", "--w", "0", "--v-t", "0.03"],
            "--w is 0, but the width of the orifice must be a number above 0",
        ),
        (1, &["good.csv", "--w", "-1", "--v-t", "0.03"], "--w is -1"),
        (1, &["good.csv", "--w", "0.7", "--v-t", "-0.03"], "--v-t is -0.03, but the terminal speed"),
        (1, &["good.csv", "--w", "NaN", "--v-t", "0.03"], "--w is NaN"),
        (1, &["good.csv", "--w", "1", "--v-t", "1", "--gamma", "2..1"], "write the smaller end first"),
        (1, &["none.csv", "--w", "0.7", "--v-t", "0.03"], "cannot read the frames none.csv"),
        (1, &["good.csv", "good.csv", "--w", "0.7", "--v-t", "0.03"], "name each once"),
        (2, &["good.csv", "--w", "0.7"], "--v-t"),
        (2, &["good.csv", "--w", "0.7", "--v-t", "0.03", "--b0", "4"], "write two numbers"),
    ];
    for (code, arguments, word) in cases {
        let output = meniscus(dir, &[&["calibrate"], arguments].concat()).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains(word), "`{word}` is not in\n{said}");
    }
    assert_eq!(fs::read_dir(dir).unwrap().count(), 1, "nothing was written");
}

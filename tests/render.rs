//! Pictures of droplets: well-formed, true to the store, the same every time, and errors that say what to do.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use common::{ask, expect};
use meniscus::parameters::{JobId, MASS, Scene};
use meniscus::physics::walls::arrays::obstacles::ObstacleArray;
use meniscus::results::outline::LoadRecord;
use meniscus::results::trajectory::Mechanism;
use meniscus::store;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

const CAMPAIGN: &str = r#"
name = "pictures"
scene = "obstacles"
w_ob = 0.2
sigma_ob = 0.3
density = 1.5
box_size = 20.0
runs_per_point = 3
sample_every = 2.0

[limits]
t_max = 3000.0
distance = 4.0

[[block]]
name = "deformable"
model = "DP"
dynamics = "vertex"
n_vertices = 44
grid = { gamma = [1.0], shapes_every = ["none", 25.0] }

[[block]]
name = "soft"
model = "SP"
e_w = 30.0
"#;

/// A folder with a store of a few runs, made once.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let make = || {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("pictures.toml"), CAMPAIGN).unwrap();
        expect(0, folder.path(), &["run", "pictures.toml"]);
        folder
    };
    FOLDER.get_or_init(make).path()
}

/// The ids that a condition on `runs` selects.
fn jobs(condition: &str) -> Vec<String> {
    let sql = format!("select job_id from runs where {condition} order by 1");
    ask(folder(), "pictures.meniscus", &sql).lines().skip(1).map(str::to_owned).collect()
}

fn render(arguments: &[&str]) -> Vec<u8> {
    let arguments = [&["render", "pictures.meniscus"], arguments].concat();
    expect(0, folder(), &arguments).stdout
}

fn refusal(arguments: &[&str]) -> String {
    let arguments = [&["render", "pictures.meniscus"], arguments].concat();
    String::from_utf8(expect(1, folder(), &arguments).stderr).unwrap()
}

fn kept(id: &str) -> Vec<meniscus::results::outline::Outline> {
    store::outlines(&folder().join("pictures.meniscus"), id.parse::<JobId>().unwrap()).unwrap()
}

#[test]
fn a_clogged_droplet_is_drawn_among_all_the_obstacles_in_view() {
    let id = &jobs("model = 'DP' and outcome = 'clogged'")[0];
    let svg = String::from_utf8(render(&[id, "-o", "-"])).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let find = |class: &str| document.descendants().find(|node| node.attribute("class") == Some(class)).unwrap();
    assert_eq!(find("droplet").attribute("points").unwrap().split(' ').count(), 44);
    let shapes = kept(id);
    let shape = shapes.last().unwrap();
    let strong = |load: &&LoadRecord| libm::hypot(load.fx, load.fy) > 0.01 * MASS;
    let arrows = find("forces").children().filter(|node| node.has_tag_name("polygon")).count();
    assert_eq!(arrows, 1 + shape.loads.iter().filter(strong).count(), "the weight, and every load");
    // The obstacles whose discs meet the window, counted from the array itself.
    let scene = document.descendants().filter(|node| node.has_tag_name("svg")).nth(1).unwrap();
    let size = ["width", "height"].map(|side| scene.attribute(side).unwrap().parse::<f64>().unwrap());
    let job = store::job(&folder().join("pictures.meniscus"), id.parse().unwrap()).unwrap().unwrap();
    let Scene::Obstacles(field) = &job.point.scene else { panic!("the campaign has obstacles") };
    let array = ObstacleArray::generate(field, job.seed).unwrap();
    let number = |node: &roxmltree::Node<'_, '_>, name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
    let drawn: Vec<_> = find("obstacles").children().filter(|node| node.has_tag_name("circle")).collect();
    let scale = number(&drawn[0], "r") / array.radius;
    let vertex: Vec<f64> =
        find("droplet").attribute("points").unwrap().split([' ', ',']).take(2).map(|c| c.parse().unwrap()).collect();
    let (left, top) = (shape.y[0] - vertex[0] / scale, shape.x[0] - vertex[1] / scale);
    let (bottom, right, r) = (top + size[1] / scale, left + size[0] / scale, array.radius);
    let mut expected = Vec::new();
    array.for_each_in([0.0; 2], [top - r, bottom + r, left - r, right + r], |disc| expected.push(disc));
    assert!(expected.len() >= 4 && drawn.len() == expected.len(), "{} of {}", drawn.len(), expected.len());
    for disc in expected {
        let at = [(disc.y - left) * scale, (disc.x - top) * scale];
        let near = |node: &&roxmltree::Node<'_, '_>| {
            (number(node, "cx") - at[0]).abs() < 0.1 && (number(node, "cy") - at[1]).abs() < 0.1
        };
        assert_eq!(drawn.iter().filter(near).count(), 1);
    }
}

#[test]
fn the_shape_kept_at_the_end_stands_where_the_last_sample_does() {
    for id in jobs("state = 'done'") {
        let last = ask(
            folder(),
            "pictures.meniscus",
            &format!("select t, h, y from samples where job_id = '{id}' order by t desc limit 1"),
        );
        let last: Vec<f64> = last.lines().nth(1).unwrap().split(',').map(|number| number.parse().unwrap()).collect();
        let shapes = kept(&id);
        let shape = shapes.last().unwrap();
        let [x, y] = shape.centroid();
        assert_eq!(shape.t, last[0]);
        assert!((x - last[1]).abs() < 1e-12 && (y - last[2]).abs() < 1e-12, "{id}");
    }
}

#[test]
fn a_clog_is_told_by_its_mechanism_and_holds_the_weight() {
    let ids = jobs("outcome = 'clogged'");
    assert!(ids.len() >= 2);
    for id in ids {
        let shapes = kept(&id);
        let shape = shapes.last().unwrap();
        let support: f64 = shape.loads.iter().map(|load| load.fx).sum();
        assert!((support + MASS).abs() < 1e-6, "{id}: {support}");
        let said =
            ask(folder(), "pictures.meniscus", &format!("select mechanism from clog_events where job_id = '{id}'"));
        assert_eq!(said.lines().nth(1), meniscus::physics::simulate::mechanism::of(shape).map(Mechanism::name));
    }
}

#[test]
fn a_png_decodes_to_twice_the_size_of_its_svg() {
    let id = &jobs("model = 'SP'")[0];
    let svg = String::from_utf8(render(&[id, "-o", "-"])).unwrap();
    let root = roxmltree::Document::parse(&svg).unwrap();
    let side = |name: &str| 2 * root.root_element().attribute(name).unwrap().parse::<u32>().unwrap();
    render(&[&id[..12], "-o", "droplet.png"]);
    let picture = resvg::tiny_skia::Pixmap::load_png(folder().join("droplet.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (side("width"), side("height")));
    let blues = picture.pixels().iter().filter(|pixel| pixel.blue() > pixel.red().saturating_add(40)).count();
    // A disc of diameter sigma, 200 pixels of the SVG: 4 * 31416, less what stands before it.
    assert!((90_000..130_000).contains(&blues), "{blues}");
}

#[test]
fn a_gif_has_a_frame_for_each_kept_shape() {
    let several = "model = 'DP' and job_id in (select job_id from shapes group by job_id having count(*) > 1)";
    let id = &jobs(several)[0];
    render(&[id, "-o", "droplet.gif"]);
    let mut decoder = gif::Decoder::new(fs::File::open(folder().join("droplet.gif")).unwrap()).unwrap();
    let mut frames = 0;
    while decoder.read_next_frame().unwrap().is_some() {
        frames += 1;
    }
    let shapes = kept(id);
    assert_eq!(frames, shapes.len());
    assert!(frames > 2);
    for (k, shape) in shapes.iter().take(frames - 1).enumerate() {
        assert_eq!(shape.t, 25.0 * k as f64);
    }
}

#[test]
fn pictures_are_the_same_bytes_every_time() {
    let several = "model = 'DP' and job_id in (select job_id from shapes group by job_id having count(*) > 1)";
    let id = &jobs(several)[0];
    for format in ["svg", "png", "gif"] {
        let make = |name: &str| {
            let file = format!("{name}.{format}");
            render(&[id, "--path", "-o", &file]);
            fs::read(folder().join(file)).unwrap()
        };
        assert!(make("once") == make("twice"), "{format}");
    }
}

#[test]
fn keeping_shapes_changes_no_result() {
    let sql = "select seed, outcome, r_end, t_end, ek_ratio_end, steps from runs where model = 'DP' and job_id {} in \
               (select job_id from shapes group by job_id having count(*) > 1) order by 1";
    let few = ask(folder(), "pictures.meniscus", &sql.replace("{}", "not"));
    assert_eq!(few.lines().count(), 4);
    assert_eq!(few, ask(folder(), "pictures.meniscus", &sql.replace("{}", "")));
}

#[test]
fn mistakes_are_answered_with_the_next_step() {
    let id = &jobs("model = 'SP'")[0];
    assert!(refusal(&["0123456789abcdef0123"]).contains("meniscus render pictures.meniscus"));
    assert!(refusal(&["12"]).contains("4 digits"));
    assert!(refusal(&[id, "-o", "droplet.bmp"]).contains("svg, png or gif"));
    assert!(refusal(&[id, "-o", "droplet"]).contains("--format"));
    assert!(refusal(&[id, "-o", "droplet.gif"]).contains("shapes_every"));
    let list = String::from_utf8(render(&[])).unwrap();
    let clogged = &jobs("outcome = 'clogged'")[0];
    assert!(list.lines().nth(1).unwrap().contains("clogged") && list.contains(clogged.as_str()), "{list}");
}

#[test]
fn a_job_that_waits_has_no_picture_yet() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("pictures.toml"), CAMPAIGN).unwrap();
    expect(0, folder.path(), &["run", "pictures.toml", "--deadline", "0s"]);
    let id = ask(folder.path(), "pictures.meniscus", "select job_id from runs where state = 'pending' limit 1");
    let id = id.lines().nth(1).unwrap();
    let output = expect(1, folder.path(), &["render", "pictures.meniscus", id]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(text.contains("pending") && text.contains("meniscus run"), "{text}");
}

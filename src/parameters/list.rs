//! The list of parameters. Campaign files, the columns of the store, captions, tables and messages all read it.
//!
//! A new parameter needs a field of [`Point`], or of one of its parts, a row here, and a column of `points` and of the
//! views (`migrations/`). The order of the rows is that of tables and messages. Model and scene come first, because
//! they settle which parts a point has.

use crate::parameters::interval::{above, at_least, between};
use crate::parameters::parameter::{Applies, Field, Held, Parameter, Value, parameter};
use crate::parameters::{
    Channel, ContactKind, Deformable, Density, Dynamics, Engulfed, GravityForm, IntegratorChoice, Interval, LoneDisc,
    MOST_VERTICES, Model, ObstacleField, PAPER_ALPHA, Point, STEP_ERROR, Scene, SelfContact, Soft, WallStiffness,
};

const DP: Applies = Applies::Model("DP");
const SP: Applies = Applies::Model("SP");
const OBSTACLES: Applies = Applies::Scene("obstacles");
const CHANNEL: Applies = Applies::Scene("channel");
const DISC: Applies = Applies::Scene("disc");
const POSITIVE: Interval = above(0.0);

/// The droplet as a liquid, which is the default.
const DARCY: &str = "darcy";

/// The [`Field`] of a point, or of a part that only some points have.
macro_rules! field {
    (point.$($name:ident).+) => {
        Field { get: |point| Some(point.$($name).+.value()), set: |point, value| point.$($name).+.put(value) }
    };
    (ring.$name:ident) => { field!(model, Model::Deformable, $name) };
    (soft.$name:ident) => { field!(model, Model::Soft, $name) };
    (array.$name:ident) => { field!(scene, Scene::Obstacles, $name) };
    (channel.$name:ident) => { field!(scene, Scene::Channel, $name) };
    (disc.$name:ident) => { field!(scene, Scene::Disc, $name) };
    ($whole:ident, $part:path, $name:ident) => {
        Field {
            get: |point| match &point.$whole {
                $part(part) => Some(part.$name.value()),
                _ => None,
            },
            set: |point, value| {
                if let $part(part) = &mut point.$whole {
                    part.$name.put(value);
                }
            },
        }
    };
}

/// All parameters of a grid point.
///
/// ```
/// use meniscus::parameters::{Deformable, Model, PARAMETERS, Point, Scene, Value};
///
/// let mut point = Point::new(Model::Deformable(Deformable::of_tension(1.0)), Scene::Plate);
/// let kappa = PARAMETERS.iter().find(|parameter| parameter.name == "kappa").unwrap();
/// kappa.set(&mut point, Value::Number(0.01));
/// assert_eq!(kappa.get(&point), Some(Value::Number(0.01)));
/// assert_eq!(kappa.domain.allowed(), "a number from 0 to 10, or \"auto\"");
/// ```
#[rustfmt::skip]
pub static PARAMETERS: &[Parameter] = &[
    parameter("model", "deformable (DP) or soft (SP) particle", MODEL)
        .choice(&["DP", "SP"]).required(),
    parameter("scene", "where the droplet moves", SCENE)
        .choice(&["obstacles", "channel", "plate", "disc"]).required(),

    parameter("dynamics", "the laws by which it moves", field!(ring.dynamics))
        .of(DP).choice(Dynamics::NAMES).default_to(DARCY),
    parameter("gamma", "line tension", field!(ring.gamma))
        .of(DP).number(between(1e-3, 100.0)).unit("g rho sigma^2").caption(),
    parameter("bond", "Bond number, rho g sigma^2 over the tension, in place of gamma", BOND)
        .of(DP).number(between(1e-2, 1e3)).instead_of("gamma"),
    parameter("kappa", "perimeter stiffness over line tension", field!(ring.kappa))
        .of(DP).number_or("auto", between(0.0, 10.0)).caption()
        .auto("0; under dynamics = \"vertex\" 1e-3, or 1/(N_v l0) among obstacles where the tension cannot keep the vertices apart"),
    parameter("k_a", "area stiffness", field!(ring.k_a))
        .of(DP).number(POSITIVE.up_to(1e8)).default(1e4).unit("g rho/sigma"),
    parameter("n_vertices", "vertices of the ring", field!(ring.n_vertices))
        .of(DP).whole_or("auto", between(8.0, MOST_VERTICES as f64)).caption()
        .auto("64, or up to 192 for soft droplets among obstacles; under dynamics = \"vertex\" 256"),
    parameter("e_w", "wall stiffness of the whole ring", field!(ring.e_w))
        .of(DP).number_or("auto", POSITIVE.up_to(1e8)).unit("g rho sigma")
        .auto("5e7 in channels, 1e7 elsewhere, times gamma above 1, but at most 1e8; under dynamics = \"vertex\" 1e6 and 1e4"),
    parameter("e_w", "wall stiffness of the point", field!(soft.e_w))
        .of(SP).number(POSITIVE.up_to(1e4)).unit("g rho sigma^3").caption(),
    parameter("delta", "vertex diameter", field!(ring.delta))
        .of(DP).number(POSITIVE.below(0.5)).default(std::f64::consts::PI / 256.0).unit("sigma"),
    parameter("eps", "smoothing of the edge length", field!(ring.eps))
        .of(DP).number(POSITIVE.up_to(1.0)).default(0.1).unit("l0"),
    parameter("wall", "what e_w means: shared by all edges, or for each", field!(ring.wall))
        .of(DP).choice(WallStiffness::NAMES),
    parameter("contact", "what of the ring touches walls", field!(ring.contact))
        .of(DP).choice(ContactKind::NAMES),
    parameter("gravity", "how gravity acts on the ring", field!(ring.gravity))
        .of(DP).choice(GravityForm::NAMES),
    parameter("self_contact", "whether the ring repels itself where it folds back", field!(ring.self_contact))
        .of(DP).choice(SelfContact::NAMES),
    parameter("engulfed", "what happens when an obstacle lies inside the ring", field!(ring.engulfed))
        .of(DP).choice(Engulfed::NAMES),

    parameter("step_error", "error allowed in a step that follows its error", STEP_ERROR_FIELD)
        .of(DP).number(between(1e-7, 1e-2)).default(STEP_ERROR).unit("sigma"),

    parameter("w_ob", "smallest gap between two obstacles", field!(array.w_ob))
        .of(OBSTACLES).number(at_least(0.0)).unit("sigma").caption(),
    parameter("sigma_ob", "diameter of an obstacle", field!(array.sigma_ob))
        .of(OBSTACLES).number(POSITIVE).unit("sigma").caption(),
    parameter("density", "obstacles per sigma^2", field!(array.density))
        .of(OBSTACLES).number_or("saturated", POSITIVE).caption(),
    parameter("box_size", "side of the periodic box", field!(array.box_size))
        .of(OBSTACLES).number(between(20.0, 5000.0)).default(500.0).unit("sigma"),

    parameter("w", "width of the orifice", field!(channel.w))
        .of(CHANNEL).number(POSITIVE.up_to(100.0)).unit("sigma").caption(),
    parameter("angle", "rise of the wedges from the axis", field!(channel.angle))
        .of(CHANNEL).number(between(5.0, 85.0)).default(45.0).unit("degrees").caption(),
    parameter("tip_radius", "radius of the rounded tips", field!(channel.tip_radius))
        .of(CHANNEL).number(between(0.0, 10.0)).default(0.0).unit("sigma"),
    parameter("h_start", "where the centroid starts", field!(channel.h_start))
        .of(CHANNEL).number(between(-1000.0, -0.1)).default(-10.0).unit("sigma"),
    parameter("h_end", "where the run ends, past the orifice", field!(channel.h_end))
        .of(CHANNEL).number(between(0.1, 1000.0)).default(3.0).unit("sigma"),

    parameter("sigma_ob", "diameter of the disc", field!(disc.sigma_ob))
        .of(DISC).number(POSITIVE).unit("sigma").caption(),
    parameter("offset", "how far beside the axis of the disc the centroid starts", field!(disc.offset))
        .of(DISC).number(between(-100.0, 100.0)).default(0.0).unit("sigma").caption(),
    parameter("h_start", "where the centroid starts", field!(disc.h_start))
        .of(DISC).number(between(-1000.0, -0.1)).default(-1.0).unit("sigma"),
    parameter("h_end", "where the run ends, past the disc", field!(disc.h_end))
        .of(DISC).number(between(0.1, 1000.0)).default(3.0).unit("sigma"),

    parameter("v_t", "terminal speed of the free droplet", field!(point.v_t))
        .number(POSITIVE.up_to(10.0)).default(0.03).unit("sqrt(g sigma)").caption(),
    parameter("b0", "near-wall drag over the drag far from walls, b0/b_inf", field!(point.b0))
        .number(between(0.0, 10.0)).default(0.0),
    parameter("alpha", "exponent of the near-wall drag", ALPHA)
        .number(between(0.1, 10.0)).default(PAPER_ALPHA),
    parameter("integrator", "how time advances", field!(point.stepping.integrator))
        .choice(IntegratorChoice::NAMES)
        .auto("adaptive; for a soft particle verlet (adaptive takes a fifth of its time); under dynamics = \"vertex\" \
               adaptive where dt is left out and it costs less than verlet, else verlet"),
    parameter("dt", "time step", field!(point.stepping.dt))
        .number_or("auto", POSITIVE).unit("t0")
        .auto("adaptive: 1/8 or less, the grid of times at which the droplet is looked at; verlet: up to 0.001 and 0.8 of the \
               stability limit; implicit: 1/16 or less"),
    parameter("t_max", "longest simulated time", field!(point.limits.t_max))
        .limit().number(POSITIVE).default(2e5).unit("t0"),
    parameter("distance", "way after which a run ends", field!(point.limits.distance))
        .limit().number_or("none", POSITIVE).default_to("none").unit("sigma"),
    parameter("ek_threshold", "E_k/E_t, kinetic energy over that at V_t, below which a droplet that has moved is clogged", field!(point.limits.ek_threshold))
        .limit().number(POSITIVE.below(1.0)).default(1e-17),
    parameter("sample_every", "time between two samples", field!(point.sample_every))
        .number(POSITIVE).default(10.0).unit("t0"),
    parameter("shapes_every", "time between two kept shapes", field!(point.shapes_every))
        .number_or("none", at_least(1.0)).default_to("none").unit("t0"),
];

/// The rows of that name: none if it is unknown, several if the parameter depends on model or scene.
pub fn rows(name: &str) -> impl Iterator<Item = &'static Parameter> {
    PARAMETERS.iter().filter(move |parameter| parameter.name == name)
}

/// The value of the parameter of that name at a point; `None` if the point does not have it.
pub fn value(point: &Point, name: &str) -> Option<Value> {
    rows(name).find_map(|parameter| parameter.get(point))
}

/// All parameters, each once: they are columns of `runs`.
pub fn columns() -> impl Iterator<Item = &'static Parameter> {
    let first = |parameter: &&Parameter| rows(parameter.name).next().is_some_and(|row| std::ptr::eq(row, *parameter));
    PARAMETERS.iter().filter(first)
}

/// Setting the model sets its name only: its numbers are NaN until their own rows set them.
const MODEL: Field = Field {
    get: |point| Some(Value::Word(point.model.name())),
    set: |point, value| {
        point.model = match value.word() {
            Some("SP") => Model::Soft(Soft { e_w: f64::NAN }),
            _ => Model::Deformable(Deformable::of_tension(f64::NAN)),
        }
    },
};

/// Setting the scene sets its name only, as with the model.
const SCENE: Field = Field {
    get: |point| Some(Value::Word(point.scene.name())),
    set: |point, value| {
        const TO_BE_SET: f64 = f64::NAN;
        let [w, w_ob, sigma_ob, box_size, h_start, h_end] = [TO_BE_SET; 6];
        point.scene = match value.word() {
            Some("channel") => Scene::Channel(Channel { w, angle: TO_BE_SET, tip_radius: TO_BE_SET, h_start, h_end }),
            Some("plate") => Scene::Plate,
            Some("disc") => Scene::Disc(LoneDisc { sigma_ob, offset: TO_BE_SET, h_start, h_end }),
            _ => Scene::Obstacles(ObstacleField { w_ob, sigma_ob, density: Density::Saturated, box_size }),
        }
    },
};

/// A point keeps only the line tension, `Gamma = 1/Bo`.
const BOND: Field = Field {
    get: |_| None,
    set: |point, value| {
        if let (Model::Deformable(ring), Some(bond)) = (&mut point.model, value.number()) {
            ring.gamma = 1.0 / bond;
        }
    },
};

/// `None` in a point stands for the exponent of the paper.
const ALPHA: Field = Field {
    get: |point| Some(Value::Number(point.alpha.unwrap_or(PAPER_ALPHA))),
    set: |point, value| point.alpha.put(value),
};

/// `None` in a point stands for the default.
const STEP_ERROR_FIELD: Field = Field {
    get: |point| match &point.model {
        Model::Deformable(ring) => Some(Value::Number(ring.step_error.unwrap_or(STEP_ERROR))),
        Model::Soft(_) => None,
    },
    set: |point, value| {
        if let Model::Deformable(ring) = &mut point.model {
            ring.step_error = value.number().filter(|error| *error != STEP_ERROR);
        }
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> impl Iterator<Item = Point> {
        let made = |(model, scene)| {
            let mut point = Point::new(Model::Soft(Soft { e_w: 1.0 }), Scene::Plate);
            (MODEL.set)(&mut point, Value::Word(model));
            (SCENE.set)(&mut point, Value::Word(scene));
            point
        };
        let scenes = ["obstacles", "channel", "plate", "disc"];
        ["DP", "SP"].into_iter().flat_map(move |model| scenes.map(|scene| (model, scene))).map(made)
    }

    fn samples(parameter: &Parameter) -> Vec<Value> {
        let words = parameter.domain.words().iter().map(|word| Value::Word(word));
        let words = words.filter(|word| !parameter.is_open(*word));
        let numbers =
            [0.25, 1.5, -0.5, 30.0, 256.0, 0.001].into_iter().filter_map(|number| parameter.domain.number(number));
        words.chain(numbers.map(Value::Number)).collect()
    }

    #[test]
    fn a_parameter_reads_back_what_was_written_wherever_it_means_something_and_nowhere_else() {
        for point in points() {
            let (model, scene) = (point.model.name(), point.scene.name());
            for parameter in PARAMETERS.iter().filter(|parameter| !["model", "scene"].contains(&parameter.name)) {
                let samples = samples(parameter);
                assert!(!samples.is_empty(), "{}", parameter.name);
                for value in samples {
                    let mut point = point.clone();
                    parameter.set(&mut point, value);
                    let kept = parameter.applies.to(model, scene) && parameter.instead_of.is_none();
                    let expected = kept.then_some(value);
                    assert_eq!(parameter.get(&point), expected, "{} for {model} in {scene}", parameter.name);
                }
            }
        }
    }

    #[test]
    fn a_name_has_one_row_for_each_model_and_scene() {
        for point in points() {
            let mut names: Vec<_> =
                PARAMETERS.iter().filter(|row| row.applies.to(point.model.name(), point.scene.name())).collect();
            names.sort_by_key(|parameter| parameter.name);
            assert!(names.windows(2).all(|pair| pair[0].name != pair[1].name));
        }
    }

    #[test]
    fn the_defaults_are_those_of_new_points() {
        let point = Point::new(Model::Deformable(Deformable::of_tension(1.0)), Scene::Plate);
        // But for the dynamics: points of old stores do not say it, and are rings of the paper.
        for parameter in PARAMETERS.iter().filter(|parameter| parameter.name != "dynamics") {
            let default = parameter.default.filter(|default| !parameter.is_open(*default));
            if let (Some(value), Some(default)) = (parameter.get(&point), default) {
                assert_eq!(value, default, "{}", parameter.name);
            }
        }
    }
}

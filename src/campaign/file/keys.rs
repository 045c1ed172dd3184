//! Every key of a campaign file: one table that drives reading, range checks, suggestions and documentation.

use crate::campaign::file::interval::{Interval, above, at_least, between};
use crate::parameters::{ContactKind, Engulfed, GravityForm, IntegratorChoice, SelfContact, WallStiffness};
use Fallback::{Is, Required};
use Kind::{Choice, Number, NumberOr, Text, Whole};
use Meaning::{Always, Model, Scene};
use Place::{File, Limit, Parameter, Section, Until};
use Value::Word;

/// One row of the table.
#[derive(Clone, Debug)]
pub struct Key {
    /// Which key it is.
    pub id: Id,
    /// How it is written; the same name as the column of the store.
    pub name: &'static str,
    /// Where it may stand.
    pub place: Place,
    /// What it holds.
    pub kind: Kind,
    /// When it has a meaning.
    pub meaning: Meaning,
    /// What stands for it when it is left out.
    pub default: Fallback,
    /// What it is, in a line.
    pub doc: &'static str,
}

/// The keys, by identity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the table below documents each")]
pub enum Id {
    Name,
    About,
    Model,
    Scene,
    RunsPerPoint,
    FirstSeed,
    Integrator,
    VT,
    B0,
    Alpha,
    Gamma,
    Kappa,
    KA,
    NVertices,
    EW,
    Delta,
    Eps,
    Wall,
    Contact,
    Gravity,
    SelfContact,
    Engulfed,
    W,
    Angle,
    TipRadius,
    HStart,
    HEnd,
    Offset,
    WOb,
    SigmaOb,
    Density,
    BoxSize,
    Dt,
    Tolerance,
    SampleEvery,
    ShapesEvery,
    TMax,
    Distance,
    RelativeError,
    Estimate,
    MaxRuns,
    EkThreshold,
}

impl Id {
    /// How many keys there are.
    pub const COUNT: usize = Self::EkThreshold as usize + 1;
}

/// Where a key may stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// At the top of the file alone.
    File,
    /// At the top of the file or of a block.
    Section,
    /// At the top of the file or of a block, or as an axis of the grid.
    Parameter,
    /// Under `limits`, or as an axis of the grid.
    Limit,
    /// Under `until`.
    Until,
}

/// What a key holds.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Any text.
    Text,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A number in the interval.
    Number(Interval),
    /// A number in the interval, or this word.
    NumberOr(Interval, &'static str),
    /// A whole number in the interval.
    Whole(Interval),
}

/// When a key has a meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// Always.
    Always,
    /// For this model.
    Model(&'static str),
    /// In this scene.
    Scene(&'static str),
}

/// What stands for a key that is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fallback {
    /// Nothing: it must be given.
    Required,
    /// This value.
    Is(Value),
}

/// A value that a key can hold, texts apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A finite number.
    Number(f64),
    /// A word of the key's kind.
    Word(&'static str),
}

const fn is(number: f64) -> Fallback {
    Is(Value::Number(number))
}

const fn key(
    id: Id,
    name: &'static str,
    place: Place,
    kind: Kind,
    meaning: Meaning,
    default: Fallback,
    doc: &'static str,
) -> Key {
    Key { id, name, place, kind, meaning, default, doc }
}

const DP: Meaning = Model("DP");
const SP: Meaning = Model("SP");
const OBSTACLES: Meaning = Scene("obstacles");
const CHANNEL: Meaning = Scene("channel");
const DISC: Meaning = Scene("disc");
const POSITIVE: Interval = above(0.0);

/// The table. `e_w` has a row for each model, `sigma_ob`, `h_start` and `h_end` one for each scene that knows them.
#[rustfmt::skip]
pub const KEYS: &[Key] = &[
    key(Id::Name, "name", Section, Text, Always, Required, "name of the campaign or of the block"),
    key(Id::About, "about", File, Text, Always, Is(Word("")), "what the campaign shows, in prose"),
    key(Id::Model, "model", Section, Choice(&["DP", "SP"]), Always, Required, "deformable (DP) or soft (SP) particle"),
    key(Id::Scene, "scene", Section, Choice(&["obstacles", "channel", "plate", "disc"]), Always, Required, "where the droplet moves"),
    key(Id::RunsPerPoint, "runs_per_point", Section, Whole(between(1.0, 1e5)), Always, Required, "seeds per grid point"),
    key(Id::FirstSeed, "first_seed", Section, Whole(between(0.0, 1e15)), Always, is(0.0), "the first seed"),
    key(Id::Integrator, "integrator", Section, Choice(IntegratorChoice::NAMES), Always, Is(Word(IntegratorChoice::NAMES[0])), "how time advances"),
    key(Id::VT, "v_t", Parameter, Number(POSITIVE.up_to(10.0)), Always, is(0.03), "terminal speed of the free droplet"),
    key(Id::B0, "b0", Parameter, Number(between(0.0, 10.0)), Always, is(0.0), "near-wall drag over b_inf"),
    key(Id::Alpha, "alpha", Parameter, Number(between(0.1, 10.0)), Always, is(4.0 / 3.0), "exponent of the near-wall drag"),
    key(Id::Gamma, "gamma", Parameter, Number(between(1e-3, 100.0)), DP, Required, "line tension"),
    key(Id::Kappa, "kappa", Parameter, NumberOr(between(0.0, 10.0), "auto"), DP, Is(Word("auto")), "perimeter stiffness over line tension, by itself 1e-3, and 1/(N_v l0) among obstacles where the tension cannot hold up the vertices"),
    key(Id::KA, "k_a", Parameter, Number(POSITIVE.up_to(1e8)), DP, is(1e4), "area stiffness"),
    key(Id::NVertices, "n_vertices", Parameter, Whole(between(8.0, 4096.0)), DP, is(256.0), "vertices of the ring"),
    key(Id::EW, "e_w", Parameter, NumberOr(POSITIVE.up_to(1e8), "auto"), DP, Is(Word("auto")), "wall stiffness of the whole ring, by itself 1e6 in channels and 1e4 elsewhere"),
    key(Id::EW, "e_w", Parameter, Number(POSITIVE.up_to(1e4)), SP, Required, "wall stiffness of the point"),
    key(Id::Delta, "delta", Parameter, Number(POSITIVE.below(0.5)), DP, is(std::f64::consts::PI / 256.0), "vertex diameter"),
    key(Id::Eps, "eps", Parameter, Number(POSITIVE.up_to(1.0)), DP, is(0.1), "smoothing of the edge length, in l0"),
    key(Id::Wall, "wall", Section, Choice(WallStiffness::NAMES), DP, Is(Word(WallStiffness::NAMES[0])), "what e_w means: shared by all edges, or for each"),
    key(Id::Contact, "contact", Section, Choice(ContactKind::NAMES), DP, Is(Word(ContactKind::NAMES[0])), "what of the ring touches walls"),
    key(Id::Gravity, "gravity", Section, Choice(GravityForm::NAMES), DP, Is(Word(GravityForm::NAMES[0])), "how gravity acts on the ring"),
    key(Id::SelfContact, "self_contact", Section, Choice(SelfContact::NAMES), DP, Is(Word(SelfContact::NAMES[0])), "whether the ring repels itself where it folds back"),
    key(Id::Engulfed, "engulfed", Section, Choice(Engulfed::NAMES), DP, Is(Word(Engulfed::NAMES[0])), "what happens when an obstacle lies inside the ring"),
    key(Id::W, "w", Parameter, Number(POSITIVE.up_to(100.0)), CHANNEL, Required, "width of the orifice"),
    key(Id::Angle, "angle", Parameter, Number(between(5.0, 85.0)), CHANNEL, is(45.0), "rise of the wedges from the axis, in degrees"),
    key(Id::TipRadius, "tip_radius", Parameter, Number(between(0.0, 10.0)), CHANNEL, is(0.0), "radius of the rounded tips"),
    key(Id::HStart, "h_start", Parameter, Number(between(-1000.0, -0.1)), CHANNEL, is(-10.0), "where the centroid starts"),
    key(Id::HStart, "h_start", Parameter, Number(between(-1000.0, -0.1)), DISC, is(-1.0), "where the centroid starts"),
    key(Id::HEnd, "h_end", Parameter, Number(between(0.1, 1000.0)), CHANNEL, is(3.0), "where the run ends, past the orifice"),
    key(Id::HEnd, "h_end", Parameter, Number(between(0.1, 1000.0)), DISC, is(3.0), "where the run ends, past the disc"),
    key(Id::Offset, "offset", Parameter, Number(between(-100.0, 100.0)), DISC, is(0.0), "how far beside the axis of the disc the centroid starts"),
    key(Id::WOb, "w_ob", Parameter, Number(at_least(0.0)), OBSTACLES, Required, "smallest gap between two obstacles"),
    key(Id::SigmaOb, "sigma_ob", Parameter, Number(POSITIVE), OBSTACLES, Required, "diameter of an obstacle"),
    key(Id::SigmaOb, "sigma_ob", Parameter, Number(POSITIVE), DISC, Required, "diameter of the disc"),
    key(Id::Density, "density", Parameter, NumberOr(POSITIVE, "saturated"), OBSTACLES, Required, "obstacles per sigma^2"),
    key(Id::BoxSize, "box_size", Parameter, Number(between(20.0, 5000.0)), OBSTACLES, is(500.0), "side of the periodic box"),
    key(Id::Dt, "dt", Parameter, NumberOr(POSITIVE, "auto"), Always, Is(Word("auto")), "time step"),
    key(Id::Tolerance, "tolerance", Section, NumberOr(POSITIVE.up_to(0.5), "none"), DP, Is(Word("none")), "largest relative error: takes the cheapest measured n_vertices, dt and integrator"),
    key(Id::SampleEvery, "sample_every", Parameter, Number(POSITIVE), Always, is(10.0), "time between two samples"),
    key(Id::ShapesEvery, "shapes_every", Parameter, NumberOr(at_least(1.0), "none"), Always, Is(Word("none")), "time between two kept shapes"),
    key(Id::TMax, "t_max", Limit, Number(POSITIVE), Always, is(2e5), "longest simulated time"),
    key(Id::Distance, "distance", Limit, NumberOr(POSITIVE, "none"), Always, Is(Word("none")), "way after which a run ends"),
    key(Id::RelativeError, "relative_error", Until, NumberOr(between(0.01, 1.0), "none"), Always, Is(Word("none")), "half of the 95% interval over the estimate at which no more seeds are added"),
    key(Id::Estimate, "estimate", Until, Choice(&["lambda", "v_g"]), Always, Is(Word("lambda")), "what that interval is of"),
    key(Id::MaxRuns, "max_runs", Until, Whole(between(1.0, 1e5)), Always, is(400.0), "most seeds per grid point"),
    key(Id::EkThreshold, "ek_threshold", Limit, Number(POSITIVE.below(1.0)), Always, is(1e-17), "E_k/E_t of a clog"),
];

impl Kind {
    /// What is allowed, to follow "must be".
    pub fn allowed(&self) -> String {
        match self {
            Text => "a text in quotes".to_owned(),
            Choice(words) => words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(" or "),
            Number(interval) => format!("a number {interval}"),
            NumberOr(interval, word) => format!("a number {interval}, or \"{word}\""),
            Whole(interval) => format!("a whole number {interval}"),
        }
    }

    /// The number as this kind holds it; `None` if it is out of range. A whole number may come as `2e2`, or a hair off
    /// one from a range.
    pub fn accept(&self, number: f64) -> Option<f64> {
        // Minus zero is zero: it must not give a job another identity.
        let number = number + 0.0;
        match self {
            Number(interval) | NumberOr(interval, _) => interval.contains(number).then_some(number),
            Whole(interval) => (number == number.round() && interval.contains(number)).then_some(number),
            Text | Choice(_) => None,
        }
    }

    /// The word, if this kind knows it.
    pub fn word(&self, text: &str) -> Option<&'static str> {
        match self {
            Choice(words) => words.iter().copied().find(|word| *word == text),
            NumberOr(_, word) => (*word == text).then_some(*word),
            Text | Number(_) | Whole(_) => None,
        }
    }
}

impl Key {
    /// Whether it can be an axis of the grid.
    pub fn is_axis(&self) -> bool {
        matches!(self.place, Parameter | Limit)
    }

    /// Whether it means something for this model and scene.
    pub fn means_something(&self, model: &str, scene: &str) -> bool {
        match self.meaning {
            Always => true,
            Model(name) => name == model,
            Scene(name) => name == scene,
        }
    }
}

/// The rows of that name: none if it is unknown, two for `e_w` and the like.
pub(super) fn rows(name: &str) -> impl Iterator<Item = &'static Key> + Clone {
    KEYS.iter().filter(move |key| key.name == name)
}

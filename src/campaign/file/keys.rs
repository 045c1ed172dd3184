//! The keys of a campaign file: the parameters of a point, and the few keys that belong to the campaign alone.
//!
//! Reading, range checks, suggestions and help texts all go by this table.

use crate::parameters::{Applies, Domain, PARAMETERS, Parameter, Short, Value, above, between};
use std::sync::LazyLock;

/// One key of a campaign file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key {
    /// How it is written.
    pub(crate) name: &'static str,
    /// What it is, in a line.
    pub(crate) about: &'static str,
    /// Its unit; empty for words and pure numbers.
    pub(crate) unit: &'static str,
    /// The tables that it may stand in.
    pub(crate) homes: &'static [Home],
    /// The values that it may have.
    pub(crate) domain: Domain,
    /// Where it means something.
    pub(crate) applies: Applies,
    /// What stands for it when it is left out; `None` if it must be given.
    pub(crate) default: Option<Value>,
    /// The parameter of a point that it sets.
    pub(crate) parameter: Option<&'static Parameter>,
}

/// A table that may stand in a file: `[limits]`, `[grid]`, ...
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table {
    /// How it is written.
    pub(crate) name: &'static str,
    /// What it is, in a line.
    pub(crate) about: &'static str,
    /// The tables that it may stand in.
    pub(crate) homes: &'static [Home],
    /// What its keys call it.
    pub(crate) home: Home,
}

/// All tables of a file.
pub(crate) const TABLES: &[Table] = &[
    Table { name: "limits", about: "when a run ends", homes: SECTION, home: Home::Limits },
    Table { name: "until", about: "until when seeds are added in rounds", homes: SECTION, home: Home::Until },
    Table {
        name: "grid",
        about: "axes: each key has a list of values and ranges, or one range, and all combinations are run",
        homes: SECTION,
        home: Home::Grid,
    },
    Table {
        name: "block",
        about: "[[block]]: points of one model in one scene; a block has the keys of the file, unless it has its own",
        homes: &[Home::File],
        home: Home::Block,
    },
];

/// A place in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Home {
    /// The top of the file.
    File,
    /// The top of a block.
    Block,
    /// `[limits]` of the file or of a block.
    Limits,
    /// `[until]` of the file or of a block.
    Until,
    /// `[grid]` of the file or of a block.
    Grid,
}

/// All keys. A name has several rows where its range or its meaning depends on model or scene.
pub(crate) static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| OWN.iter().copied().chain(parameters()).collect());

const SECTION: &[Home] = &[Home::File, Home::Block];

const UNTIL: &[Home] = &[Home::Until];
const TOLERANCE: &str = "largest relative error: takes the cheapest measured n_vertices, dt and integrator";
const FIT_FROM: &str =
    "displacement from which on runs count in the decay lengths of `run` and `until`; `fit` has --from";
const RELATIVE_ERROR: &str = "half of the 95% interval over the estimate at which no more seeds are added";

/// The keys that are no parameters of a point.
const OWN: &[Key] = &[
    key("name", SECTION, Domain::Text, None, "name of the campaign or of the block"),
    key("about", &[Home::File], Domain::Text, None, "what the campaign shows, in prose"),
    Key {
        unit: "sigma",
        ..key("fit_from", &[Home::File], Domain::Number(between(0.0, 1e6)), Some(Value::Number(0.0)), FIT_FROM)
    },
    key("runs_per_point", SECTION, Domain::Whole(between(1.0, 1e5)), None, "seeds per grid point"),
    key(
        "first_seed",
        SECTION,
        Domain::Whole(between(0.0, 1e15)),
        Some(Value::Number(0.0)),
        "the first seed; the others follow it",
    ),
    Key {
        applies: Applies::Model("DP"),
        ..key("tolerance", SECTION, Domain::NumberOr(above(0.0).up_to(0.5), "none"), NONE, TOLERANCE)
    },
    key("relative_error", UNTIL, Domain::NumberOr(between(0.01, 1.0), "none"), NONE, RELATIVE_ERROR),
    key(
        "estimate",
        UNTIL,
        Domain::Choice(&["lambda", "v_g"]),
        Some(Value::Word("lambda")),
        "what that interval is of: the decay length or the mean speed",
    ),
    key("max_runs", UNTIL, Domain::Whole(between(1.0, 1e5)), Some(Value::Number(400.0)), "most seeds per grid point"),
];

/// By default there is none.
const NONE: Option<Value> = Some(Value::Word("none"));

const fn key(
    name: &'static str,
    homes: &'static [Home],
    domain: Domain,
    default: Option<Value>,
    about: &'static str,
) -> Key {
    Key { name, about, unit: "", homes, domain, applies: Applies::Always, default, parameter: None }
}

/// The keys of the parameters. Numbers may be axes of the grid; words hold for a whole block.
fn parameters() -> impl Iterator<Item = Key> {
    PARAMETERS.iter().map(|parameter| {
        let Parameter { name, about, unit, domain, applies, default, .. } = *parameter;
        let homes: &[Home] = match domain {
            Domain::Choice(_) | Domain::Text => SECTION,
            _ if parameter.is_limit => &[Home::Limits, Home::Grid],
            _ => &[Home::File, Home::Block, Home::Grid],
        };
        Key { name, about, unit, homes, domain, applies, default, parameter: Some(parameter) }
    })
}

impl Key {
    /// Whether it can be an axis of the grid.
    pub(crate) fn is_axis(&self) -> bool {
        self.homes.contains(&Home::Grid)
    }

    /// The name of the key that it gives in another form.
    pub(crate) fn instead_of(&self) -> Option<&'static str> {
        self.parameter?.instead_of
    }

    /// "gamma (line tension, in g rho sigma^2)".
    pub(crate) fn described(&self) -> String {
        match self.unit {
            "" => format!("{} ({})", self.name, self.about),
            unit => format!("{} ({}, in {unit})", self.name, self.about),
        }
    }

    /// "line tension, in g rho sigma^2 (model DP)".
    pub(crate) fn meaning(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(", in {}", self.unit) };
        match self.applies {
            Applies::Always => format!("{}{unit}", self.about),
            Applies::Model(name) => format!("{}{unit} (model {name})", self.about),
            Applies::Scene(name) => format!("{}{unit} (scene {name})", self.about),
        }
    }

    /// Its default in words: a value and what `auto` stands for, "must be given", or what it is another form of.
    pub(crate) fn default_in_words(&self) -> String {
        let auto = self.parameter.map_or("", |parameter| parameter.auto);
        match (self.default, self.instead_of()) {
            (_, Some(other)) => format!("none; give it or {other}"),
            (Some(Value::Number(number)), _) => Short(number).to_string(),
            (Some(Value::Word("auto")), _) if !auto.is_empty() => format!("auto: {auto}"),
            (Some(Value::Word(word)), _) => word.to_owned(),
            (None, _) if self.name == "about" => "empty".to_owned(),
            (None, _) => "none; it must be given".to_owned(),
        }
    }

    /// Where it stands, in words.
    pub(crate) fn place(&self) -> String {
        let top = if self.homes.contains(&Home::Block) {
            "at the top of the file or of a block"
        } else {
            "at the top of the file"
        };
        let words = |home: &Home| match home {
            Home::File => Some(top),
            Home::Block => None,
            Home::Limits => Some("under [limits]"),
            Home::Until => Some("under [until]"),
            Home::Grid => Some("under [grid]"),
        };
        self.homes.iter().filter_map(words).collect::<Vec<_>>().join(", or ")
    }
}

/// The rows of that name: none if it is unknown, two for `e_w` and the like.
pub(crate) fn rows(name: &str) -> impl Iterator<Item = &'static Key> + Clone {
    KEYS.iter().filter(move |key| key.name == name)
}

/// The names of some keys, each once, in the order of the table.
pub(crate) fn names(which: impl Fn(&Key) -> bool) -> Vec<&'static str> {
    let mut names = Vec::new();
    for key in KEYS.iter().filter(|key| which(key)) {
        if !names.contains(&key.name) {
            names.push(key.name);
        }
    }
    names
}

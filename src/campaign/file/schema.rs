//! The JSON Schema of campaign files, made from the table of keys. Editors complete and check a file by it.
//!
//! A schema looks at one place after another. So it knows names, types, ranges and places of all keys, and, in a file
//! without blocks, which keys the model and the scene need. It does not know what blocks inherit, nor conditions on
//! several numbers: those are checked when a campaign is read.

use crate::campaign::file::axis::RANGE;
use crate::campaign::file::grid::LONGEST_AXIS;
use crate::campaign::file::keys::{Home, KEYS, Key, TABLES, names, rows};
use crate::parameters::{Applies, Domain, Interval, Value as Held};
use serde_json::{Map, Value, json};

/// The schema.
pub(crate) fn schema() -> Value {
    let mut root = object(Home::File);
    root["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    root["title"] = json!("a campaign of meniscus");
    root["required"] = json!(["name"]);
    root["if"] = json!({ "not": { "required": ["block"] } });
    root["then"] = whole_file();
    root
}

/// A table of the file and all that may stand in it.
fn object(home: Home) -> Value {
    let mut properties = Map::new();
    for name in names(|key| key.homes.contains(&home)) {
        let value = any_of(rows(name).map(domain));
        let value = if home == Home::Grid { axis(&value) } else { value };
        properties.insert(name.to_owned(), described(value, name));
    }
    for table in TABLES.iter().filter(|table| table.homes.contains(&home)) {
        let mut value = match table.home {
            Home::Block => {
                let mut block = object(Home::Block);
                block["required"] = json!(["name"]);
                json!({ "type": "array", "minItems": 1, "items": block })
            }
            inner => object(inner),
        };
        value["description"] = json!(table.about);
        properties.insert(table.name.to_owned(), value);
    }
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

/// What a key is, as editors show it, and its default.
fn described(mut value: Value, name: &str) -> Value {
    let texts: Vec<String> = rows(name).map(Key::meaning).collect();
    value["description"] = json!(texts.join("; or "));
    let mut defaults = rows(name).map(|key| key.default);
    if let (Some(Some(default)), None) = (defaults.next(), defaults.next()) {
        value["default"] = plain(default);
    }
    value
}

fn plain(value: Held) -> Value {
    match value {
        Held::Number(number) => json!(number),
        Held::Word(word) => json!(word),
    }
}

/// The values that a row of the table allows.
fn domain(key: &Key) -> Value {
    match key.domain {
        Domain::Text if key.name == "name" => {
            json!({ "type": "string", "pattern": "^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$" })
        }
        Domain::Text => json!({ "type": "string" }),
        Domain::Choice(words) => json!({ "enum": words }),
        Domain::Number(interval) => number("number", interval),
        Domain::Whole(interval) => number("integer", interval),
        Domain::WholeOr(interval, word) => json!({ "anyOf": [number("integer", interval), { "const": word }] }),
        Domain::NumberOr(interval, word) => json!({ "anyOf": [number("number", interval), { "const": word }] }),
    }
}

fn number(kind: &str, interval: Interval) -> Value {
    let mut value = json!({ "type": kind });
    let ((low, low_included), (high, high_included)) = (interval.low(), interval.high());
    value[if low_included { "minimum" } else { "exclusiveMinimum" }] = json!(low);
    if high.is_finite() {
        value[if high_included { "maximum" } else { "exclusiveMaximum" }] = json!(high);
    }
    value
}

/// One of these, each once.
fn any_of(values: impl Iterator<Item = Value>) -> Value {
    let mut all: Vec<Value> = Vec::new();
    values.for_each(|value| {
        if !all.contains(&value) {
            all.push(value);
        }
    });
    if all.len() == 1 { all.swap_remove(0) } else { json!({ "anyOf": all }) }
}

/// A list of values and ranges, or one range.
fn axis(value: &Value) -> Value {
    let mut properties: Map<String, Value> = RANGE
        .iter()
        .map(|(name, about)| ((*name).to_owned(), json!({ "type": "number", "description": about })))
        .collect();
    properties["points"] = json!({ "type": "integer", "minimum": 2, "maximum": LONGEST_AXIS });
    properties["step"] = json!({ "type": "number", "exclusiveMinimum": 0 });
    properties["scale"] = json!({ "enum": ["linear", "log"] });
    let range = json!({
        "type": "object",
        "properties": properties,
        "required": ["from", "to"],
        "oneOf": [{ "required": ["points"] }, { "required": ["step"] }],
        "additionalProperties": false,
    });
    let list = json!({
        "type": "array", "minItems": 1, "uniqueItems": true, "items": { "anyOf": [value, range] }
    });
    json!({ "anyOf": [list, range] })
}

/// What a file without blocks needs and must not have.
fn whole_file() -> Value {
    let needed: Vec<&str> = needed(Applies::Always).map(|key| key.name).collect();
    let mut rules = vec![json!({ "required": needed })];
    for what in ["model", "scene"] {
        let words = rows(what).flat_map(|key| key.domain.words());
        rules.extend(words.map(|word| of_word(what, word)));
    }
    let error = TABLES.iter().filter(|table| table.home == Home::Until).map(|table| table.name);
    rules.extend(error.map(|until| {
        json!({ "properties": { until: { "dependentRequired": {
            "max_runs": ["relative_error"], "estimate": ["relative_error"]
        } } } })
    }));
    json!({ "allOf": rules })
}

/// The keys that must be given where these rows apply; another form of a key is none of them.
fn needed(applies: Applies) -> impl Iterator<Item = &'static Key> {
    let must = move |key: &&Key| key.applies == applies && key.default.is_none() && key.instead_of().is_none();
    KEYS.iter().filter(must).filter(|key| !matches!(key.domain, Domain::Text))
}

/// What follows from a model or from a scene: keys that it needs, keys that mean nothing, and ranges of its own.
fn of_word(what: &'static str, word: &'static str) -> Value {
    let this = if what == "model" { Applies::Model(word) } else { Applies::Scene(word) };
    let kind = |applies: Applies| match applies {
        Applies::Model(_) => Some("model"),
        Applies::Scene(_) => Some("scene"),
        Applies::Always => None,
    };
    let (mut properties, mut axes) = (Map::new(), Map::new());
    for name in names(|key| kind(key.applies) == Some(what)) {
        let own = rows(name).find(|key| key.applies == this);
        if own.is_none() && rows(name).any(|key| kind(key.applies) != Some(what)) {
            continue;
        }
        let value = own.map_or(json!(false), domain);
        axes.insert(name.to_owned(), own.map_or(json!(false), |_| axis(&value)));
        properties.insert(name.to_owned(), value);
    }
    properties.insert("grid".to_owned(), json!({ "properties": axes }));
    let given = |key: &Key| {
        let other = KEYS.iter().filter(|other| other.instead_of() == Some(key.name)).map(|other| other.name);
        let places = std::iter::once(key.name).chain(other).flat_map(|name| {
            let on_axis = json!({ "properties": { "grid": { "required": [name] } }, "required": ["grid"] });
            [json!({ "required": [name] }), on_axis]
        });
        json!({ "anyOf": places.collect::<Vec<_>>() })
    };
    let needed: Vec<Value> = needed(this).map(given).collect();
    let mut then = json!({ "properties": properties });
    if !needed.is_empty() {
        then["allOf"] = json!(needed);
    }
    json!({ "if": { "properties": { what: { "const": word } }, "required": [what] }, "then": then })
}

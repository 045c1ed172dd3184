//! What the campaign chooses otherwise at some points of a block than at others, and where on the grid it switches.

use crate::campaign::file::Block;
use crate::campaign::plan::Ends;
use crate::parameters::{PARAMETERS, Point, Short, Value, list};
use std::sync::Arc;

/// A key that a file leaves to the campaign, and that has several values in a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Switch {
    /// The key.
    pub name: &'static str,
    /// Its values and where on the grid it has them.
    pub places: String,
}

/// The switches of a block. Time steps differ from point to point anyway, and are left out.
pub(super) fn of(block: &Block) -> Vec<Switch> {
    let open = PARAMETERS.iter().filter(|parameter| block.open.contains(&parameter.name) && parameter.name != "dt");
    open.filter_map(|parameter| switch(parameter.name, block)).collect()
}

fn switch(name: &'static str, block: &Block) -> Option<Switch> {
    let mut groups: Vec<(Value, Vec<&Point>)> = Vec::new();
    for point in block.points.iter().map(Arc::as_ref) {
        let Some(value) = list::value(point, name) else { continue };
        match groups.iter_mut().find(|group| group.0 == value) {
            Some(group) => group.1.push(point),
            None => groups.push((value, vec![point])),
        }
    }
    let several = groups.len() > 1;
    let places =
        groups.iter().map(|(value, points)| format!("{} at {}", written(*value), place(points, &groups, block)));
    several.then(|| Switch { name, places: places.collect::<Vec<_>>().join("; ") })
}

fn written(value: Value) -> String {
    match value {
        Value::Number(number) => Short(format!("{number:.2e}").parse().unwrap_or(number)).to_string(),
        Value::Word(word) => word.to_owned(),
    }
}

/// The span of each parameter that tells this group from the others; how many points it has, if there is none.
fn place(points: &[&Point], groups: &[(Value, Vec<&Point>)], block: &Block) -> String {
    let span = |points: &[&Point], name| Ends::of(points.iter().filter_map(|point| list::value(point, name)?.number()));
    let given = PARAMETERS.iter().map(|parameter| parameter.name).filter(|name| !block.open.contains(name));
    let telling = given.filter(|&name| groups.iter().any(|group| span(&group.1, name) != span(&groups[0].1, name)));
    let mut texts: Vec<String> = telling.map(|name| format!("{name} = {}", span(points, name))).collect();
    texts.dedup();
    match texts.is_empty() {
        true => format!("{} of {} points", points.len(), block.points.len()),
        false => texts.join(", "),
    }
}

//! The parameters of grid points by the names that campaigns and the view `runs` use, split into those that vary over
//! the rows of a table and those that do not.

use crate::parameters::{
    Channel, Deformable, Density, Limits, LoneDisc, Model, ObstacleField, Point, Scene, Soft, Stepping,
};
use crate::report::rounding::significant;
use std::cmp::Ordering;

/// Significant digits of a parameter, more only where they tell two values of a column apart.
const DIGITS: usize = 6;

/// The value of one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Value {
    Number(f64),
    Name(&'static str),
}

impl Value {
    fn text(self, digits: usize) -> String {
        match self {
            Self::Number(number) => significant(number, digits),
            Self::Name(name) => name.to_owned(),
        }
    }

    /// Numbers by size, before names.
    fn order(&self, other: &Self) -> Ordering {
        match (self, other) {
            (Self::Number(a), Self::Number(b)) => a.total_cmp(b),
            (Self::Number(_), Self::Name(_)) => Ordering::Less,
            (Self::Name(_), Self::Number(_)) => Ordering::Greater,
            (Self::Name(a), Self::Name(b)) => a.cmp(b),
        }
    }
}

/// Points of one model in one kind of scene: what they share, and what tells them apart.
pub(super) struct Split {
    /// `gamma = 1.09` and so on, with no-break spaces: the parameters that all points share.
    pub constant: Vec<String>,
    /// Names of the others.
    pub varying: Vec<&'static str>,
    /// Their values, a row per point.
    pub rows: Vec<Vec<String>>,
    /// The points in the order of those values, as positions in the list given.
    pub order: Vec<usize>,
}

/// Splits the parameters of points, all of one model in one kind of scene.
pub(super) fn split(points: &[&Point]) -> Split {
    let all: Vec<_> = points.iter().map(|point| parameters(point)).collect();
    let mut split = Split {
        constant: vec![],
        varying: vec![],
        rows: vec![vec![]; points.len()],
        order: (0..points.len()).collect(),
    };
    let Some(first) = all.first() else { return split };
    let mut columns = vec![];
    for (i, &(name, value)) in first.iter().enumerate() {
        let column: Vec<Value> = all.iter().map(|parameters| parameters[i].1).collect();
        if column.iter().all(|other| *other == value) {
            split.constant.push(format!("{name}\u{a0}=\u{a0}{}", value.text(DIGITS)));
            continue;
        }
        split.varying.push(name);
        split.rows.iter_mut().zip(texts(&column)).for_each(|(row, text)| row.push(text));
        columns.push(column);
    }
    let compare = |&a: &usize, &b: &usize| {
        let orders = columns.iter().map(|column| column[a].order(&column[b]));
        orders.fold(Ordering::Equal, Ordering::then)
    };
    split.order.sort_by(compare);
    split
}

/// The values of a column, with the fewest digits from [`DIGITS`] up that keep different values different.
fn texts(column: &[Value]) -> Vec<String> {
    let with = |digits| column.iter().map(|value| value.text(digits)).collect::<Vec<_>>();
    let distinct = |texts: &[String]| {
        let pairs = || column.iter().zip(texts);
        pairs().all(|(a, text)| pairs().all(|(b, other)| a == b || text != other))
    };
    (DIGITS..17).map(with).find(|texts| distinct(texts)).unwrap_or_else(|| with(17))
}

/// All parameters of a point, in the order in which they are read. A field added to a point must be named here.
fn parameters(point: &Point) -> Vec<(&'static str, Value)> {
    let Point { model, scene, v_t, b0, alpha, stepping, limits, sample_every, shapes_every } = point;
    let Stepping { integrator, dt } = stepping;
    let Limits { t_max, distance, ek_threshold } = limits;
    let mut list = match model {
        Model::Deformable(Deformable {
            gamma,
            kappa,
            k_a,
            n_vertices,
            e_w,
            delta,
            eps,
            wall,
            contact,
            gravity,
            self_contact,
            engulfed,
        }) => vec![
            ("gamma", Value::Number(*gamma)),
            ("kappa", Value::Number(*kappa)),
            ("k_a", Value::Number(*k_a)),
            ("n_vertices", Value::Number(*n_vertices as f64)),
            ("e_w", Value::Number(*e_w)),
            ("delta", Value::Number(*delta)),
            ("eps", Value::Number(*eps)),
            ("wall", Value::Name(wall.name())),
            ("contact", Value::Name(contact.name())),
            ("gravity", Value::Name(gravity.name())),
            ("self_contact", Value::Name(self_contact.name())),
            ("engulfed", Value::Name(engulfed.name())),
        ],
        Model::Soft(Soft { e_w }) => vec![("e_w", Value::Number(*e_w))],
    };
    match scene {
        Scene::Obstacles(ObstacleField { w_ob, sigma_ob, density, box_size }) => {
            let density = match density {
                Density::Saturated => Value::Name("saturated"),
                Density::Number(number) => Value::Number(*number),
            };
            list.extend([
                ("w_ob", Value::Number(*w_ob)),
                ("sigma_ob", Value::Number(*sigma_ob)),
                ("density", density),
                ("box_size", Value::Number(*box_size)),
            ]);
        }
        Scene::Channel(Channel { w, angle, tip_radius, h_start, h_end }) => list.extend([
            ("w", Value::Number(*w)),
            ("angle", Value::Number(*angle)),
            ("tip_radius", Value::Number(*tip_radius)),
            ("h_start", Value::Number(*h_start)),
            ("h_end", Value::Number(*h_end)),
        ]),
        Scene::Disc(LoneDisc { sigma_ob, offset, h_start, h_end }) => list.extend([
            ("sigma_ob", Value::Number(*sigma_ob)),
            ("offset", Value::Number(*offset)),
            ("h_start", Value::Number(*h_start)),
            ("h_end", Value::Number(*h_end)),
        ]),
        Scene::Plate => {}
    }
    list.extend([
        ("v_t", Value::Number(*v_t)),
        ("b0", Value::Number(*b0)),
        ("alpha", Value::Number(alpha.unwrap_or(4.0 / 3.0))),
        ("integrator", Value::Name(integrator.name())),
        ("dt", Value::Number(*dt)),
        ("t_max", Value::Number(*t_max)),
        ("distance", distance.map_or(Value::Name("none"), Value::Number)),
        ("ek_threshold", Value::Number(*ek_threshold)),
        ("sample_every", Value::Number(*sample_every)),
        ("shapes_every", shapes_every.map_or(Value::Name("none"), Value::Number)),
    ]);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_shows_more_digits_only_where_values_would_look_alike() {
        let column = [0.123_456_78, 0.5].map(Value::Number);
        assert_eq!(texts(&column), ["0.123457", "0.5"]);
        let column = [0.123_456_78, 0.123_456_79].map(Value::Number);
        assert_eq!(texts(&column), ["0.12345678", "0.12345679"]);
        assert_eq!(texts(&[Value::Name("saturated"), Value::Number(0.35)]), ["saturated", "0.35"]);
    }
}

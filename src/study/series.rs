//! Grid points that differ in one parameter alone, in its order: what is compared along an axis of a grid.

use crate::parameters::{PARAMETERS, Parameter, Point, Value};
use crate::results::fits::PointRuns;
use std::borrow::Borrow;
use std::collections::{BTreeMap, BTreeSet};

/// Points that differ in one parameter, by its value.
#[derive(Clone, Debug)]
pub struct Series<'a>(pub Vec<(f64, &'a PointRuns)>);

/// The values of a point's parameters but for `axis`, and but for those that may follow from it (`auto`) unless they are
/// `wanted`.
fn others(point: &PointRuns, axis: &str, wanted: bool) -> String {
    let stands = |parameter: &&Parameter| parameter.name != axis && parameter.instead_of != Some(axis);
    let counts = PARAMETERS.iter().filter(stands).filter(|parameter| wanted || parameter.auto.is_empty());
    let values = counts.filter_map(|parameter| Some((parameter.name, parameter.get(&point.point)?)));
    values.map(|(name, value)| format!("{name} = {value:?}; ")).collect()
}

/// Whether a campaign may leave a parameter of this point to the program. Then it may change along any axis.
pub(crate) fn may_follow(point: &Point, name: &str) -> bool {
    let mut rows = PARAMETERS.iter().filter(|parameter| parameter.name == name && parameter.get(point).is_some());
    rows.any(|parameter| !parameter.auto.is_empty())
}

/// The value of a parameter of a point, if it is a number.
fn number(point: &PointRuns, name: &str) -> Option<f64> {
    let rows = PARAMETERS.iter().filter(|parameter| parameter.name == name);
    rows.filter_map(|parameter| parameter.get(&point.point)).find_map(Value::number)
}

/// The series of points along the parameter `axis`; those of one point are left out.
///
/// Numbers of vertices, wall stiffnesses and steps that a campaign leaves to the program may change along the axis. Where
/// two points have the same value of the axis, those numbers tell series apart too.
pub fn series<'a>(points: &'a [impl Borrow<PointRuns>], axis: &str) -> Vec<Series<'a>> {
    let grouped = |points: &[&'a PointRuns], wanted: bool| {
        let mut groups: BTreeMap<String, Vec<&'a PointRuns>> = BTreeMap::new();
        let on_axis = points.iter().filter(|point| number(point, axis).is_some());
        on_axis.for_each(|point| groups.entry(others(point, axis, wanted)).or_default().push(point));
        groups.into_values()
    };
    let values = |group: &[&PointRuns]| -> BTreeSet<u64> {
        group.iter().filter_map(|point| number(point, axis)).map(f64::to_bits).collect()
    };
    let all: Vec<&PointRuns> = points.iter().map(Borrow::borrow).collect();
    let groups = grouped(&all, false).flat_map(|group| match values(&group).len() == group.len() {
        true => vec![group],
        false => grouped(&group, true).collect(),
    });
    let ordered = groups.filter(|group| group.len() > 1).map(|group| {
        let mut along: Vec<_> = group.into_iter().filter_map(|point| Some((number(point, axis)?, point))).collect();
        along.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series(along)
    });
    ordered.collect()
}

/// The parameters along which there is a series of at least `fewest` points.
pub fn axes(points: &[impl Borrow<PointRuns>], fewest: usize) -> Vec<&'static str> {
    let mut names = Vec::new();
    for parameter in PARAMETERS.iter().filter(|parameter| parameter.instead_of.is_none()) {
        let mut values: Vec<f64> = points.iter().filter_map(|point| number(point.borrow(), parameter.name)).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let is_axis = values.len() >= fewest && !names.contains(&parameter.name);
        if is_axis && series(points, parameter.name).iter().any(|series| series.0.len() >= fewest) {
            names.push(parameter.name);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Deformable, Density, Model, ObstacleField, Scene};

    fn point(gamma: f64, n_vertices: usize, w_ob: f64) -> PointRuns {
        let array = ObstacleField { w_ob, sigma_ob: 0.3, density: Density::Number(0.7), box_size: 60.0 };
        let ring = Deformable { n_vertices, ..Deformable::of_tension(gamma) };
        let point = Point::new(Model::Deformable(ring), Scene::Obstacles(array));
        PointRuns { point_id: point.id(), point, runs: Vec::new() }
    }

    fn values(series: &[Series<'_>]) -> Vec<Vec<f64>> {
        series.iter().map(|series| series.0.iter().map(|(value, _)| *value).collect()).collect()
    }

    #[test]
    fn a_series_has_one_value_of_everything_else_and_vertices_may_follow_the_axis() {
        let points = [point(1.0, 64, 0.2), point(0.1, 96, 0.2), point(0.3, 64, 0.4), point(3.0, 64, 0.4)];
        assert_eq!(values(&series(&points, "gamma")), [[0.1, 1.0], [0.3, 3.0]]);
        assert_eq!(axes(&points, 2), ["gamma"]);
        assert_eq!(axes(&points, 3), [""; 0]);
    }

    #[test]
    fn where_vertices_are_an_axis_too_they_tell_series_apart() {
        let points = [point(1.0, 64, 0.2), point(0.1, 64, 0.2), point(1.0, 128, 0.2), point(0.1, 128, 0.2)];
        assert_eq!(values(&series(&points, "gamma")), [[0.1, 1.0], [0.1, 1.0]]);
        assert_eq!(values(&series(&points, "n_vertices")), [[64.0, 128.0], [64.0, 128.0]]);
    }
}

//! The parameters of a grid point as columns of the table `points`.

use crate::parameters::{Density, Model, Point, Scene};
use rusqlite::types::Value;

/// Their names. Points are listed in the order of these columns.
pub(in crate::store) const COLUMNS: &str =
    "model, scene, gamma, e_w, w_ob, sigma_ob, density, b0, v_t, k_a, kappa, w, n_vertices, dt, integrator";

/// The parameters of a point, in the order of [`COLUMNS`]; NULL where a parameter means nothing for it.
pub(in crate::store) fn values(point: &Point) -> [Value; 15] {
    let (ring, e_w) = match &point.model {
        Model::Deformable(ring) => (Some(ring), ring.e_w),
        Model::Soft(soft) => (None, soft.e_w),
    };
    let (field, sigma_ob, channel) = match &point.scene {
        Scene::Obstacles(field) => (Some(field), Some(field.sigma_ob), None),
        Scene::Disc(disc) => (None, Some(disc.sigma_ob), None),
        Scene::Channel(channel) => (None, None, Some(channel)),
        Scene::Plate => (None, None, None),
    };
    let density = field.map(|field| match field.density {
        Density::Saturated => Value::Text("saturated".to_owned()),
        Density::Number(number) => Value::Real(number),
    });
    [
        Value::Text(point.model.name().to_owned()),
        Value::Text(point.scene.name().to_owned()),
        ring.map(|ring| ring.gamma).into(),
        e_w.into(),
        field.map(|field| field.w_ob).into(),
        sigma_ob.into(),
        density.unwrap_or(Value::Null),
        point.b0.into(),
        point.v_t.into(),
        ring.map(|ring| ring.k_a).into(),
        ring.map(|ring| ring.kappa).into(),
        channel.map(|channel| channel.w).into(),
        ring.map(|ring| ring.n_vertices as i64).into(),
        point.stepping.dt.into(),
        Value::Text(point.stepping.integrator.name().to_owned()),
    ]
}

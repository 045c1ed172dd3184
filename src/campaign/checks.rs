//! What a grid point must satisfy, wherever it comes from: the range of every parameter, and what several parameters
//! must satisfy together. Campaign files name the range of a key before they make points of it, so of theirs only the
//! latter can be broken.

use crate::campaign::choose::tolerance::{Unmet, table};
use crate::campaign::memory::{array_bytes, record_bytes, size};
use crate::parameters::{
    Density, Dynamics, Integrator, Model, PARAMETERS, Point, Scene, Short, Stepping, Value, cut_to_three_digits,
};
use crate::physics::simulate::stability::StabilityLimit;

/// Largest side of a box, in spacings of its obstacles. Cells are counted with 16 bits.
const LARGEST_BOX: f64 = 10_000.0;

/// Most memory that placing the obstacles of one array may take, in bytes.
const LARGEST_ARRAY: f64 = 4e9;

/// Most memory that the record of one run may take, in bytes.
const LARGEST_RECORD: f64 = 1e9;

/// Most steps of a run.
const MOST_STEPS: f64 = 1e12;

/// How many vertices `dynamics = "darcy"` takes.
const DARCY_VERTICES: std::ops::RangeInclusive<usize> = 16..=512;

/// A condition that a grid point breaks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Breach {
    /// The parameter to blame.
    pub(crate) key: &'static str,
    /// How far beyond the limit, as a ratio above 1.
    pub(crate) excess: f64,
    pub(crate) message: String,
    pub(crate) help: String,
}

/// All conditions that a point breaks; `limit` is that of the point.
pub(crate) fn breaches(point: &Point, limit: &StabilityLimit) -> Vec<Breach> {
    let together = [
        stable(point, limit),
        has_ring(point),
        fits_dynamics(point),
        room_for_all(point),
        fits_box(point),
        can_be_held(point),
        ends(point),
        can_be_recorded(point),
        fits_start(point),
    ];
    out_of_range(point).chain(together.into_iter().flatten()).collect()
}

/// Refuses a point that no campaign file can make, wherever it comes from: stores and dumps hold points too, and a
/// stranger may have made them.
///
/// # Errors
/// What is wrong with the first parameter at fault, and what is allowed.
pub(crate) fn validate(point: &Point) -> Result<(), String> {
    // Conditions of several parameters are worked out for numbers that lie in their ranges alone.
    let first = out_of_range(point).next();
    let first = first.or_else(|| breaches(point, &StabilityLimit::of(point)).into_iter().next());
    first.map_or(Ok(()), |Breach { key, message, help, .. }| Err(format!("{key}: {message}; {help}")))
}

/// The parameters whose numbers lie outside of their ranges.
fn out_of_range(point: &Point) -> impl Iterator<Item = Breach> {
    PARAMETERS.iter().filter_map(|parameter| {
        let Value::Number(number) = parameter.get(point)? else { return None };
        let wrong = parameter.domain.number(number).is_none();
        wrong.then(|| Breach {
            key: parameter.name,
            excess: f64::INFINITY,
            message: format!("{} is out of range", Short(number)),
            help: format!("{} must be {}", parameter.name, parameter.domain.allowed()),
        })
    })
}

/// `dt <= dt_max` of [`StabilityLimit`] for Verlet.
fn stable(point: &Point, limit: &StabilityLimit) -> Option<Breach> {
    let Stepping { integrator, dt } = point.stepping;
    let stiffest = limit.terms.first().filter(|_| integrator == Integrator::Verlet && dt > limit.dt_max)?;
    let way_out = match &point.model {
        Model::Deformable(_) => " or integrator = \"implicit\", which has no such limit",
        Model::Soft(_) => "",
    };
    Some(Breach {
        key: "dt",
        excess: dt / limit.dt_max,
        message: format!(
            "a step of {} is above the stability limit {}, set mainly by {} (omega = {:.0})",
            Short(dt),
            Short(cut_to_three_digits(limit.dt_max)),
            stiffest.term,
            stiffest.omega
        ),
        help: format!("{}; or write dt = \"auto\"{way_out}", stiffest.remedy),
    })
}

/// What is wrong if no measured setting meets the tolerance at a point.
pub(crate) fn unmet_tolerance(point: &Point, tolerance: f64) -> Option<Breach> {
    let breach = |excess, message, help| Some(Breach { key: "tolerance", excess, message, help });
    match table().choose(tolerance, point).err()? {
        Unmet::TooFine(kind, Some(finest)) => breach(
            finest.error / tolerance,
            format!(
                "the finest setting measured {} is off by {} ({}; n_vertices = {}, {})",
                kind.place(),
                Short(finest.error),
                finest.of,
                finest.n_vertices,
                finest.integrator.name()
            ),
            format!("write {} or more, or n_vertices, dt and integrator instead of `tolerance`", Short(finest.error)),
        ),
        Unmet::NotMeasured | Unmet::TooFine(_, None) => breach(
            f64::INFINITY,
            format!("no settings were measured in such a scene ({})", point.scene.name()),
            "write n_vertices, dt and integrator instead of it; settings were measured in arrays of obstacles, in channels \
             and in free flight"
                .to_owned(),
        ),
    }
}

/// Implicit steps of fixed length move rings alone.
fn has_ring(point: &Point) -> Option<Breach> {
    let is_implicit = point.stepping.integrator == Integrator::Implicit;
    (is_implicit && matches!(point.model, Model::Soft(_))).then(|| Breach {
        key: "integrator",
        excess: f64::INFINITY,
        message: format!("the soft particle has no {} integrator, and needs none", point.stepping.integrator.name()),
        help: "leave it out here, or give it in the blocks of model DP".to_owned(),
    })
}

/// Dense matrices bound the number of vertices under `dynamics = "darcy"`, and steps that follow their error have no
/// length of their own.
fn fits_dynamics(point: &Point) -> Option<Breach> {
    let breach = |key, excess, message, help: &str| Some(Breach { key, excess, message, help: help.to_owned() });
    if let Model::Deformable(ring) = &point.model
        && ring.dynamics == Dynamics::Darcy
        && !DARCY_VERTICES.contains(&ring.n_vertices)
    {
        let (n, most) = (ring.n_vertices as f64, *DARCY_VERTICES.end() as f64);
        let message = format!("{n} vertices do not fit dynamics = \"darcy\", whose matrices are dense");
        let help = "n_vertices must be a whole number from 16 to 512 there; left out, it is 64 to 192";
        return breach("n_vertices", (n / most).max(*DARCY_VERTICES.start() as f64 / n), message, help);
    }
    if point.stepping.integrator == Integrator::Adaptive && !(1e-3..=10.0).contains(&point.stepping.dt) {
        let message = format!("{} is no time between two looks at a droplet", Short(point.stepping.dt));
        let help = "where steps follow their error (`step_error`), dt must be a number from 0.001 to 10";
        return breach("dt", f64::INFINITY, message, help);
    }
    None
}

/// The density is below `n_max = 0.547/(pi D^2/4)`, where discs of diameter `D = sigma_ob + w_ob` jam.
fn room_for_all(point: &Point) -> Option<Breach> {
    let Scene::Obstacles(field) = &point.scene else { return None };
    let Density::Number(density) = field.density else { return None };
    let most = field.jammed_density();
    (density >= most).then(|| Breach {
        key: "density",
        excess: density / most,
        message: format!(
            "{} obstacles per sigma^2 do not fit, at most {} do",
            Short(density),
            Short(cut_to_three_digits(most))
        ),
        help: "lower density, sigma_ob or w_ob; or write density = \"saturated\"".to_owned(),
    })
}

/// Two obstacles side by side fit the periodic box, so that none meets its own image.
fn fits_box(point: &Point) -> Option<Breach> {
    let Scene::Obstacles(field) = &point.scene else { return None };
    let spacing = field.sigma_ob + field.w_ob;
    let most = field.box_size / 2.0;
    (spacing > most).then(|| Breach {
        key: "sigma_ob",
        excess: spacing / most,
        message: format!("sigma_ob + w_ob = {} is more than half the box", Short(spacing)),
        help: format!("lower sigma_ob or w_ob, or raise box_size above {}", Short(2.0 * spacing)),
    })
}

/// The obstacles are not too many for the memory.
fn can_be_held(point: &Point) -> Option<Breach> {
    let Scene::Obstacles(field) = &point.scene else { return None };
    let spacing = field.sigma_ob + field.w_ob;
    let excess = field.box_size / (LARGEST_BOX * spacing);
    if excess > 1.0 {
        let message = format!(
            "the box, {} wide, is more than {LARGEST_BOX} times sigma_ob + w_ob = {}",
            Short(field.box_size),
            Short(spacing)
        );
        let help =
            format!("raise sigma_ob or w_ob, to {} together, or lower box_size", Short(field.box_size / LARGEST_BOX));
        return Some(Breach { key: "sigma_ob", excess, message, help });
    }
    let bytes = array_bytes(field);
    (bytes > LARGEST_ARRAY).then(|| Breach {
        key: "box_size",
        excess: bytes / LARGEST_ARRAY,
        message: format!("placing its obstacles takes {}, and at most {} are used", size(bytes), size(LARGEST_ARRAY)),
        help: "lower box_size or density, or raise sigma_ob or w_ob".to_owned(),
    })
}

/// The steps come to an end.
fn ends(point: &Point) -> Option<Breach> {
    let steps = point.limits.t_max / point.stepping.dt;
    (steps > MOST_STEPS).then(|| Breach {
        key: "dt",
        excess: steps / MOST_STEPS,
        message: format!(
            "steps of {} up to t_max = {} do not end",
            Short(point.stepping.dt),
            Short(point.limits.t_max)
        ),
        help: format!("a run has at most {} steps: raise dt, or lower t_max", Short(MOST_STEPS)),
    })
}

/// What a run records fits in memory, where it stays until the run ends.
fn can_be_recorded(point: &Point) -> Option<Breach> {
    let record = record_bytes(point);
    let (key, bytes) = if record.samples >= record.shapes {
        ("sample_every", record.samples)
    } else {
        ("shapes_every", record.shapes)
    };
    (record.samples + record.shapes > LARGEST_RECORD).then(|| Breach {
        key,
        excess: bytes / LARGEST_RECORD,
        message: format!("up to t_max = {} a run records {}", Short(point.limits.t_max), size(bytes)),
        help: format!("a run may record {}: raise {key}, or lower t_max", size(LARGEST_RECORD)),
    })
}

/// The droplet touches no wall where it starts.
fn fits_start(point: &Point) -> Option<Breach> {
    let radius = match &point.model {
        Model::Deformable(ring) => 0.5 * (1.0 + ring.delta),
        Model::Soft(_) => 0.5,
    };
    let (h_start, free) = match &point.scene {
        Scene::Channel(channel) => (channel.h_start, channel.first_contact(radius)),
        Scene::Disc(disc) => {
            let reach = radius + 0.5 * disc.sigma_ob;
            (disc.h_start, -(reach * reach - disc.offset * disc.offset).max(0.0).sqrt())
        }
        Scene::Obstacles(_) | Scene::Plate => return None,
    };
    (h_start > free).then(|| Breach {
        key: "h_start",
        excess: free / h_start,
        message: format!("at h_start = {} the droplet, of diameter 1, would lie in the wall", Short(h_start)),
        help: format!("start below {}", Short(-(-1000.0 * free).ceil() / 1000.0)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Deformable, ObstacleField};

    #[test]
    fn a_point_of_any_origin_is_held_against_ranges_and_conditions() {
        let field = ObstacleField { w_ob: 0.2, sigma_ob: 0.3, density: Density::Number(3.0), box_size: 50.0 };
        let mut point = Point::new(Model::Deformable(Deformable::of_tension(1.0)), Scene::Obstacles(field));
        point.stepping.dt = 1e-4;
        point.sample_every = f64::NAN;
        point.b0 = -1.0;
        let keys: Vec<_> = breaches(&point, &StabilityLimit::of(&point)).iter().map(|breach| breach.key).collect();
        assert_eq!(keys, ["b0", "sample_every", "density"]);
    }
}

//! What several keys must satisfy together, at every grid point.

use crate::campaign::choose::tolerance::{Refusal, table};
use crate::campaign::file::interval::{Short, cut_to_three_digits};
use crate::campaign::file::keys::Id;
use crate::parameters::{Density, Integrator, Model, Point, Scene, Stepping};
use crate::physics::simulate::stability::StabilityLimit;

/// Largest side of a box, in spacings of its obstacles: to place them then takes up to 3 GB, or 10 GB where they are dense.
const LARGEST_BOX: f64 = 10_000.0;

/// Coverage of the plane by discs at which random sequential addition jams.
const SATURATION: f64 = 0.547;

/// A condition that a grid point breaks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Breach {
    /// The key to blame.
    pub(super) id: Id,
    /// How far beyond the limit, as a ratio above 1.
    pub(super) excess: f64,
    pub(super) message: String,
    pub(super) help: String,
}

/// The conditions; each looks at one grid point.
pub(super) const CHECKS: [fn(&Point, &StabilityLimit) -> Option<Breach>; 6] =
    [stable, has_ring, room_for_all, fits_box, can_be_held, fits_start];

/// `dt <= dt_max` of [`StabilityLimit`] for Verlet.
fn stable(point: &Point, limit: &StabilityLimit) -> Option<Breach> {
    let Stepping { integrator, dt } = point.stepping;
    let stiffest = limit.terms.first().filter(|_| integrator == Integrator::Verlet && dt > limit.dt_max)?;
    let way_out = match &point.model {
        Model::Deformable(_) => " or integrator = \"implicit\", which knows no such limit",
        Model::Soft(_) => "",
    };
    Some(Breach {
        id: Id::Dt,
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

/// A tolerance that some measured setting meets.
pub(super) fn measured(point: &Point, tolerance: f64) -> Option<Breach> {
    let breach = |excess, message, help| Some(Breach { id: Id::Tolerance, excess, message, help });
    match table().choose(tolerance, point).err()? {
        Refusal::TooFine(kind, Some(finest)) => breach(
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
        Refusal::NotMeasured | Refusal::TooFine(_, None) => breach(
            f64::INFINITY,
            format!("no settings were measured in such a scene ({})", point.scene.name()),
            "write n_vertices, dt and integrator instead of it; measured are arrays of obstacles, channels, and free flight"
                .to_owned(),
        ),
    }
}

/// The implicit integrator is of the ring.
fn has_ring(point: &Point, _: &StabilityLimit) -> Option<Breach> {
    let implicit = point.stepping.integrator == Integrator::Implicit;
    (implicit && matches!(point.model, Model::Soft(_))).then(|| Breach {
        id: Id::Integrator,
        excess: f64::INFINITY,
        message: "the soft particle has no implicit integrator, and no need of one".to_owned(),
        help: "leave it out here; a block may have a key of its own".to_owned(),
    })
}

/// Density below `n_max = 0.547/(pi D^2/4)`, where discs of diameter `D = sigma_ob + w_ob` jam.
fn room_for_all(point: &Point, _: &StabilityLimit) -> Option<Breach> {
    let Scene::Obstacles(field) = &point.scene else { return None };
    let Density::Number(density) = field.density else { return None };
    let spacing = field.sigma_ob + field.w_ob;
    let most = SATURATION / (std::f64::consts::FRAC_PI_4 * spacing * spacing);
    (density >= most).then(|| Breach {
        id: Id::Density,
        excess: density / most,
        message: format!(
            "no more than {} obstacles per sigma^2 find room, not {}",
            Short(cut_to_three_digits(most)),
            Short(density)
        ),
        help: "lower density, sigma_ob or w_ob; or write density = \"saturated\"".to_owned(),
    })
}

/// Two obstacles side by side fit the periodic box, so that none meets its own image.
fn fits_box(point: &Point, _: &StabilityLimit) -> Option<Breach> {
    let Scene::Obstacles(field) = &point.scene else { return None };
    let spacing = field.sigma_ob + field.w_ob;
    let most = field.box_size / 2.0;
    (spacing > most).then(|| Breach {
        id: Id::SigmaOb,
        excess: spacing / most,
        message: format!("sigma_ob + w_ob = {} is more than half the box", Short(spacing)),
        help: format!("lower sigma_ob or w_ob, or raise box_size above {}", Short(2.0 * spacing)),
    })
}

/// The obstacles are not so many that memory ends.
fn can_be_held(point: &Point, _: &StabilityLimit) -> Option<Breach> {
    let Scene::Obstacles(field) = &point.scene else { return None };
    let spacing = field.sigma_ob + field.w_ob;
    let excess = field.box_size / (LARGEST_BOX * spacing);
    (excess > 1.0).then(|| Breach {
        id: Id::SigmaOb,
        excess,
        message: format!(
            "the box, {} wide, is more than {LARGEST_BOX} times sigma_ob + w_ob = {}",
            Short(field.box_size),
            Short(spacing)
        ),
        help: format!("raise sigma_ob or w_ob, to {} together, or lower box_size", Short(field.box_size / LARGEST_BOX)),
    })
}

/// The droplet touches no wall where it starts.
fn fits_start(point: &Point, _: &StabilityLimit) -> Option<Breach> {
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
        id: Id::HStart,
        excess: free / h_start,
        message: format!("at h_start = {} the droplet, of diameter 1, would lie in the wall", Short(h_start)),
        help: format!("start below {}", Short(-(-1000.0 * free).ceil() / 1000.0)),
    })
}

//! What makes a trajectory fail, and what ends it.

use crate::parameters::{Engulfed, Model, Point, Scene};
use crate::physics::motion::Motion;
use crate::physics::observation::Observation;
use crate::physics::ring::forces::self_contact::{apart::Apart, crosses};
use crate::physics::simulate::snapshot::Course;
use crate::results::outline::Outline;
use crate::results::trajectory::{Failure, FailureClass, Outcome};

/// A larger rise of the total energy over its lowest value so far shows an instability, in g rho sigma^3.
const ENERGY_RISE_LIMIT: f64 = 0.05;

/// The rules of one trajectory, which depend only on its point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judge {
    delta: f64,
    /// The rule for which parts of a ring are neighbours along it.
    apart: Apart,
    /// Whether a trajectory fails if an obstacle lies inside the droplet.
    fails_engulfed: bool,
    ek_threshold: f64,
    /// The outcome of a droplet that comes to rest.
    at_rest: Outcome,
    /// The trajectory ends with an exit beyond this x.
    h_end: f64,
    distance: f64,
}

impl Judge {
    pub(super) fn of(point: &Point) -> Self {
        let (delta, apart, fails_engulfed) = match &point.model {
            Model::Deformable(ring) => (ring.delta, Apart::of(ring), ring.engulfed == Engulfed::Fail),
            Model::Soft(_) => (0.0, Apart::Way, false),
        };
        let (h_end, at_rest) = match &point.scene {
            Scene::Obstacles(_) => (f64::INFINITY, Outcome::Clogged),
            Scene::Channel(channel) => (channel.h_end, Outcome::Clogged),
            Scene::Disc(disc) => (disc.h_end, Outcome::Clogged),
            Scene::Plate => (f64::INFINITY, Outcome::Settled),
        };
        let (ek_threshold, distance) = (point.limits.ek_threshold, point.limits.distance.unwrap_or(f64::INFINITY));
        Self { delta, apart, fails_engulfed, ek_threshold, at_rest, h_end, distance }
    }

    /// Checks that the droplet is sound at time `t`, and notes its energy, its outline, and an obstacle inside it.
    /// Returns the outline of the check before.
    ///
    /// # Errors
    /// A [`Failure`] of class `unstable`, `engulfed` or `crossed`, with the last sound outline.
    pub(super) fn sound(
        &self,
        motion: &dyn Motion,
        course: &mut Course,
        seen: &Observation,
        t: f64,
    ) -> Result<Outline, Failure> {
        let rise = seen.energy() - course.lowest_energy;
        // Negated, so that a NaN fails too.
        if !(rise < ENERGY_RISE_LIMIT) {
            let reason =
                format!("the total energy rose by {rise:.3e} at t = {t}; lower dt, or see it with `meniscus render`");
            // The present outline is not sound, so that of the check before is kept.
            return Err(failure(FailureClass::Unstable, reason, course.step, &course.outline));
        }
        let before = std::mem::replace(&mut course.outline, motion.outline(t));
        let is_fresh = motion.is_fresh();
        if let Some([x, y]) = is_fresh.then(|| motion.engulfed()).flatten() {
            if self.fails_engulfed {
                let reason = format!(
                    "the obstacle at ({x:.3}, {y:.3}) lies inside the droplet at t = {t}; raise e_w, or see it with \
                     `meniscus render`"
                );
                return Err(failure(FailureClass::Engulfed, reason, course.step, &course.outline));
            }
            course.recorder.extremes.engulfed_t.get_or_insert(t);
        }
        if is_fresh && motion.ring().is_some_and(|ring| crosses(ring, self.delta, self.apart)) {
            let reason = format!("the droplet's outline crosses itself at t = {t}");
            return Err(failure(FailureClass::Crossed, reason, course.step, &course.outline));
        }
        course.lowest_energy = course.lowest_energy.min(seen.energy());
        course.recorder.watch(seen, rise);
        Ok(before)
    }

    /// Whether a droplet that stays at an equilibrium of this displacement and x would have gone on to be a clog, with
    /// time enough: it has moved, and no other end comes first.
    pub(super) fn would_stay(&self, course: &Course, r: f64, x: f64) -> bool {
        course.has_moved && r < self.distance && x < self.h_end
    }

    /// How the trajectory ends at this check, if it does; `last` if its time is over.
    pub(super) fn outcome(&self, course: &mut Course, seen: &Observation, last: bool) -> Option<Outcome> {
        let is_below = course.recorder.ek_ratio(seen) < self.ek_threshold;
        course.has_moved |= !is_below;
        // A clog needs two checks in a row, because a droplet that turns back is at rest for an instant.
        let rests = course.has_moved && is_below && course.was_below;
        course.was_below = is_below;
        if rests {
            Some(self.at_rest)
        } else if seen.x >= self.h_end {
            Some(Outcome::Exited)
        } else if course.recorder.displacement(seen) >= self.distance {
            Some(Outcome::Distance)
        } else {
            last.then_some(Outcome::TimeLimit)
        }
    }
}

fn failure(class: FailureClass, reason: String, step: u64, outline: &Outline) -> Failure {
    Failure { class, reason, step, outline: Some(Box::new(outline.clone())) }
}

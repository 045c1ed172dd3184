//! Drives a droplet from check to check until its trajectory ends: step, judge, record, finish.

use crate::parameters::Point;
use crate::physics::motion::{Interruption, Motion, MotionState};
use crate::physics::observation::Observation;
use crate::physics::simulate::arrest::arrest;
use crate::physics::simulate::snapshot::{Course, EndState, Keeper, Snapshot};
use crate::physics::simulate::{
    RunEnded, judge::Judge, mechanism, record::Extremes, record::Recorder, timetable::Timetable,
};
use crate::results::trajectory::{Arrest, Clog, Failure, Outcome, Pinch, Trajectory};
use std::sync::atomic::AtomicBool;

pub(super) fn begin(motion: &mut dyn Motion, point: &Point) -> Course {
    let begin = motion.observe();
    let mut recorder = Recorder::new(point, begin);
    let outline = motion.outline(0.0);
    if point.shapes_every.is_some() {
        recorder.outlines.push(outline.clone());
    }
    let lowest_energy = begin.energy();
    Course { step: 0, checks: 0, has_moved: false, was_below: false, lowest_energy, outline, recorder }
}

/// Advances from check to check until the trajectory ends.
pub(super) fn drive(
    motion: &mut dyn Motion,
    point: &Point,
    mut course: Course,
    stop: &AtomicBool,
    keeper: &mut dyn Keeper,
) -> Result<RunEnded, Failure> {
    let (timetable, judge, dt) = (Timetable::of(point), Judge::of(point), point.stepping.dt);
    loop {
        let here = motion.state();
        if keeper.wants() {
            keeper.keep(Snapshot { course: course.clone(), motion: here.clone() });
        }
        let (next, mark) = (timetable.next(course.step), course.mark());
        match motion.advance(next - course.step, stop) {
            Ok(()) => {}
            Err(Interruption::Stopped) => return Ok(stopped(course, here)),
            Err(Interruption::Failed(failure)) => {
                let outline = Some(Box::new(motion.outline(failure.step as f64 * dt)));
                return Err(Failure { outline, ..failure });
            }
        }
        motion.follow();
        (course.step, course.checks) = (next, course.checks + 1);
        let (t, seen) = (next as f64 * dt, motion.observe());
        let outline = judge.sound(motion, &mut course, &seen, t)?;
        let pinch = motion.pinched().map(|[x, y]| Pinch { x, y });
        let outcome = match pinch {
            Some(_) => Some(Outcome::Pinched),
            None => judge.outcome(&mut course, &seen, next == timetable.end),
        };
        record(&mut course, timetable, &seen, t, outcome.is_some());
        let Some(outcome) = outcome else { continue };
        let refused = motion.refused();
        let arrest = match outcome {
            Outcome::TimeLimit => match arrest(motion, &judge, &course, &seen, stop) {
                Err(Interruption::Stopped) => return Ok(stopped(course.rewind(mark, outline), here)),
                Err(Interruption::Failed(failure)) => return Err(failure),
                Ok(arrest) => arrest,
            },
            _ => None,
        };
        if keeper.wants_end() {
            keeper.keep_end(EndState::of(&course, mark, outline, here));
        }
        return Ok(RunEnded::Finished(Box::new(finish(course, End { outcome, arrest, pinch }, t, &seen, refused))));
    }
}

/// A trajectory that was told to stop. It will go on from the last check; steps after that are dropped.
fn stopped(course: Course, motion: MotionState) -> RunEnded {
    RunEnded::Stopped(Some(Box::new(Snapshot { course, motion })))
}

/// Records what is due at this check; at the last check, everything.
fn record(course: &mut Course, timetable: Timetable, seen: &Observation, t: f64, last: bool) {
    if last || timetable.is_sample(course.checks) {
        course.recorder.record(t, seen);
    }
    if last || timetable.is_outline(course.checks) {
        course.recorder.outlines.push(course.outline.clone());
    }
}

/// How a trajectory ended, and where that was if it is not the droplet's place.
struct End {
    outcome: Outcome,
    arrest: Option<Arrest>,
    pinch: Option<Pinch>,
}

fn finish(course: Course, end: End, t: f64, seen: &Observation, refused: u64) -> Trajectory {
    let End { outcome, arrest, pinch } = end;
    let Course { step, outline, recorder, .. } = course;
    let (r, ek_ratio) = (recorder.displacement(seen), recorder.ek_ratio(seen));
    let Observation { x, y, shape, contacts, .. } = *seen;
    let Extremes { shape_max, area_error_max, overlap_max, energy_rise_max, ek_ratio_min, engulfed_t } =
        recorder.extremes;
    let clog = || Clog { t, r, x, y, ek_ratio, shape, contacts, mechanism: mechanism::of(&outline) };
    Trajectory {
        outcome,
        r_end: r,
        t_end: t,
        v_g_mean: recorder.mean_speed(),
        ek_ratio_end: ek_ratio,
        shape_max,
        area_error_max,
        overlap_max,
        energy_rise_max,
        ek_ratio_min,
        engulfed_t,
        delta_s: (outcome == Outcome::Settled).then_some(r),
        steps: step,
        refused,
        clog: (outcome == Outcome::Clogged).then(clog),
        arrest,
        pinch,
        samples: recorder.samples,
        outlines: recorder.outlines,
    }
}

#[cfg(test)]
mod tests;

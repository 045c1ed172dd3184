//! Steps that are taken again, and the end of a motion that no step leads on.

use crate::physics::motion::darcy::DarcyMotion;
use crate::physics::motion::darcy::solver::Unsolved;
use crate::physics::motion::step_length;
use crate::physics::walls::wall::Walls;
use crate::results::trajectory::{Failure, FailureClass};

/// Why a step was not taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Refused {
    Unsolved(Unsolved),
    /// The error is this many times too large.
    Inexact(f64),
    EnergyRises(f64),
}

impl From<Unsolved> for Refused {
    fn from(unsolved: Unsolved) -> Self {
        Self::Unsolved(unsolved)
    }
}

impl<W: Walls> DarcyMotion<W> {
    /// Shortens the next step.
    pub(super) fn retreat(&mut self, h: f64, refused: Refused) -> Result<(), Failure> {
        let course = &mut self.course;
        course.counts.refused += 1;
        course.next = match refused {
            Refused::Unsolved(_) => 0.4 * h,
            Refused::Inexact(error) => {
                let order = if course.known >= 2 { 2.0 } else { 1.0 };
                step_length::instead(h, libm::pow(1.0 / error, 1.0 / (order + 1.0)))
            }
            Refused::EnergyRises(_) if course.known > 0 => 0.5 * h,
            Refused::EnergyRises(_) => 0.3 * h,
        };
        if let Refused::EnergyRises(_) = refused {
            (course.known, course.spaces) = (0, false);
        }
        if course.next >= step_length::SHORTEST {
            return Ok(());
        }
        let why = match refused {
            Refused::Unsolved(Unsolved::Saddle) => "the energy has no minimum near".to_owned(),
            Refused::Unsolved(Unsolved::Swallows) => "it would swallow an obstacle".to_owned(),
            Refused::Unsolved(Unsolved::TooFar) => "a vertex would move too far".to_owned(),
            Refused::Unsolved(Unsolved::Diverges) => "it has no solution".to_owned(),
            Refused::Inexact(error) => format!("its error is {error:.1e} times step_error"),
            Refused::EnergyRises(rise) => format!("the energy would rise by {rise:.1e}"),
        };
        let t = self.readings[1].t;
        let reason = format!(
            "at t = {t:.3} no step can be taken, even at {:.1e} t0: {why}; raise n_vertices, or see it with `meniscus \
             render`",
            course.next
        );
        Err(Failure { class: FailureClass::Unstable, reason, step: course.steps, outline: None })
    }
}

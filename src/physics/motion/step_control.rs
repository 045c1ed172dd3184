//! How long the next sub-step is: the nominal step, halved as often as needed.
//!
//! A refused sub-step is tried again at half its length. After some accepted sub-steps in a row the length doubles, but
//! only at a multiple of the doubled length. So sub-steps always add up to the nominal step exactly.

use serde::{Deserialize, Serialize};

/// A nominal step in ticks; a tick is the smallest possible sub-step, `dt/65536`.
pub(super) const WHOLE: u32 = 1 << 16;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StepControl {
    most_halvings: u32,
    patience: u32,
    halvings: u32,
    successes: u32,
}

impl StepControl {
    /// Begins with whole steps. They are halved at most `most_halvings <= 16` times, and doubled again after `patience`
    /// accepted sub-steps in a row.
    pub(super) const fn new(most_halvings: u32, patience: u32) -> Self {
        Self { most_halvings, patience, halvings: 0, successes: 0 }
    }

    /// Goes on from `saved`. False, and nothing changes, if `saved` has other limits.
    pub(super) fn resume(&mut self, saved: Self) -> bool {
        let fits = Self { halvings: saved.halvings, successes: saved.successes, ..*self } == saved
            && saved.halvings <= self.most_halvings;
        if fits {
            *self = saved;
        }
        fits
    }

    /// How many sub-steps of the present length make a nominal step.
    pub(super) fn parts(self) -> u32 {
        1 << self.halvings
    }

    pub(super) fn ticks(self) -> u32 {
        WHOLE >> self.halvings
    }

    /// Length of the next sub-step, for a nominal step of `dt`.
    pub(super) fn length(self, dt: f64) -> f64 {
        dt / f64::from(self.parts())
    }

    /// Notes that a sub-step was accepted and ended `at` ticks into the nominal step.
    pub(super) fn accepted(&mut self, at: u32) {
        self.successes += 1;
        if self.halvings > 0 && self.successes >= self.patience && at.is_multiple_of(2 * self.ticks()) {
            self.halvings -= 1;
            self.successes = 0;
        }
    }

    /// Halves the sub-steps; false if they cannot be halved further.
    pub(super) fn refused(&mut self) -> bool {
        self.successes = 0;
        let shorter = self.halvings < self.most_halvings;
        self.halvings += u32::from(shorter);
        shorter
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PATIENCE: u32 = 4;

    proptest! {
        #[test]
        fn sub_steps_add_up_to_whole_steps_whatever_is_refused(refusals in proptest::collection::vec(any::<bool>(), 300)) {
            let mut control = StepControl::new(16, PATIENCE);
            let (mut at, mut wholes) = (0, 0);
            for refused in refusals {
                if refused {
                    prop_assert!(control.refused() || control.ticks() == 1);
                    continue;
                }
                let ticks = control.ticks();
                prop_assert_eq!(at % ticks, 0);
                at += ticks;
                prop_assert!(at <= WHOLE);
                control.accepted(at);
                if at == WHOLE {
                    (at, wholes) = (0, wholes + 1);
                }
            }
            prop_assert_eq!(at % control.ticks(), 0);
            prop_assert!(wholes <= 300);
        }
    }

    #[test]
    fn the_step_comes_back_to_its_full_length() {
        let mut control = StepControl::new(16, PATIENCE);
        for _ in 0..3 {
            control.refused();
        }
        let (mut at, mut taken) = (0, 0);
        while control.ticks() < WHOLE {
            at = (at + control.ticks()) % WHOLE;
            control.accepted(if at == 0 { WHOLE } else { at });
            taken += 1;
        }
        assert!(taken <= 3 * 2 * PATIENCE, "{taken}");
    }
}

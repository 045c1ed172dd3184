//! How time advances, and how a droplet is put in place.

pub mod guard;
pub mod implicit;
pub mod memory;
pub mod placing;
pub mod step_control;
pub mod verlet;

use std::sync::atomic::{AtomicBool, Ordering};

/// Takes `steps` in pieces of at most `piece`; false, and somewhere on the way, once `stop` is set.
pub(crate) fn in_pieces(stop: &AtomicBool, steps: u64, piece: u64, mut advance: impl FnMut(u64)) -> bool {
    let mut left = steps;
    while left > 0 {
        if stop.load(Ordering::Relaxed) {
            return false;
        }
        advance(left.min(piece));
        left -= left.min(piece);
    }
    true
}

//! Calls of a library that may panic, without a word on stderr: the caller says what is wrong.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Whether this thread is within such a call.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Calls `ask`; `None` if it panics. Panics elsewhere are told as before.
pub(super) fn quietly<T>(ask: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let tell = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                tell(panic);
            }
        }));
    });
    let before = QUIET.replace(true);
    let answer = catch_unwind(AssertUnwindSafe(ask));
    QUIET.set(before);
    answer.ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_within_gives_no_answer_and_ends_nothing() {
        assert_eq!(quietly(|| 7), Some(7));
        assert_eq!(quietly::<i32>(|| panic!("unseen")), None);
        assert!(!QUIET.get());
    }
}

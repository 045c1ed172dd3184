//! Text of unknown origin, made harmless: names, paths and reasons from files that others wrote.
//!
//! A terminal obeys control characters: they move its cursor, set its clipboard, or forge a line of output. So whatever
//! comes from a file passes through [`plain`] before it is put into a line, and whole texts for people through
//! [`harmless`] before they are printed.

use std::borrow::Cow;
use std::path::Path;

/// A text on one line: control characters stand as escapes, as in `\n`, `\t` or `\u{1b}`.
///
/// ```
/// use meniscus::parameters::plain;
/// assert_eq!(plain("\u{1b}[2Jnothing\nis wrong"), r"\u{1b}[2Jnothing\nis wrong");
/// assert_eq!(plain("größe"), "größe");
/// ```
pub fn plain(text: &str) -> Cow<'_, str> {
    escaped(text, is_obeyed)
}

/// A text of several lines: control characters stand as escapes, except line feeds and tabs.
pub(crate) fn harmless(text: &str) -> Cow<'_, str> {
    escaped(text, |c| is_obeyed(c) && c != '\n' && c != '\t')
}

/// A path as a message shows it, on one line.
pub(crate) fn shown(path: &Path) -> String {
    plain(&path.to_string_lossy()).into_owned()
}

/// Whether a terminal acts on a character and does not show it: control characters, ends of lines, and characters that
/// change the direction of what follows.
fn is_obeyed(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{2028}' | '\u{2029}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

fn escaped(text: &str, escapes: fn(char) -> bool) -> Cow<'_, str> {
    if !text.chars().any(escapes) {
        return Cow::Borrowed(text);
    }
    let mut safe = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if escapes(c) { safe.extend(c.escape_default()) } else { safe.push(c) }
    }
    Cow::Owned(safe)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_text_of_several_lines_keeps_its_lines() {
        assert_eq!(harmless("a\n\tb\u{7}\u{9b}c\r\n"), "a\n\tb\\u{7}\\u{9b}c\\r\n");
        assert_eq!(plain("a\u{202e}b"), "a\\u{202e}b");
    }

    proptest! {
        #[test]
        fn no_text_moves_the_cursor_or_begins_a_line(text in any::<String>()) {
            prop_assert!(!plain(&text).chars().any(char::is_control));
            prop_assert!(harmless(&text).chars().all(|c| !c.is_control() || c == '\n' || c == '\t'));
        }
    }
}

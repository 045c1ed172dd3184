//! Paths as one types them, for commands that are shown to be pasted into a shell.

use std::fmt::Write;
use std::path::Path;

/// A path as an argument in a shell: in quotes if it needs them, and never taken for an option.
pub(crate) fn typed(path: &Path) -> String {
    let bytes = path.as_os_str().as_encoded_bytes();
    let dash = if bytes.starts_with(b"-") { "./" } else { "" };
    let plain = |c: char| c.is_alphanumeric() || "-_./+,:@%=".contains(c);
    match str::from_utf8(bytes) {
        Ok(text) if !text.is_empty() && text.chars().all(plain) => format!("{dash}{text}"),
        Ok(text) if !text.chars().any(char::is_control) => format!("'{dash}{}'", text.replace('\'', r"'\''")),
        _ => format!("$'{dash}{}'", escaped(bytes)),
    }
}

/// The inside of `$'...'`, which bash, zsh and other shells know: it can hold every byte on one line.
fn escaped(bytes: &[u8]) -> String {
    let mut text = String::new();
    for chunk in bytes.utf8_chunks() {
        for c in chunk.valid().chars() {
            match c {
                '\n' => text.push_str(r"\n"),
                '\t' => text.push_str(r"\t"),
                '\'' | '\\' => text.extend(['\\', c]),
                c if c.is_control() => c.to_string().bytes().for_each(|byte| push_byte(&mut text, byte)),
                c => text.push(c),
            }
        }
        chunk.invalid().iter().for_each(|&byte| push_byte(&mut text, byte));
    }
    text
}

fn push_byte(text: &mut String, byte: u8) {
    let _ = write!(text, r"\{byte:03o}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_in_commands_can_be_pasted_into_a_shell() {
        let texts = ["runs/a.meniscus", "my runs", "it's", "-x", "", "~/$HOME"].map(|path| typed(Path::new(path)));
        assert_eq!(texts, ["runs/a.meniscus", "'my runs'", r"'it'\''s'", "./-x", "''", "'~/$HOME'"]);
    }

    #[test]
    #[cfg(unix)]
    fn a_shell_makes_the_same_bytes_of_it_whatever_they_are() {
        use std::os::unix::ffi::OsStrExt;
        let names: [&[u8]; 7] =
            [b"a b", b"a\nb", b"-a\n'b\\", b"\xff7", b"`x` $(y) \"z\"", b"\x01\x7f8", "f\u{fc}r\u{85}9".as_bytes()];
        for name in names {
            let word = typed(Path::new(std::ffi::OsStr::from_bytes(name)));
            assert!(!word.contains('\n'), "{word}");
            let told = std::process::Command::new("bash").args(["-c", &format!("printf %s {word}")]).output().unwrap();
            assert_eq!(told.stdout.strip_prefix(b"./").unwrap_or(&told.stdout), name, "{word}");
        }
    }
}

//! Where data goes: to stdout, or whole to a file.

use crate::cli::CommandResult;
use crate::cli::Exit;
use crate::parameters::{harmless, shown};
use crate::store::Format;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, IsTerminal, Write};
use std::path::Path;

/// Writes what `write` writes to stdout (a reader that closes the pipe early has seen enough), or to the file asked
/// for, which is there whole or not at all.
pub(super) fn deliver<E: Into<Box<dyn Error>>>(
    format: Format,
    file: Option<&Path>,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> CommandResult {
    if let Some(path) = file.filter(|path| path.as_os_str() != "-") {
        to_file(path, write)?;
        return Ok(Exit::Done);
    }
    if format == Format::Parquet && std::io::stdout().is_terminal() {
        return Err(
            "a Parquet file is not for reading on a terminal: append > FILE.parquet, or choose csv or json".into()
        );
    }
    let mut out = BufWriter::new(std::io::stdout().lock());
    // Programs get every character; people, and their terminals, get those that only show.
    match format == Format::Table || (format != Format::Parquet && std::io::stdout().is_terminal()) {
        true => write(&mut Harmless(&mut out)).map_err(Into::into)?,
        false => write(&mut out).map_err(Into::into)?,
    }
    match out.flush() {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(Exit::Done),
    }
}

/// Writes a file under another name and renames it, so that nobody ever sees half of it; an error names it.
pub(super) fn to_file<E: Into<Box<dyn Error>>>(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), Box<dyn Error>> {
    let failed = |error: std::io::Error| format!("cannot write {}: {error}", shown(path));
    // The file that a link leads to is replaced, not the link.
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if target.exists() && !target.is_file() {
        // A pipe or a device has no whole.
        let mut out = BufWriter::new(File::options().write(true).open(&target).map_err(failed)?);
        write(&mut out).map_err(Into::into)?;
        return Ok(out.flush().map_err(failed)?);
    }
    let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut half = tempfile::Builder::new();
    half.prefix(".meniscus-");
    #[cfg(unix)]
    half.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut half = half.tempfile_in(folder).map_err(failed)?;
    let mut out = BufWriter::new(&mut half);
    write(&mut out).map_err(Into::into)?;
    out.flush().map_err(failed)?;
    drop(out);
    half.persist(&target).map_err(|error| failed(error.error))?;
    Ok(())
}

/// Escapes what a terminal would obey in text that is written, a whole number of characters at a time.
struct Harmless<W>(W);

impl<W: Write> Write for Harmless<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write_all(harmless(&String::from_utf8_lossy(bytes)).as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

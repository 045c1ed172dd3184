//! Frames of an experiment, read from CSV: position, speed and shape of a droplet.
//!
//! | column | unit | |
//! |---|---|---|
//! | `h` | sigma | position of the centroid, zero at the orifice |
//! | `v_g` | V_t | speed of the centroid |
//! | `shape` | | shape parameter `A = perimeter^2/(4 pi a)` |
//! | `v_g_error`, `shape_error` | as `v_g`, `shape` | one standard error; may be left out |
//! | `trial` | | the passage that the frame belongs to; may be left out if there is only one |
//!
//! All mistakes of a file are reported together, each with its line.

mod cells;
mod read;

use crate::campaign::file::{Invalid, Problems, line_of};
use crate::parameters::shown;
use crate::study::calibrate::frames::read::trials;
use std::path::PathBuf;

/// Names that the header may hold; the first three are required.
const COLUMNS: [&str; 6] = ["h", "v_g", "shape", "v_g_error", "shape_error", "trial"];

/// How many of [`COLUMNS`] are required.
const REQUIRED: usize = 3;

/// Fewest frames of a trial: one more than the parameters that are fitted.
const FEWEST_FRAMES: usize = 3;

/// One frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Position of the centroid, in sigma.
    pub h: f64,
    /// Speed, in V_t.
    pub v_g: f64,
    /// Shape parameter A.
    pub shape: f64,
    /// Standard error of `v_g`; 1 where the file gives none.
    pub v_g_error: f64,
    /// Standard error of `shape`; 1 where the file gives none.
    pub shape_error: f64,
}

/// One passage of a droplet.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Its name in the column `trial`; `None` if the file has no such column.
    pub name: Option<String>,
    /// Its frames, in the order of the file; at least three.
    pub frames: Vec<Frame>,
}

impl Trial {
    pub(super) fn range(&self) -> [f64; 2] {
        let ends = |[low, high]: [f64; 2], frame: &Frame| [low.min(frame.h), high.max(frame.h)];
        self.frames.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends)
    }
}

/// Why frames could not be read.
#[derive(Debug, thiserror::Error)]
pub enum FramesError {
    /// The file could not be read.
    #[error("cannot read the frames {}: {source}; check the path and its permissions", shown(path))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not text.
    #[error("the frames {file} are not UTF-8 text: line {line} holds other bytes; export them as CSV in UTF-8")]
    NotUtf8 {
        /// The file.
        file: String,
        /// Line of the first bad byte, from 1.
        line: usize,
    },
    /// The file has mistakes.
    #[error("{}", .0.render(false))]
    Invalid(Box<Invalid>),
}

/// All files of frames that could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}", rendered(.0, false))]
pub(crate) struct BadFrames(pub(crate) Vec<FramesError>);

impl BadFrames {
    pub(crate) fn render(&self, colour: bool) -> String {
        rendered(&self.0, colour)
    }
}

fn rendered(errors: &[FramesError], colour: bool) -> String {
    errors.iter().map(|error| error.render(colour)).collect::<Vec<_>>().join("\n\n")
}

impl FramesError {
    /// The whole message with source lines, in colour if asked.
    pub(crate) fn render(&self, colour: bool) -> String {
        match self {
            Self::Invalid(invalid) => invalid.render(colour),
            Self::Unreadable { .. } | Self::NotUtf8 { .. } => format!("error: {self}"),
        }
    }
}

/// Reads the bytes of a file of frames; `file` is its name in the errors. Trials have the order of their first frames.
///
/// ```
/// let text = "h,v_g,shape\n-0.5,0.7,1.00\n0.0,0.9,1.10\n0.5,1.1,1.02\n";
/// let trials = meniscus::study::calibrate::frames::parse("frames.csv", text).unwrap();
/// assert_eq!((trials.len(), trials[0].frames[1].shape), (1, 1.1));
/// ```
///
/// # Errors
/// If the bytes are not UTF-8; or all mistakes, in the order of the file.
pub fn parse(file: &str, bytes: impl AsRef<[u8]>) -> Result<Vec<Trial>, FramesError> {
    let bytes = bytes.as_ref();
    let text = std::str::from_utf8(bytes)
        .map_err(|error| FramesError::NotUtf8 { file: file.to_owned(), line: line_of(bytes, error.valid_up_to()) })?;
    // Spreadsheets put a byte order mark in front.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut problems = Problems::of(text);
    let trials = trials(text, &mut problems);
    if problems.is_empty() {
        return Ok(trials);
    }
    Err(FramesError::Invalid(Box::new(problems.into_invalid(file))))
}

//! Frames of an experiment, read from CSV: where the droplet was, how fast, and of what shape.
//!
//! | column | unit | |
//! |---|---|---|
//! | `h` | sigma | position of the centroid, zero at the orifice |
//! | `v_g` | V_t | speed of the centroid |
//! | `shape` | | shape parameter `A = perimeter^2/(4 pi a)` |
//! | `v_g_error`, `shape_error` | as `v_g`, `shape` | one standard error; may be left out |
//! | `trial` | | which passage the frame belongs to; may be left out where a file holds one |

use crate::campaign::file::{Invalid, Problems, line_of, nearest};
use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Names that the header may hold; the first three it must.
pub const COLUMNS: [&str; 6] = ["h", "v_g", "shape", "v_g_error", "shape_error", "trial"];

/// How many of [`COLUMNS`] a file must have.
const REQUIRED: usize = 3;

/// Fewest frames of a trial: one more than the parameters that are fitted.
pub const FEWEST_FRAMES: usize = 3;

/// Farthest from the orifice that a frame may be, in sigma.
const FARTHEST: f64 = 1000.0;

/// One frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Position of the centroid, in sigma.
    pub h: f64,
    /// Speed, in V_t.
    pub v_g: f64,
    /// Shape parameter.
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
    /// Its frames, in the order of the file; at least [`FEWEST_FRAMES`].
    pub frames: Vec<Frame>,
}

impl Trial {
    /// Smallest and largest h.
    pub fn range(&self) -> [f64; 2] {
        let ends = |[low, high]: [f64; 2], frame: &Frame| [low.min(frame.h), high.max(frame.h)];
        self.frames.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends)
    }
}

/// Why frames could not be read.
#[derive(Debug, thiserror::Error)]
pub enum FramesError {
    /// The file could not be read.
    #[error("cannot read the frames {}: {source}; check the path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not text.
    #[error("the frames {} are not UTF-8 text: line {line} holds other bytes; export them as CSV in UTF-8", path.display())]
    NotUtf8 {
        /// The file.
        path: PathBuf,
        /// Line of the first bad byte, from 1.
        line: usize,
    },
    /// The file was read and has mistakes.
    #[error("{}", .0.render(false))]
    Invalid(Box<Invalid>),
}

impl FramesError {
    /// The whole message with source lines, in colour if asked.
    pub fn render(&self, colour: bool) -> String {
        match self {
            Self::Invalid(invalid) => invalid.render(colour),
            Self::Unreadable { .. } | Self::NotUtf8 { .. } => format!("error: {self}"),
        }
    }
}

/// Reads a file of frames; its trials come in the order in which they first appear.
///
/// # Errors
/// If the file cannot be read, is not UTF-8, or has mistakes: then all of them.
pub fn load(path: &Path) -> Result<Vec<Trial>, FramesError> {
    let bytes = std::fs::read(path).map_err(|source| FramesError::Unreadable { path: path.to_owned(), source })?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|error| FramesError::NotUtf8 { path: path.to_owned(), line: line_of(&bytes, error.valid_up_to()) })?;
    parse(&path.display().to_string(), text)
}

/// Reads the text of a file of frames; `file_name` appears in the errors.
///
/// ```
/// let text = "h,v_g,shape\n-0.5,0.7,1.00\n0.0,0.9,1.10\n0.5,1.1,1.02\n";
/// let trials = meniscus::study::calibrate::frames::parse("frames.csv", text).unwrap();
/// assert_eq!((trials.len(), trials[0].frames[1].shape), (1, 1.1));
/// ```
///
/// # Errors
/// All mistakes of the file, in its order.
pub fn parse(file_name: &str, text: &str) -> Result<Vec<Trial>, FramesError> {
    // Spreadsheets put a byte order mark in front.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut problems = Problems::of(text);
    let trials = Reading { text, problems: &mut problems }.trials();
    if problems.is_empty() {
        return Ok(trials);
    }
    Err(FramesError::Invalid(Box::new(problems.into_invalid(file_name))))
}

/// A text being read, and its mistakes so far.
struct Reading<'t, 'p> {
    text: &'t str,
    problems: &'p mut Problems<'t>,
}

impl Reading<'_, '_> {
    fn trials(&mut self) -> Vec<Trial> {
        let mut trials: Vec<Trial> = Vec::new();
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(self.text.as_bytes());
        let mut records = reader.records();
        let Some(header) = records.next().and_then(Result::ok).and_then(|header| self.header(&header)) else {
            if self.problems.is_empty() {
                self.problems.add(0..0, None, "the file is empty".to_owned(), Some(header_help()));
            }
            return trials;
        };
        let mut last = 0..0;
        for record in records {
            let record = match record {
                Ok(record) => record,
                Err(error) => {
                    self.ragged(&error, header.len());
                    continue;
                }
            };
            last = self.line(&record);
            let Some((name, frame)) = self.frame(&header, &record) else { continue };
            match trials.iter_mut().find(|trial| trial.name == name) {
                Some(trial) => trial.frames.push(frame),
                None => trials.push(Trial { name, frames: vec![frame] }),
            }
        }
        if self.problems.is_empty() {
            self.enough(&trials, last);
        }
        trials
    }

    /// Which of [`COLUMNS`] stands where; `None` if the header has a mistake.
    fn header(&mut self, record: &csv::StringRecord) -> Option<Vec<usize>> {
        let (spans, mut seen) = (self.fields(record), HashSet::new());
        let mut places = Vec::new();
        let mut wrong = false;
        for (name, span) in record.iter().map(str::trim).zip(spans) {
            let Some(place) = COLUMNS.iter().position(|column| *column == name) else {
                let help = match nearest(name, COLUMNS) {
                    Some(meant) => format!("did you mean `{meant}`? {}", header_help()),
                    None => header_help(),
                };
                self.problems.add(span, None, format!("`{name}` is no column of frames"), Some(help));
                wrong = true;
                continue;
            };
            if !seen.insert(name) {
                let help = "keep one of them".to_owned();
                self.problems.add(span, Some(name.to_owned()), "the column appears twice".to_owned(), Some(help));
                wrong = true;
            }
            places.push(place);
        }
        let missing: Vec<&str> = COLUMNS[..REQUIRED].iter().copied().filter(|column| !seen.contains(column)).collect();
        // A name that is misspelt is not missing, too.
        if !wrong && !missing.is_empty() {
            let (line, missing) = (self.line(record), missing.join("`, `"));
            self.problems.add(line, None, format!("no column is named `{missing}`"), Some(header_help()));
            wrong = true;
        }
        (!wrong).then_some(places)
    }

    /// The frame of a line and the name of its trial; `None` if it has a mistake.
    fn frame(&mut self, header: &[usize], record: &csv::StringRecord) -> Option<(Option<String>, Frame)> {
        let spans = self.fields(record);
        let (mut name, mut numbers, mut sound) = (None, [0.0, 0.0, 0.0, 1.0, 1.0], true);
        for ((&place, cell), span) in header.iter().zip(record).zip(spans) {
            let (column, cell) = (COLUMNS[place], cell.trim());
            let found = match numbers.get_mut(place) {
                Some(number) => value(column, cell).map(|value| *number = value),
                None if cell.is_empty() => {
                    Err(("the trial has no name".to_owned(), "give each trial a name or a number"))
                }
                None => {
                    name = Some(cell.to_owned());
                    Ok(())
                }
            };
            if let Err((message, help)) = found {
                self.problems.add(span, Some(column.to_owned()), message, Some(help.to_owned()));
                sound = false;
            }
        }
        let [h, v_g, shape, v_g_error, shape_error] = numbers;
        sound.then_some((name, Frame { h, v_g, shape, v_g_error, shape_error }))
    }

    /// Two parameters need three frames.
    fn enough(&mut self, trials: &[Trial], last: Range<usize>) {
        let help = format!("give {FEWEST_FRAMES} frames or more, spread over the passage");
        if trials.is_empty() {
            let message = "no frames follow the header".to_owned();
            self.problems.add(0..self.text.len(), None, message, Some(help.clone()));
        }
        for trial in trials.iter().filter(|trial| trial.frames.len() < FEWEST_FRAMES) {
            let whose = trial.name.as_ref().map_or_else(|| "the file".to_owned(), |name| format!("trial `{name}`"));
            let frames = match trial.frames.len() {
                1 => "one frame".to_owned(),
                n => format!("{n} frames"),
            };
            let message = format!("{whose} has {frames}, too few to fit gamma and b0");
            self.problems.add(last.clone(), None, message, Some(help.clone()));
        }
    }

    /// A line that the CSV reader refused.
    fn ragged(&mut self, error: &csv::Error, columns: usize) {
        let at = error.position().map_or(0, |position| position.byte() as usize);
        let message = match error.kind() {
            csv::ErrorKind::UnequalLengths { len, .. } => format!("{len} cells, where the header has {columns}"),
            _ => error.to_string(),
        };
        let span = self.line_at(at);
        self.problems.add(span, None, message, Some("write one number under each name, parted by commas".to_owned()));
    }

    /// The bytes of a record's first line.
    fn line(&self, record: &csv::StringRecord) -> Range<usize> {
        self.line_at(record.position().map_or(0, |position| position.byte() as usize))
    }

    fn line_at(&self, at: usize) -> Range<usize> {
        // A record may begin before blank lines that the reader skips.
        let rest = &self.text[at.min(self.text.len())..];
        let start = self.text.len() - rest.trim_start_matches(['\r', '\n']).len();
        let length = self.text[start..].find(['\r', '\n']).unwrap_or(self.text.len() - start);
        start..start + length
    }

    /// The bytes of each cell; all those of the line where quotes hide them.
    fn fields(&self, record: &csv::StringRecord) -> Vec<Range<usize>> {
        let line = self.line(record);
        if !self.text[line.clone()].split(',').eq(record) {
            return vec![line; record.len()];
        }
        let mut start = line.start;
        let span = |cell: &str| {
            let span = start..start + cell.len();
            start = span.end + 1;
            span
        };
        record.iter().map(span).collect()
    }
}

/// The number in a cell, if the column allows it; else what is wrong and what to write.
fn value(column: &str, cell: &str) -> Result<f64, (String, &'static str)> {
    if cell.is_empty() {
        return Err(("the cell is empty".to_owned(), "write a number, or take the line out"));
    }
    let number: f64 =
        cell.parse().map_err(|_| (format!("`{cell}` is no number"), "write a number, like -0.35 or 1e-3"))?;
    if !number.is_finite() {
        return Err((format!("`{cell}` is not finite"), "take the line out where nothing was measured"));
    }
    match column {
        "h" if number.abs() > FARTHEST => {
            Err((format!("{cell} is too far away"), "h is in droplet diameters, at most 1000 from the orifice"))
        }
        "shape" if number <= 0.0 => {
            Err((format!("a shape parameter of {cell} is impossible"), "A = perimeter^2/(4 pi a), 1 for a circle"))
        }
        "v_g_error" | "shape_error" if number <= 0.0 => {
            Err((format!("an error of {cell} is impossible"), "write a standard error above 0, or take the column out"))
        }
        _ => Ok(number),
    }
}

fn header_help() -> String {
    let (required, optional) = COLUMNS.split_at(REQUIRED);
    format!("the first line names the columns: {}; and, if you have them, {}", required.join(","), optional.join(","))
}

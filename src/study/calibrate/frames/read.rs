//! Reads the trials in the text of a file of frames, and notes every mistake.

use crate::campaign::file::{Problems, nearest};
use crate::study::calibrate::frames::cells::{cells, line, line_at, number};
use crate::study::calibrate::frames::{COLUMNS, FEWEST_FRAMES, Frame, REQUIRED, Trial};
use csv::StringRecord;
use std::collections::HashSet;
use std::ops::Range;

/// The trials in `text`. Mistakes go to `problems`; if there are any, the trials are of no use.
pub(super) fn trials<'t>(text: &'t str, problems: &mut Problems<'t>) -> Vec<Trial> {
    Reading { text, problems }.trials()
}

struct Reading<'t, 'p> {
    text: &'t str,
    problems: &'p mut Problems<'t>,
}

impl Reading<'_, '_> {
    fn wrong(&mut self, at: Range<usize>, column: Option<&str>, message: impl Into<String>, help: &str) {
        let problem = self.problems.note(&at, message.into()).help(help);
        if let Some(column) = column {
            problem.key(column);
        }
    }

    /// Reads the header, then frame by frame.
    fn trials(&mut self) -> Vec<Trial> {
        let mut trials: Vec<Trial> = Vec::new();
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(self.text.as_bytes());
        let mut records = reader.records();
        let Some(header) = records.next().and_then(Result::ok).and_then(|header| self.header(&header)) else {
            if self.problems.is_empty() {
                self.wrong(0..0, None, "the file is empty", &header_help());
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
            last = line(self.text, &record);
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

    /// Which of [`COLUMNS`] each column is; `None` if the header has a mistake.
    fn header(&mut self, record: &StringRecord) -> Option<Vec<usize>> {
        let (spans, mut seen) = (cells(self.text, record), HashSet::new());
        let mut places = Vec::new();
        let mut wrong = false;
        for (name, span) in record.iter().map(str::trim).zip(spans) {
            let Some(place) = COLUMNS.iter().position(|column| *column == name) else {
                let help = match nearest(name, COLUMNS) {
                    Some(meant) => format!("did you mean `{meant}`? {}", header_help()),
                    None => header_help(),
                };
                self.wrong(span, None, format!("`{name}` is not a column of frames"), &help);
                wrong = true;
                continue;
            };
            if !seen.insert(name) {
                self.wrong(span, Some(name), "the column appears twice", "keep one of them");
                wrong = true;
            }
            places.push(place);
        }
        let missing: Vec<&str> = COLUMNS[..REQUIRED].iter().copied().filter(|column| !seen.contains(column)).collect();
        // A misspelt name is not reported again as a missing column.
        if !wrong && !missing.is_empty() {
            let (line, missing) = (line(self.text, record), missing.join("`, `"));
            self.wrong(line, None, format!("no column is named `{missing}`"), &header_help());
            wrong = true;
        }
        (!wrong).then_some(places)
    }

    /// The frame of a line and the name of its trial; `None` if it has a mistake.
    fn frame(&mut self, header: &[usize], record: &StringRecord) -> Option<(Option<String>, Frame)> {
        let spans = cells(self.text, record);
        let (mut name, mut numbers, mut sound) = (None, [0.0, 0.0, 0.0, 1.0, 1.0], true);
        for ((&place, cell), span) in header.iter().zip(record).zip(spans) {
            let (column, cell) = (COLUMNS[place], cell.trim());
            let found = match numbers.get_mut(place) {
                Some(place) => number(column, cell).map(|value| *place = value),
                None if cell.is_empty() => {
                    Err(("the trial has no name".to_owned(), "give each trial a name or a number"))
                }
                None => {
                    name = Some(cell.to_owned());
                    Ok(())
                }
            };
            if let Err((message, help)) = found {
                self.wrong(span, Some(column), message, help);
                sound = false;
            }
        }
        let [h, v_g, shape, v_g_error, shape_error] = numbers;
        sound.then_some((name, Frame { h, v_g, shape, v_g_error, shape_error }))
    }

    /// Notes trials with too few frames for a fit of two parameters; `last` is the last line.
    fn enough(&mut self, trials: &[Trial], last: Range<usize>) {
        let help = format!("give {FEWEST_FRAMES} frames or more, spread over the passage");
        if trials.is_empty() {
            self.wrong(0..self.text.len(), None, "no frames follow the header", &help);
        }
        for trial in trials.iter().filter(|trial| trial.frames.len() < FEWEST_FRAMES) {
            let whose = trial.name.as_ref().map_or_else(|| "the file".to_owned(), |name| format!("trial `{name}`"));
            let frames = match trial.frames.len() {
                1 => "one frame".to_owned(),
                n => format!("{n} frames"),
            };
            self.wrong(last.clone(), None, format!("{whose} has {frames}, too few to fit gamma and b0"), &help);
        }
    }

    fn ragged(&mut self, error: &csv::Error, columns: usize) {
        let at = error.position().map_or(0, |position| position.byte() as usize);
        let message = match error.kind() {
            csv::ErrorKind::UnequalLengths { len, .. } => format!("{len} cells, where the header has {columns}"),
            _ => error.to_string(),
        };
        self.wrong(line_at(self.text, at), None, message, "write one number under each name, parted by commas");
    }
}

fn header_help() -> String {
    let (required, optional) = COLUMNS.split_at(REQUIRED);
    format!("the first line names the columns: {}; and, if you have them, {}", required.join(","), optional.join(","))
}

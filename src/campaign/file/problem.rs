//! What is wrong with a file that people write: every mistake with its place, and the text a person reads.

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::fmt;
use std::io;
use std::ops::Range;
use std::path::PathBuf;

/// One mistake in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Dotted path of the key, like `grid.gamma`; `None` for a syntax error.
    pub key: Option<String>,
    /// What is wrong.
    pub message: String,
    /// What is allowed, or what to write instead.
    pub help: Option<String>,
    span: Range<usize>,
}

impl fmt::Display for Problem {
    /// One line: `line 7: grid.gamma: what is wrong; what is allowed`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.title())?;
        self.help.iter().try_for_each(|help| write!(f, "; {help}"))
    }
}

impl Problem {
    /// The dotted path of the key that it is about.
    pub(crate) fn key(&mut self, path: impl Into<String>) -> &mut Self {
        self.key = Some(path.into());
        self
    }

    /// What is allowed, or what to write instead.
    pub(crate) fn help(&mut self, help: impl Into<String>) -> &mut Self {
        self.help = Some(help.into());
        self
    }

    fn title(&self) -> String {
        match &self.key {
            Some(key) => format!("{key}: {}", self.message),
            None => self.message.clone(),
        }
    }
}

/// Why a campaign file could not be used.
#[derive(Debug, thiserror::Error)]
pub enum CampaignErrors {
    /// The file could not be read.
    #[error("cannot read the campaign file {}: {source}; check the path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not text.
    #[error("the campaign file {} is not UTF-8 text: line {line} holds other bytes; save it as UTF-8", path.display())]
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

/// A file and all its mistakes, in the order of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Invalid {
    /// Name of the file, as given.
    pub file: String,
    /// Its text.
    pub text: String,
    /// Its mistakes; at least one.
    pub problems: Vec<Problem>,
}

impl CampaignErrors {
    /// The mistakes found inside the file; none when it could not be read at all.
    pub fn problems(&self) -> &[Problem] {
        match self {
            Self::Invalid(invalid) => &invalid.problems,
            Self::Unreadable { .. } | Self::NotUtf8 { .. } => &[],
        }
    }

    /// The whole message with source lines, in colour if asked.
    pub fn render(&self, colour: bool) -> String {
        match self {
            Self::Invalid(invalid) => invalid.render(colour),
            Self::Unreadable { .. } | Self::NotUtf8 { .. } => self.to_string(),
        }
    }
}

impl Invalid {
    /// Compiler-style messages, each under the line it speaks of.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        let messages = self.problems.iter().map(|problem| {
            let place = AnnotationKind::Primary.span(problem.span.clone());
            let source = Snippet::source(&self.text).path(&self.file).annotation(place);
            let mut group = Level::ERROR.primary_title(problem.title()).element(source);
            if let Some(help) = &problem.help {
                group = group.element(Level::HELP.message(help));
            }
            renderer.render(&[group])
        });
        messages.collect::<Vec<_>>().join("\n\n")
    }
}

/// What is wrong, and perhaps what to write instead: a problem that has no place yet.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Mistake {
    pub(crate) message: String,
    pub(crate) help: Option<String>,
}

impl Mistake {
    pub(crate) fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: None }
    }

    pub(crate) fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

impl From<&str> for Mistake {
    fn from(message: &str) -> Self {
        Self::new(message)
    }
}

impl From<String> for Mistake {
    fn from(message: String) -> Self {
        Self::new(message)
    }
}

/// Collects the problems of one text.
pub(crate) struct Problems<'t> {
    text: &'t str,
    list: Vec<Problem>,
}

impl<'t> Problems<'t> {
    pub(crate) fn of(text: &'t str) -> Self {
        Self { text, list: Vec::new() }
    }

    /// Notes a mistake at the bytes `span`; only the first line of a longer span is shown. The key that it is about and
    /// the help may follow:
    ///
    /// ```text
    /// problems.note(&span, "the axis is empty").key("grid.gamma").help("give it a value, or leave the axis out");
    /// ```
    pub(crate) fn note(&mut self, span: &Range<usize>, mistake: impl Into<Mistake>) -> &mut Problem {
        let Mistake { message, help } = mistake.into();
        let start = floor_char_boundary(self.text, span.start);
        let line_end = self.text[start..].find(['\r', '\n']).map_or(self.text.len(), |length| start + length);
        let end = floor_char_boundary(self.text, span.end.clamp(start, line_end)).max(start);
        let line = line_of(self.text.as_bytes(), start);
        let line_start = self.text[..start].rfind('\n').map_or(0, |newline| newline + 1);
        let column = self.text[line_start..start].chars().count() + 1;
        self.list.push_mut(Problem { line, column, key: None, message, help, span: start..end })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The mistakes in file order, each once although several blocks may inherit it.
    pub(crate) fn into_invalid(mut self, file: &str) -> Invalid {
        self.list.sort_by(|a, b| (a.span.start, &a.message).cmp(&(b.span.start, &b.message)));
        self.list.dedup();
        Invalid { file: file.to_owned(), text: self.text.to_owned(), problems: self.list }
    }
}

/// The line that holds byte `at`, from 1.
pub(crate) fn line_of(bytes: &[u8], at: usize) -> usize {
    bytes[..at].iter().filter(|byte| **byte == b'\n').count() + 1
}

fn floor_char_boundary(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|index| text.is_char_boundary(*index)).unwrap_or(0)
}

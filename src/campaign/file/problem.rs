//! What is wrong with a file that people write: every mistake with its place, and the text a person reads.

use crate::parameters::shown;
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// One mistake in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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
    #[error("cannot read the campaign file {}: {source}; {}", shown(path), way_out(path, source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not text.
    #[error("the campaign file {} is not UTF-8 text: line {line} holds other bytes; save it as UTF-8", shown(path))]
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

    /// The message with source lines, in colour if asked; see [`Invalid::render`].
    pub fn render(&self, colour: bool) -> String {
        match self {
            Self::Invalid(invalid) => invalid.render(colour),
            Self::Unreadable { .. } | Self::NotUtf8 { .. } => format!("error: {self}"),
        }
    }
}

impl Invalid {
    /// Compiler-style messages, each under the line it speaks of: of one key the first few, and then how many more
    /// there are.
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        let mut of_key: BTreeMap<Option<&str>, usize> = BTreeMap::new();
        let mut messages: Vec<String> = Vec::new();
        for problem in &self.problems {
            let count = of_key.entry(problem.key.as_deref()).or_default();
            if *count < SHOWN_OF_KEY && messages.len() < SHOWN {
                messages.push(self.message(problem, &renderer));
                *count += 1;
            }
        }
        messages.extend(self.hidden(&of_key));
        messages.join("\n\n")
    }

    fn message(&self, problem: &Problem, renderer: &Renderer) -> String {
        let place = AnnotationKind::Primary.span(problem.span.clone());
        let source = Snippet::source(&self.text).path(&self.file).annotation(place);
        let mut group = Level::ERROR.primary_title(problem.title()).element(source);
        if let Some(help) = &problem.help {
            group = group.element(Level::HELP.message(help));
        }
        renderer.render(&[group])
    }

    /// How many mistakes are not shown, and of which keys they are; `None` if all are shown.
    fn hidden(&self, shown: &BTreeMap<Option<&str>, usize>) -> Option<String> {
        let mut left: BTreeMap<Option<&str>, usize> = BTreeMap::new();
        self.problems.iter().for_each(|problem| *left.entry(problem.key.as_deref()).or_default() += 1);
        left.iter_mut().for_each(|(key, count)| *count -= shown.get(key).copied().unwrap_or_default());
        let total: usize = left.values().sum();
        let keys = left.iter().filter(|(_, count)| **count > 0);
        let mut keys: Vec<String> =
            keys.map(|(key, count)| format!("{} ({count})", key.unwrap_or("the form of the file"))).collect();
        let more = keys.len().saturating_sub(KEYS_NAMED);
        keys.truncate(KEYS_NAMED);
        let others = if more > 0 { format!(" and {more} other keys") } else { String::new() };
        (total > 0).then(|| format!("{total} more mistakes are not shown: {}{others}", keys.join(", ")))
    }
}

/// Most mistakes of one key that are shown, most of all keys, and most keys whose hidden mistakes are counted one by
/// one.
const SHOWN_OF_KEY: usize = 5;
const SHOWN: usize = 40;
const KEYS_NAMED: usize = 5;

/// What to do about a file that cannot be read.
fn way_out(path: &Path, source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "name a file that is there, such as campaigns/quickstart.toml",
        io::ErrorKind::PermissionDenied => "ask its owner for the right to read it, or copy it to where you may",
        io::ErrorKind::IsADirectory if path.join("store.db").exists() => {
            "this is a store: `meniscus status` shows it, and `run` takes the campaign file"
        }
        io::ErrorKind::IsADirectory => "name a file in this folder",
        io::ErrorKind::FileTooLarge => "a campaign file is a short text: split it, or name another file",
        _ => "check the path and its permissions",
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

/// Most mistakes that are kept of a file: a file of the largest size may hold millions, which would fill the memory.
const MOST: usize = 200_000;

/// As many mistakes as this are told with what was probably meant, which takes time to find out.
const EXPLAINED: usize = 2000;

/// Collects the problems of one text, as many as [`MOST`].
pub(crate) struct Problems<'t> {
    text: &'t str,
    list: Vec<Problem>,
    /// What is noted beyond them; nobody reads it.
    spare: Problem,
}

impl<'t> Problems<'t> {
    pub(crate) fn of(text: &'t str) -> Self {
        Self { text, list: Vec::new(), spare: Problem::default() }
    }

    /// Notes a mistake at the bytes `span`; only the first line of a longer span is shown. The key that it is about and
    /// the help may follow:
    ///
    /// ```text
    /// problems.note(&span, "the axis is empty").key("grid.gamma").help("give it a value, or leave the axis out");
    /// ```
    pub(crate) fn note(&mut self, span: &Range<usize>, mistake: impl Into<Mistake>) -> &mut Problem {
        if self.list.len() >= MOST {
            return &mut self.spare;
        }
        let Mistake { message, help } = mistake.into();
        let start = floor_char_boundary(self.text, span.start);
        let end = floor_char_boundary(self.text, span.end.max(start)).max(start);
        let end = self.text[start..end].find(['\r', '\n']).map_or(end, |length| start + length);
        // `into_invalid` finds the lines and columns of all problems in one walk.
        self.list.push_mut(Problem { line: 0, column: 0, key: None, message, help, span: start..end })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether there are so many mistakes that nobody reads what was probably meant by the next.
    pub(crate) fn are_many(&self) -> bool {
        self.list.len() >= EXPLAINED
    }

    /// The mistakes in file order, each once although several blocks may inherit it.
    pub(crate) fn into_invalid(mut self, file: &str) -> Invalid {
        self.list.sort_by(|a, b| (a.span.start, &a.message).cmp(&(b.span.start, &b.message)));
        self.list.dedup();
        self.place();
        Invalid { file: file.to_owned(), text: self.text.to_owned(), problems: self.list }
    }
}

impl Problems<'_> {
    /// Sets line and column of all problems, which stand in the order of the file.
    fn place(&mut self) {
        let (mut at, mut line, mut column) = (0, 1, 1);
        for problem in &mut self.list {
            for letter in self.text[at..problem.span.start].chars() {
                (line, column) = if letter == '\n' { (line + 1, 1) } else { (line, column + 1) };
            }
            at = problem.span.start;
            (problem.line, problem.column) = (line, column);
        }
    }
}

/// The line that holds byte `at`, from 1.
pub(crate) fn line_of(bytes: &[u8], at: usize) -> usize {
    bytes[..at].iter().filter(|byte| **byte == b'\n').count() + 1
}

fn floor_char_boundary(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|index| text.is_char_boundary(*index)).unwrap_or(0)
}

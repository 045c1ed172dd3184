//! A campaign file, from TOML to grid points and seeds.
//!
//! The text is walked once (`read`) against the table of `keys`. Its sections are then combined (`resolve`) into
//! blocks, and the axes of each block multiplied (`product`) into [`Point`]s. All mistakes of a file are reported
//! together, each with its place and what to write instead. `schema` says the same of the keys in the words of a JSON
//! Schema, for editors.
//!
//! ```
//! let text = r#"
//!     name = "sketch"
//!     model = "SP"
//!     scene = "obstacles"
//!     sigma_ob = 0.3
//!     density = "saturated"
//!     runs_per_point = 5
//!     [grid]
//!     e_w = { from = 0.1, to = 10.0, points = 3, scale = "log" }
//!     w_ob = [1.0, 1.2]
//! "#;
//! let campaign = meniscus::campaign::file::Campaign::parse("sketch.toml", text).unwrap();
//! assert_eq!((campaign.blocks[0].points.len(), campaign.n_jobs()), (6, 30));
//! ```

pub(crate) mod axis;
mod draft;
mod grid;
pub(crate) mod keys;
mod problem;
mod product;
mod read;
mod resolve;
mod scalar;
pub(crate) mod schema;
mod section;
mod spelling;

pub use problem::{CampaignErrors, Invalid, Problem};
pub(crate) use problem::{Problems, line_of};
pub(crate) use spelling::nearest;

use crate::parameters::{IntegratorChoice, Point, PointId, shown};
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;
use toml::de::DeTable;

/// A valid campaign.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Its name, fit for a folder.
    pub name: String,
    /// What it shows, in prose; may be empty.
    pub about: String,
    /// The displacement from which on its tables of decay lengths count, in sigma.
    pub fit_from: f64,
    /// The text of its file.
    pub text: String,
    /// Its blocks, in file order; one of the campaign's name if the file has no `[[block]]`.
    pub blocks: Vec<Block>,
}

/// Grid points of one model, all run with the same seeds.
#[derive(Clone, Debug)]
pub struct Block {
    /// Its name.
    pub name: String,
    /// The product of its axes, in file order, the last axis running fastest.
    pub points: Vec<Arc<Point>>,
    /// The identity of each point.
    pub point_ids: Vec<PointId>,
    /// The seeds each point is run with.
    pub seeds: Range<u64>,
    /// The integrator that was asked for; each point has a definite one.
    pub integrator: IntegratorChoice,
    /// The keys that the file leaves to the campaign.
    pub open: Vec<&'static str>,
    /// When seeds are added, and when no more; the range above is then that of the first round.
    pub until: Option<Until>,
    /// The tolerance that chose vertices and stepping of each point, if one was asked for.
    pub tolerance: Option<f64>,
}

/// Seeds are added in rounds until an interval is narrow enough ([`crate::execute`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Until {
    /// What the interval is of.
    pub estimate: Estimate,
    /// Half of the 95% interval over the estimate.
    pub relative_error: f64,
    /// Most seeds of a point.
    pub max_runs: u64,
    /// The displacement from which on runs count in decay lengths, in sigma.
    pub from: f64,
}

/// What a point is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimate {
    /// The decay length.
    Lambda,
    /// The mean speed.
    Speed,
}

/// Largest campaign file, in bytes.
const LARGEST_FILE: u64 = 4 << 20;

/// All bytes of a file that somebody names, if they are not more than `most`.
///
/// # Errors
/// What the system reports; [`ErrorKind::FileTooLarge`].
pub(crate) fn read_input(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(Error::new(ErrorKind::FileTooLarge, format!("it has more than {} MB", most >> 20))),
        false => Ok(bytes),
    }
}

impl Campaign {
    /// Reads a campaign file.
    ///
    /// # Errors
    /// If the file cannot be read, is not UTF-8, or has mistakes: then all of them.
    pub fn load(path: &Path) -> Result<Self, CampaignErrors> {
        let bytes = read_input(path, LARGEST_FILE)
            .map_err(|source| CampaignErrors::Unreadable { path: path.to_owned(), source })?;
        let text = std::str::from_utf8(&bytes).map_err(|error| CampaignErrors::NotUtf8 {
            path: path.to_owned(),
            line: line_of(&bytes, error.valid_up_to()),
        })?;
        Self::parse(&shown(path), text)
    }

    /// What a text in a store may mean: as this program reads it, and, where it says nothing of dynamics, as programs did
    /// for which a DP was the ring of [C24] eqs 5 to 7. Empty if it cannot be read.
    pub(crate) fn readings(text: &str) -> Vec<Self> {
        let earlier = (!text.contains("dynamics")).then(|| format!("dynamics = \"vertex\"\n{text}"));
        [Some(text.to_owned()), earlier]
            .into_iter()
            .flatten()
            .filter_map(|text| Self::read("", &text, false).ok())
            .collect()
    }

    /// Reads the text of a campaign file; `file_name` appears in the errors.
    ///
    /// # Errors
    /// All mistakes of the file, in its order; syntax errors hide those that come after parsing.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, CampaignErrors> {
        Self::read(file_name, text, true)
    }

    /// Reads a text. Where it `is_new`, what older programs took and no physics allows is a mistake too.
    fn read(file_name: &str, text: &str, is_new: bool) -> Result<Self, CampaignErrors> {
        let mut problems = Problems::of(text);
        let (root, syntax_errors) = DeTable::parse_recoverable(text);
        for error in syntax_errors {
            let span = error.span().unwrap_or(0..0);
            let message = format!("not valid TOML: {}", error.message());
            problems.note(&span, message).help("see https://toml.io for the form of such files");
        }
        if !problems.is_empty() {
            return Err(CampaignErrors::Invalid(Box::new(problems.into_invalid(file_name))));
        }
        let (top, own) = read::file(root.get_ref(), &mut problems);
        let blocks = resolve::blocks(&top, own.as_deref(), &mut problems);
        if is_new {
            resolve::refuse_outdated(&top, own.as_deref(), &mut problems);
        }
        match top.text("name") {
            Some(name) if problems.is_empty() => Ok(Self {
                name: name.to_owned(),
                about: top.text("about").unwrap_or_default().trim().to_owned(),
                fit_from: top.number("fit_from").unwrap_or_default(),
                text: text.to_owned(),
                blocks,
            }),
            _ => Err(CampaignErrors::Invalid(Box::new(problems.into_invalid(file_name)))),
        }
    }

    /// Number of jobs; one that two blocks name counts twice.
    pub fn n_jobs(&self) -> u64 {
        self.blocks.iter().map(Block::n_jobs).sum()
    }
}

impl Block {
    /// Number of jobs, points times seeds.
    pub fn n_jobs(&self) -> u64 {
        self.points.len() as u64 * (self.seeds.end - self.seeds.start)
    }
}

//! `meniscus render DIR JOB_ID`: a droplet among its obstacles as a picture.

use crate::campaign::checks;
use crate::cli::talk::{print, print_data, say, typed, write_file};
use crate::cli::{CommandResult, Exit, PNG_ZOOM, whole_store};
use crate::parameters::{JobId, JobState, plain, shown};
use crate::report::animation::gif;
use crate::report::caption::Caption;
use crate::report::droplet::Picture;
use crate::report::raster::png;
use crate::report::surroundings::Surroundings;
use crate::report::view::View;
use crate::store::{self, JobStory, StoredJob};
use clap::ValueEnum;
use clap::builder::{PathBufValueParser, TypedValueParser};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Fewest digits of an id that are looked up.
const FEWEST_DIGITS: usize = 4;

/// Enlargement of a GIF.
const GIF_ZOOM: f32 = 0.75;

/// Arguments of `render`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The store
    #[arg(value_parser = PathBufValueParser::new().map(|path| whole_store(&path)))]
    store: PathBuf,
    /// The job, or the first digits of its id; without it, a few jobs to choose from are listed
    job: Option<String>,
    /// The file: .svg, .png or .gif; `-` writes SVG to stdout [default: JOB_ID.svg in this folder]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Kind of picture [default: by the file's name]
    #[arg(long, value_name = "FORMAT", ignore_case = true)]
    format: Option<Kind>,
    /// Show the whole path, not the droplet's neighbourhood
    #[arg(long)]
    path: bool,
}

/// Kinds of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    Svg,
    Png,
    Gif,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let Some(prefix) = &self.job else { return self.list(quiet) };
        let id = find(&self.store, prefix)?;
        let file = self.output.clone().unwrap_or_else(|| {
            let kind = self.format.unwrap_or(Kind::Svg);
            PathBuf::from(format!("{id}.{}", format!("{kind:?}").to_lowercase()))
        });
        let bytes = self.draw(id, kind_of(self.format, &file)?)?;
        if file.as_os_str() == "-" {
            print_data(&bytes)?;
            return Ok(Exit::Done);
        }
        write_file(&file, &bytes)?;
        if !quiet {
            say(format!("wrote {}", typed(&file)));
        }
        Ok(Exit::Done)
    }

    /// Lists jobs to choose from.
    fn list(&self, quiet: bool) -> CommandResult {
        let mut table = Vec::new();
        store::example_jobs(&self.store, &mut table)?;
        print(String::from_utf8_lossy(&table))?;
        if !quiet {
            say(format!("name one: meniscus render {} JOB_ID -o droplet.png", typed(&self.store)));
        }
        Ok(Exit::Done)
    }

    /// The picture of a job.
    fn draw(&self, id: JobId, kind: Kind) -> Result<Vec<u8>, Box<dyn Error>> {
        let job = store::job(&self.store, id)?.ok_or_else(|| no_such(&self.store, &id.to_string()))?;
        let story = ended(&self.store, id, &job)?;
        let outlines = store::outlines(&self.store, id)?;
        let Some(last) = outlines.last() else {
            let reason = story.error.unwrap_or_else(|| "it was computed by a version that kept none".to_owned());
            return Err(format!("job {id} has no outline to draw: {}", plain(&reason)).into());
        };
        if kind == Kind::Gif && outlines.len() < 2 {
            return Err(format!(
                "job {id} has one outline, and an animation needs more: set `shapes_every = 10.0` (in t0) in \
                 the campaign and run it again; one picture: meniscus render {} {id} -o {id}.png",
                typed(&self.store)
            )
            .into());
        }
        let path = store::job_path(&self.store, id)?;
        checks::validate(&job.point).map_err(|problem| format!("job {id} cannot be drawn: {}", plain(&problem)))?;
        let surroundings = Surroundings::of(&job.point, job.seed)?;
        let caption = Caption { job: id, point: &job.point, seed: job.seed, story: &story, at_end: true };
        let picture = Picture { surroundings: &surroundings, path: &path, caption };
        let view = if self.path { View::whole(&path, &outlines) } else { View::around(last) };
        if !surroundings.can_fill(&view) {
            return Err(format!("the path of job {id} is too long to be drawn: leave out --path").into());
        }
        Ok(match kind {
            Kind::Svg => picture.svg(last, &view).into_bytes(),
            Kind::Png => png(&picture.svg(last, &view), PNG_ZOOM)?,
            Kind::Gif => {
                let views = if self.path { vec![view; outlines.len()] } else { View::following(&outlines) };
                gif(outlines.len(), GIF_ZOOM, |k| {
                    let caption = Caption { at_end: k + 1 == outlines.len(), ..caption };
                    Picture { caption, ..picture }.svg(&outlines[k], &views[k])
                })?
            }
        })
    }
}

/// The job whose id begins with `prefix`.
fn find(dir: &Path, prefix: &str) -> Result<JobId, Box<dyn Error>> {
    if prefix.len() < FEWEST_DIGITS {
        return Err(format!("`{prefix}` is too short: give {FEWEST_DIGITS} digits of the job_id or more").into());
    }
    match store::find_jobs(dir, prefix, 4)?.as_slice() {
        [only] => Ok(*only),
        [] => Err(no_such(dir, prefix).into()),
        several => {
            let ids: Vec<String> = several.iter().map(JobId::to_string).collect();
            Err(format!("several jobs begin with `{prefix}`, give more digits: {}", ids.join(", ")).into())
        }
    }
}

fn no_such(dir: &Path, id: &str) -> String {
    format!("no job `{id}` in {}: list some with `meniscus render {}`", typed(dir), typed(dir))
}

/// The story of a job that has ended.
fn ended(dir: &Path, id: JobId, job: &StoredJob) -> Result<JobStory, Box<dyn Error>> {
    match (job.state, store::job_story(dir, id)?) {
        (JobState::Done | JobState::Failed, Some(story)) => Ok(story),
        (state, _) => {
            let state = state.name();
            Err(format!("job {id} is {state} and has no picture yet: `meniscus run CAMPAIGN.toml` computes it").into())
        }
    }
}

/// What to draw: as asked, or as the file's name says.
fn kind_of(asked: Option<Kind>, file: &Path) -> Result<Kind, String> {
    if let Some(kind) = asked {
        return Ok(kind);
    }
    match file.extension().map(|extension| extension.to_string_lossy()) {
        None if file.as_os_str() == "-" => Ok(Kind::Svg),
        Some(extension) => Kind::from_str(&extension, true)
            .map_err(|_| format!("`{extension}` is not a kind of picture: choose svg, png or gif")),
        None => Err(format!("{}: name it .svg, .png or .gif, or give --format", shown(file))),
    }
}

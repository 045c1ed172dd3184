//! `meniscus calibrate FRAMES.csv ...`: line tension and near-wall drag of a droplet, from an experiment's frames.

use super::{Exit, Outcome, print};
use meniscus::calibrate::frames::{self, FramesError, Trial};
use meniscus::calibrate::search::Ranges;
use meniscus::calibrate::{Calibration, calibrate, profile::Profile};
use meniscus::campaign::keys::{Id, KEYS};
use meniscus::job::{Channel, Deformable, Integrator, Limits, Model, Point, Scene, Stepping};
use meniscus::report::{calibration, profile_plot, raster};
use std::collections::HashSet;
use std::error::Error;
use std::io::Write;
use std::ops::RangeInclusive;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Enlargement of the PNG.
const ZOOM: f32 = 2.0;

/// Time between two lines of progress.
const PAUSE: Duration = Duration::from_secs(10);

const EXAMPLE: &str = "\
Frames are CSV with a header: h (centroid, in sigma, 0 at the orifice), v_g (in V_t), shape (perimeter^2/(4 pi a));
optional: v_g_error, shape_error (standard errors, which then weigh the frames), trial (several passages in one file).

Example, a droplet filmed twice on its way through an orifice of 0.7 diameters:

  meniscus calibrate monday.csv tuesday.csv --w 0.7 --v-t 0.032

Beside each file FRAMES.csv it writes FRAMES.fit.csv (the simulated speed and shape at each frame) and the plots FRAMES.fit.svg
and .png. At 256 vertices it takes some minutes; --n-vertices 128 is four times as fast, and less true where a droplet barely passes.";

/// Arguments of `calibrate`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLE, allow_negative_numbers = true)]
pub struct Arguments {
    /// The frames, a file for each trial
    #[arg(required = true, value_name = "FRAMES.csv")]
    frames: Vec<PathBuf>,
    /// Width of the orifice, in droplet diameters
    #[arg(long)]
    w: f64,
    /// Terminal speed of the free droplet, in sqrt(g sigma)
    #[arg(long)]
    v_t: f64,
    /// Rise of the wedges from the axis, in degrees
    #[arg(long, default_value_t = 45.0)]
    angle: f64,
    /// Radius of the rounded tips, in droplet diameters
    #[arg(long, default_value_t = 0.0)]
    tip_radius: f64,
    /// Where gamma is looked for
    #[arg(long, value_name = "FROM..TO", default_value = "0.1..5", value_parser = parse_range)]
    gamma: RangeInclusive<f64>,
    /// Where b0/b_inf is looked for
    #[arg(long, value_name = "FROM..TO", default_value = "0..0.3", value_parser = parse_range)]
    b0: RangeInclusive<f64>,
    /// Exponent of the near-wall drag
    #[arg(long, default_value_t = 4.0 / 3.0)]
    alpha: f64,
    /// Vertices of the ring
    #[arg(long, default_value_t = 256.0)]
    n_vertices: f64,
    /// Perimeter stiffness over line tension
    #[arg(long, default_value_t = 1e-3)]
    kappa: f64,
    /// Area stiffness
    #[arg(long, default_value_t = 1e4)]
    k_a: f64,
    /// Wall stiffness of the whole ring
    #[arg(long, default_value_t = 1e6)]
    e_w: f64,
    /// Vertex diameter: a droplet touches a wall at half of it, where the near-wall drag ends to grow
    #[arg(long, default_value_t = std::f64::consts::PI / 256.0)]
    delta: f64,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

/// The frames of one file and the files made from it.
struct Sheet {
    path: PathBuf,
    trials: Vec<Trial>,
    csv: PathBuf,
    svg: PathBuf,
    png: PathBuf,
}

/// All files of frames that could not be read.
#[derive(Debug)]
pub struct BadFrames(Vec<FramesError>);

impl BadFrames {
    /// The whole message, in colour if asked.
    pub fn render(&self, colour: bool) -> String {
        self.0.iter().map(|error| error.render(colour)).collect::<Vec<_>>().join("\n\n")
    }
}

impl std::fmt::Display for BadFrames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl Error for BadFrames {}

impl Arguments {
    /// Runs the subcommand.
    pub fn run(&self, quiet: bool) -> Outcome {
        self.check()?;
        let sheets = self.sheets()?;
        let trials: Vec<Trial> = sheets.iter().flat_map(|sheet| sheet.trials.iter().cloned()).collect();
        let (begin, last_line) = (Instant::now(), std::sync::Mutex::new(Instant::now()));
        let watch = |simulations: usize| {
            let mut last_line = last_line.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            if !quiet && last_line.elapsed() >= PAUSE {
                *last_line = Instant::now();
                eprintln!("{simulations} simulations in {}", super::progress::human(begin.elapsed()));
            }
        };
        let ranges = Ranges { gamma: self.gamma.clone(), b0: self.b0.clone() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(super::run::threads(self.threads)).build()?;
        if !quiet {
            eprintln!(
                "fitting {} of {} frames; simulations follow the frames",
                count(trials.len(), "trial"),
                frames_in(&trials)
            );
        }
        let found = pool.install(|| calibrate(&trials, &self.point(), &ranges, &watch))?;
        let names = names(&sheets);
        let weighed = trials.iter().flat_map(|trial| &trial.frames).any(|frame| frame.v_g_error != 1.0);
        let counted: Vec<_> = names.iter().cloned().zip(trials.iter().map(|trial| trial.frames.len())).collect();
        print(&calibration::table(&found, &counted, weighed))?;
        let mut fits = found.fits.iter().zip(&names);
        for sheet in &sheets {
            let own: Vec<_> = fits.by_ref().take(sheet.trials.len()).collect();
            sheet.write(&own)?;
            if !quiet {
                eprintln!("wrote {}, {} and .png", sheet.csv.display(), sheet.svg.display());
            }
        }
        if !quiet {
            self.remark(&found, begin.elapsed());
        }
        Ok(Exit::Done)
    }

    /// Refuses what a campaign file would refuse, in the same words.
    fn check(&self) -> Result<(), Box<dyn Error>> {
        let ranges = [("gamma", Id::Gamma, &self.gamma), ("b0", Id::B0, &self.b0)];
        let ends =
            ranges.iter().flat_map(|(name, id, range)| [(*name, *id, *range.start()), (*name, *id, *range.end())]);
        let values = [
            ("w", Id::W, self.w),
            ("v-t", Id::VT, self.v_t),
            ("angle", Id::Angle, self.angle),
            ("tip-radius", Id::TipRadius, self.tip_radius),
            ("alpha", Id::Alpha, self.alpha),
            ("n-vertices", Id::NVertices, self.n_vertices),
            ("kappa", Id::Kappa, self.kappa),
            ("k-a", Id::KA, self.k_a),
            ("e-w", Id::EW, self.e_w),
            ("delta", Id::Delta, self.delta),
        ];
        let mut wrong = Vec::new();
        for (name, id, value) in values.into_iter().chain(ends) {
            let key = KEYS.iter().find(|key| key.id == id).filter(|key| key.kind.accept(value).is_none());
            wrong.extend(
                key.map(|key| format!("--{name} is {value}, but the {} must be {}", key.doc, key.kind.allowed())),
            );
        }
        for (name, _, range) in ranges.iter().filter(|(_, _, range)| !(range.start() < range.end())) {
            wrong.push(format!(
                "--{name} goes from {} to {}; write the smaller end first, like 0.1..5",
                range.start(),
                range.end()
            ));
        }
        if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\nerror: ").into()) }
    }

    /// Reads all files, and finds out whether their fits can be written before anything is computed.
    fn sheets(&self) -> Result<Vec<Sheet>, Box<dyn Error>> {
        let (mut sheets, mut errors, mut seen) = (Vec::new(), Vec::new(), HashSet::new());
        for path in &self.frames {
            match frames::load(path) {
                Ok(trials) => {
                    let [csv, svg, png] = ["fit.csv", "fit.svg", "fit.png"].map(|kind| path.with_extension(kind));
                    sheets.push(Sheet { path: path.clone(), trials, csv, svg, png });
                }
                Err(error) => errors.push(error),
            }
        }
        if !errors.is_empty() {
            return Err(BadFrames(errors).into());
        }
        for sheet in &sheets {
            if !seen.insert(&sheet.csv) {
                let (path, csv) = (sheet.path.display(), sheet.csv.display());
                return Err(format!(
                    "{path}: another file of frames has its fit in {csv}, too; name each once, and differently"
                )
                .into());
            }
            let folder = folder(&sheet.path);
            tempfile::tempfile_in(folder).map_err(|error| {
                format!(
                    "{}: no fit can be written here: {error}; copy the frames to a folder of yours",
                    folder.display()
                )
            })?;
        }
        Ok(sheets)
    }

    /// The channel and the droplet, gamma and b0 apart.
    fn point(&self) -> Point {
        Point {
            model: Model::Deformable(Deformable {
                kappa: self.kappa,
                k_a: self.k_a,
                n_vertices: self.n_vertices as usize,
                e_w: self.e_w,
                delta: self.delta,
                ..Deformable::of_tension(*self.gamma.start())
            }),
            scene: Scene::Channel(Channel {
                w: self.w,
                angle: self.angle,
                tip_radius: self.tip_radius,
                h_start: -1.0,
                h_end: 1.0,
            }),
            v_t: self.v_t,
            b0: 0.0,
            alpha: Some(self.alpha),
            stepping: Stepping { integrator: Integrator::Verlet, dt: 1e-3 },
            limits: Limits { t_max: 1.0, distance: None, ek_threshold: 1e-10 },
            sample_every: 1.0,
            shapes_every: None,
        }
    }

    /// What a reader should know besides the table.
    fn remark(&self, found: &Calibration, elapsed: Duration) {
        let [simulations, failed] = found.simulations;
        let failures = if failed > 0 { format!(", {failed} of them failed and were left out") } else { String::new() };
        eprintln!("{simulations} simulations in {}{failures}", super::progress::human(elapsed));
        for name in &found.at_the_end {
            eprintln!("warning: {name}* lies at an end of its range; widen --{name} and fit again");
        }
        if found.fits.iter().any(|fit| fit.deviation.missed > 0.0) {
            eprintln!(
                "warning: the best droplet stays stuck before the last frame; check --w and --v-t, or raise --n-vertices"
            );
        }
    }
}

impl Sheet {
    /// Writes the fits of its trials, each file whole or not at all.
    fn write(&self, fits: &[(&meniscus::calibrate::TrialFit, &String)]) -> Result<(), Box<dyn Error>> {
        let mut out = csv::Writer::from_writer(Vec::new());
        let has_names = self.trials.iter().any(|trial| trial.name.is_some());
        let header = ["h", "v_g", "shape", "v_g_exp", "shape_exp", "trial"];
        out.write_record(&header[..header.len() - usize::from(!has_names)])?;
        for (trial, (fit, _)) in self.trials.iter().zip(fits) {
            for frame in &trial.frames {
                let [v_g, shape] =
                    fit.profile.at(frame.h).map_or([String::new(), String::new()], |pair| pair.map(|x| x.to_string()));
                let cells = [frame.h.to_string(), v_g, shape, frame.v_g.to_string(), frame.shape.to_string()];
                out.write_record(cells.iter().chain(&trial.name))?;
            }
        }
        write_whole(&self.csv, &out.into_inner()?)?;
        let series: Vec<_> =
            self.trials.iter().zip(fits).map(|(trial, (fit, name))| series(trial, fit, name)).collect();
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let title = format!("{name}: frames (points) and simulation (lines)");
        let picture = profile_plot::svg(&title, &series);
        write_whole(&self.svg, picture.as_bytes())?;
        write_whole(&self.png, &raster::png(&picture, ZOOM)?)
    }
}

fn series(trial: &Trial, fit: &meniscus::calibrate::TrialFit, name: &str) -> profile_plot::Series {
    let Profile { h, v_g, shape } = fit.profile.as_ref();
    profile_plot::Series {
        name: format!(
            "{name}: gamma* = {:.4}, b0* = {:.4}, Delta_v = {:.4}, Delta_A = {:.4}",
            fit.parameters.gamma, fit.parameters.b0, fit.deviation.v_g, fit.deviation.shape
        ),
        frames: trial.frames.iter().map(|frame| [frame.h, frame.v_g, frame.shape]).collect(),
        curve: (0..h.len()).map(|k| [h[k], v_g[k], shape[k]]).collect(),
    }
}

/// A file that is there whole or not at all.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let wrong =
        |error: std::io::Error| format!("{}: {error}; free some space or choose another folder", path.display());
    // As any new file, not for its owner's eyes only.
    let permissions = std::fs::Permissions::from_mode(0o666);
    let mut file = tempfile::Builder::new().permissions(permissions).tempfile_in(folder(path)).map_err(wrong)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(wrong)?;
    file.persist(path).map_err(|error| wrong(error.error))?;
    Ok(())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Names of all trials: of their file, of their column, or both where both are needed.
fn names(sheets: &[Sheet]) -> Vec<String> {
    let stem = |sheet: &Sheet| sheet.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = |sheet: &Sheet, trial: &Trial| match &trial.name {
        Some(name) if sheets.len() > 1 => format!("{}: {name}", stem(sheet)),
        Some(name) => name.clone(),
        None => stem(sheet),
    };
    sheets.iter().flat_map(|sheet| sheet.trials.iter().map(move |trial| name(sheet, trial))).collect()
}

fn frames_in(trials: &[Trial]) -> usize {
    trials.iter().map(|trial| trial.frames.len()).sum()
}

fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("one {what}") } else { format!("{n} {what}s") }
}

/// `0.1..5`.
fn parse_range(text: &str) -> Result<RangeInclusive<f64>, String> {
    let wrong = || format!("`{text}` is no range: write two numbers, like 0.1..5");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
    Ok(number(from)?..=number(to)?)
}

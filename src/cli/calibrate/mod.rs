//! `meniscus calibrate FRAMES.csv ...`: line tension and near-wall drag of a droplet, from an experiment's frames.

mod sheet;

use crate::campaign::choose::tolerance::DEFAULT_VERTICES;
use crate::campaign::durations::written;
use crate::cli::talk::{print, say, typed};
use crate::cli::{CommandResult, Exit};
use crate::parameters::{Channel, Deformable, Model, PAPER_KAPPA, Point, Scene, list};
use crate::report::calibration;
use crate::study::calibrate::frames::Trial;
use crate::study::calibrate::search::Ranges;
use crate::study::calibrate::{Calibration, calibrate};
use std::error::Error;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Time between two lines of progress.
const PAUSE: Duration = Duration::from_secs(10);

const EXAMPLE: &str = "\
Frames are CSV with a header: h (centroid, in sigma, 0 at the orifice), v_g (in V_t), shape (perimeter^2/(4 pi a));
optional: v_g_error, shape_error (standard errors, which then weigh the frames), trial (several passages in one file).

Example, a droplet filmed twice on its way through an orifice of 0.7 diameters:

  meniscus calibrate monday.csv tuesday.csv --w 0.7 --v-t 0.032

Beside each file FRAMES.csv it writes FRAMES.fit.csv (the simulated speed and shape at each frame) and the plots
FRAMES.fit.svg and .png. Give v_g_error if you can: slow frames, where the droplet squeezes through, then count as they
should. At 256 vertices a fit takes ten minutes or so on two cores; fewer --n-vertices are faster, but may stay stuck
where a droplet barely passes.";

/// Arguments of `calibrate`.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLE, allow_negative_numbers = true)]
pub(super) struct Arguments {
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
    #[arg(long, default_value_t = default_of("angle"))]
    angle: f64,
    /// Radius of the rounded tips, in droplet diameters
    #[arg(long, default_value_t = default_of("tip_radius"))]
    tip_radius: f64,
    /// Where gamma is looked for
    #[arg(long, value_name = "FROM..TO", default_value = "0.1..5", value_parser = parse_range)]
    gamma: RangeInclusive<f64>,
    /// Where b0/b_inf is looked for
    #[arg(long, value_name = "FROM..TO", default_value = "0..0.3", value_parser = parse_range)]
    b0: RangeInclusive<f64>,
    /// Exponent of the near-wall drag
    #[arg(long, default_value_t = default_of("alpha"))]
    alpha: f64,
    /// Vertices of the ring
    #[arg(long, default_value_t = DEFAULT_VERTICES as f64)]
    n_vertices: f64,
    /// Perimeter stiffness over line tension
    #[arg(long, default_value_t = PAPER_KAPPA)]
    kappa: f64,
    /// Area stiffness
    #[arg(long, default_value_t = default_of("k_a"))]
    k_a: f64,
    /// Wall stiffness of the whole ring
    #[arg(long, default_value_t = 1e6)]
    e_w: f64,
    /// Vertex diameter: a droplet touches a wall at half of it, where the near-wall drag ends to grow
    #[arg(long, default_value_t = default_of("delta"))]
    delta: f64,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        self.check()?;
        let sheets = sheet::read(&self.frames)?;
        let trials: Vec<Trial> = sheets.iter().flat_map(|sheet| sheet.trials.iter().cloned()).collect();
        let (begin, last_line) = (Instant::now(), std::sync::Mutex::new(Instant::now()));
        let watch = |simulations: usize| {
            let mut last_line = last_line.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            if !quiet && last_line.elapsed() >= PAUSE {
                *last_line = Instant::now();
                say(format!("{simulations} simulations in {}", written(begin.elapsed())));
            }
        };
        let ranges = Ranges { gamma: self.gamma.clone(), b0: self.b0.clone() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads.map_or(0, usize::from)).build();
        let pool = pool.map_err(|error| format!("cannot start the threads: {error}; ask for fewer with --threads"))?;
        if !quiet {
            say(format!("fitting {} of {} frames", count(trials.len(), "trial"), frames_in(&trials)));
        }
        let found = pool.install(|| calibrate(&trials, &self.point(), &ranges, &watch))?;
        let names = sheet::names(&sheets);
        let weighed = trials.iter().flat_map(|trial| &trial.frames).any(|frame| frame.v_g_error != 1.0);
        let counted: Vec<_> = names.iter().cloned().zip(trials.iter().map(|trial| trial.frames.len())).collect();
        print(calibration::table(&found, &counted, weighed))?;
        let mut fits = found.fits.iter().zip(&names);
        for sheet in &sheets {
            let own: Vec<_> = fits.by_ref().take(sheet.trials.len()).collect();
            sheet.write(&own)?;
            if !quiet {
                say(format!("wrote {}, {} and .png", typed(&sheet.csv), typed(&sheet.svg)));
            }
        }
        if !quiet {
            self.remark(&found, begin.elapsed());
        }
        Ok(Exit::Done)
    }

    /// Refuses what a campaign file would refuse, in the same words.
    fn check(&self) -> Result<(), Box<dyn Error>> {
        let ranges = [("gamma", &self.gamma), ("b0", &self.b0)];
        let ends = ranges.iter().flat_map(|(name, range)| [(*name, *range.start()), (*name, *range.end())]);
        let values = [
            ("w", self.w),
            ("v_t", self.v_t),
            ("angle", self.angle),
            ("tip_radius", self.tip_radius),
            ("alpha", self.alpha),
            ("n_vertices", self.n_vertices),
            ("kappa", self.kappa),
            ("k_a", self.k_a),
            ("e_w", self.e_w),
            ("delta", self.delta),
        ];
        let mut wrong = Vec::new();
        for (name, value) in values.into_iter().chain(ends) {
            let key = list::rows(name).next().filter(|key| key.domain.number(value).is_none());
            let option = name.replace('_', "-");
            wrong.extend(
                key.map(|key| format!("--{option} is {value}, but the {} must be {}", key.about, key.domain.allowed())),
            );
        }
        for (name, range) in ranges.iter().filter(|(_, range)| !(range.start() < range.end())) {
            wrong.push(format!(
                "--{name} goes from {} to {}; write the smaller end first, like 0.1..5",
                range.start(),
                range.end()
            ));
        }
        if wrong.is_empty() { Ok(()) } else { Err(wrong.join("\nerror: ").into()) }
    }

    /// The channel and the droplet, gamma and b0 apart.
    fn point(&self) -> Point {
        let ring = Deformable {
            kappa: self.kappa,
            k_a: self.k_a,
            n_vertices: self.n_vertices as usize,
            e_w: self.e_w,
            delta: self.delta,
            ..Deformable::of_tension(*self.gamma.start())
        };
        let Self { w, angle, tip_radius, .. } = *self;
        let channel = Channel { w, angle, tip_radius, h_start: -1.0, h_end: 1.0 };
        let point = Point::new(Model::Deformable(ring), Scene::Channel(channel));
        Point { v_t: self.v_t, alpha: Some(self.alpha), ..point }
    }

    /// What a reader should know besides the table.
    fn remark(&self, found: &Calibration, elapsed: Duration) {
        let [simulations, failed] = found.simulations;
        let failures = if failed > 0 { format!(", {failed} of them failed and were left out") } else { String::new() };
        let ([from, to], time) = (found.window, written(elapsed));
        say(format!("{simulations} simulations from h = {from:.2} to {to:.2} in {time}{failures}"));
        for name in &found.at_the_end {
            say(format!("warning: {name}* lies at an end of its range; widen --{name} and fit again"));
        }
        if found.fits.iter().any(|fit| fit.deviation.missed > 0.0) {
            say(
                "warning: the best droplet stays stuck before the last frame; check --w and --v-t, or raise --n-vertices",
            );
        }
    }
}

/// The number that a campaign file has by default.
fn default_of(name: &str) -> f64 {
    list::rows(name).find_map(|parameter| parameter.default?.number()).unwrap_or(f64::NAN)
}

fn frames_in(trials: &[Trial]) -> usize {
    trials.iter().map(|trial| trial.frames.len()).sum()
}

fn count(n: usize, what: &str) -> String {
    if n == 1 { format!("one {what}") } else { format!("{n} {what}s") }
}

/// `0.1..5`.
fn parse_range(text: &str) -> Result<RangeInclusive<f64>, String> {
    let wrong = || format!("`{text}` is not a range: write two numbers, like 0.1..5");
    let (from, to) = text.split_once("..").ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
    Ok(number(from)?..=number(to)?)
}

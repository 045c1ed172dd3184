//! The words under a picture: what happened, to which droplet, in which job.

use crate::parameters::{JobId, PARAMETERS, Point, Scene};
use crate::report::parameters::equation;
use crate::report::rounding::significant;
use crate::results::outline::Outline;
use crate::store::JobStory;

/// Stands between two items of a line.
const SEPARATOR: &str = "\u{a0}· ";

/// What a caption is made from.
#[derive(Clone, Copy, Debug)]
pub struct Caption<'a> {
    /// The job.
    pub job: JobId,
    /// Its grid point.
    pub point: &'a Point,
    /// Its seed.
    pub seed: u64,
    /// How it went.
    pub story: &'a JobStory,
}

impl Caption<'_> {
    /// How the job ended, in a line.
    pub fn title(&self) -> String {
        let story = self.story;
        let way = story.r_end.map_or_else(String::new, |r| format!("{} σ", significant(r, 3)));
        if let Some(class) = &story.error_class {
            return format!("Failed: {class}");
        }
        match (story.outcome.as_deref(), story.mechanism.as_deref()) {
            (Some("clogged"), Some("wrap")) => format!("Clogged after {way}: wrapped round an obstacle"),
            (Some("clogged"), Some("squeeze")) => format!("Clogged after {way}: squeezed between two obstacles"),
            (Some("clogged"), Some(other)) => format!("Clogged after {way}: {other}"),
            (Some("clogged"), None) => format!("Clogged after {way}"),
            (Some("time_limit"), _) => format!("Not clogged at the time limit, after {way}"),
            (Some("distance"), _) => format!("Flowed the whole distance, {way}"),
            (Some(other), _) => format!("{other}, after {way}"),
            (None, _) => "Not finished".to_owned(),
        }
    }

    /// The parameters that matter most, by the names of campaign files.
    pub fn parameters(&self) -> String {
        let mut words = vec![self.point.model.name().to_owned()];
        if matches!(self.point.scene, Scene::Plate) {
            words.push("on a plate".to_owned());
        }
        let named = PARAMETERS.iter().filter(|parameter| parameter.in_captions);
        words.extend(named.filter_map(|parameter| Some(equation(parameter.name, parameter.get(self.point)?))));
        words.join(SEPARATOR)
    }

    /// The job and the instant of the outline, with the displacement from `start_x` where that is known, and what holds
    /// the droplet up. There are always two lines, so that all frames of an animation have one size.
    pub fn instant(&self, outline: &Outline, start_x: Option<f64>) -> [String; 2] {
        let mut words = vec![
            format!("job {}", self.job),
            format!("seed {}", self.seed),
            format!("t = {} t0", significant(outline.t, 6)),
        ];
        words.extend(start_x.map(|start_x| format!("r = {:.2} σ", outline.centroid()[0] - start_x)));
        [words.join(SEPARATOR), support(outline)]
    }

    /// Why it failed, if it did.
    pub fn reason(&self) -> Option<&str> {
        self.story.error.as_deref()
    }
}

/// How the obstacles share the force against gravity, the largest share first.
fn support(outline: &Outline) -> String {
    let supports = || outline.loads.iter().map(|load| (-load.fx).max(0.0));
    let total: f64 = supports().sum();
    let mut shares: Vec<f64> = supports().map(|support| support / total).filter(|share| *share >= 0.005).collect();
    shares.sort_by(|a, b| b.total_cmp(a));
    match shares.len() {
        0 => "held by nothing".to_owned(),
        1 => "held by one obstacle".to_owned(),
        n => {
            let shares: Vec<String> = shares.iter().map(|share| format!("{:.0}%", 100.0 * share)).collect();
            format!("held by {n} obstacles: {}", shares.join(" + "))
        }
    }
}

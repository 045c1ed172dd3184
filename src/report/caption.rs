//! The words under a picture: what happened, to which droplet, in which job.

use crate::parameters::{JobId, PARAMETERS, Point, Scene};
use crate::report::forces::is_strong;
use crate::report::parameters::equation;
use crate::report::rounding::significant;
use crate::results::outline::Outline;
use crate::store::JobStory;
use std::collections::BTreeSet;

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
    /// Whether the picture shows the end; a picture of an earlier instant tells nothing of it.
    pub at_end: bool,
}

impl Caption<'_> {
    /// How the job ended, in a line; or that it has not ended yet at this instant.
    pub fn title(&self, outline: &Outline) -> String {
        let story = self.story;
        if !self.at_end {
            return "Under way".to_owned();
        }
        let way = story.r_end.map_or_else(String::new, |r| format!("{} σ", significant(r, 3)));
        if let Some(class) = &story.error_class {
            return format!("Failed: {class}");
        }
        match (story.outcome.as_deref(), story.mechanism.as_deref()) {
            (Some("clogged"), Some("wrap")) => format!("Clogged after {way}: wrapped round an obstacle"),
            (Some("clogged"), Some("squeeze")) => {
                format!("Clogged after {way}: squeezed{}", between(outline))
            }
            (Some("clogged"), Some(other)) => format!("Clogged after {way}: {other}"),
            (Some("clogged"), None) => format!("Clogged after {way}"),
            (Some("pinched"), _) => format!("A film of the droplet closed after {way}"),
            (Some("time_limit"), _) if story.arrested => {
                format!("At rest when the time ran out, after {way}; not yet below the threshold of a clog")
            }
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

/// ` between three obstacles`: those whose forces are drawn as arrows; nothing if there are not two.
fn between(outline: &Outline) -> String {
    let pushing: BTreeSet<_> = outline.loads.iter().filter(|load| is_strong(load)).map(|load| load.obstacle).collect();
    let words = ["two", "three", "four", "five", "six"];
    let number = pushing.len().checked_sub(2).map(|above| words.get(above).copied().unwrap_or("many"));
    number.map_or_else(String::new, |number| format!(" between {number} obstacles"))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Model, Soft};
    use crate::results::outline::LoadRecord;

    fn load(obstacle: u32, fx: f64) -> LoadRecord {
        LoadRecord { obstacle, x: 0.0, y: 0.0, fx, fy: 0.0, turn: 0.0 }
    }

    #[test]
    fn a_squeezed_droplet_is_between_as_many_obstacles_as_there_are_arrows() {
        let title = |loads: &[LoadRecord]| between(&Outline { loads: loads.to_vec(), ..Outline::default() });
        assert_eq!(title(&[load(1, -0.4), load(2, -0.4)]), " between two obstacles");
        assert_eq!(title(&[load(1, -0.4), load(2, -0.3), load(9, 0.2)]), " between three obstacles");
        assert_eq!(
            title(&[load(1, -0.4), load(2, -0.4), load(9, 1e-4)]),
            " between two obstacles",
            "a dot is no arrow"
        );
        assert_eq!(title(&[load(1, -0.4), load(1, -0.4)]), "", "twice the same obstacle");
    }

    #[test]
    fn a_frame_before_the_end_tells_nothing_of_the_end() {
        let point = Point::new(Model::Soft(Soft { e_w: 1.0 }), Scene::Plate);
        let story = JobStory { error_class: Some("unstable".to_owned()), ..JobStory::default() };
        let caption = Caption { job: JobId::new(point.id(), 0), point: &point, seed: 0, story: &story, at_end: true };
        let outline = Outline::default();
        assert_eq!(caption.title(&outline), "Failed: unstable");
        assert_eq!(Caption { at_end: false, ..caption }.title(&outline), "Under way");
    }
}

//! The throats of a campaign, each once, with the tensions that droplets have there.

use crate::campaign::file::Campaign;
use crate::parameters::{MASS, Model, Scene};
use crate::study::threshold::passage::{Passage, PathLost};
use crate::study::threshold::throat::Throat;

/// A throat of a campaign.
#[derive(Clone, Debug)]
pub struct ThroatScene {
    /// The scene that it belongs to; of an array, the gap and the discs count.
    pub scene: Scene,
    /// The vertex diameter of its droplets, in sigma.
    pub delta: f64,
    /// The way of a droplet through it.
    pub passage: Passage,
    /// The line tensions of its droplets, rising.
    pub gammas: Vec<f64>,
}

/// A campaign whose thresholds cannot be given.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum ThresholdError {
    /// It has no throat.
    #[error(
        "campaign `{0}` has no droplet with a line tension (model = \"DP\") in a channel or among obstacles, so there is \
         nothing to pass; name a campaign that has, such as campaigns/channel_profiles.toml"
    )]
    NoThroat(String),
    /// A path was lost.
    #[error("{scene}: {source}")]
    Lost {
        /// Which throat.
        scene: String,
        /// Where.
        source: PathLost,
    },
}

impl ThroatScene {
    /// Whether a droplet of this tension passes.
    pub fn lets_pass(&self, gamma: f64) -> bool {
        gamma < self.passage.gamma_c()
    }

    /// The scene in the words of campaign files, such as `w = 0.7, angle = 45`.
    pub fn label(&self) -> String {
        label(&self.scene)
    }
}

fn label(scene: &Scene) -> String {
    match scene {
        Scene::Channel(channel) if channel.tip_radius > 0.0 => {
            format!("w = {}, angle = {}, tip_radius = {}", channel.w, channel.angle, channel.tip_radius)
        }
        Scene::Channel(channel) => format!("w = {}, angle = {}", channel.w, channel.angle),
        Scene::Obstacles(field) => format!("w_ob = {}, sigma_ob = {}", field.w_ob, field.sigma_ob),
        other => other.name().to_owned(),
    }
}

/// The throats of a campaign, in the order of its blocks and points.
///
/// # Errors
/// [`ThresholdError`].
pub fn throats(campaign: &Campaign) -> Result<Vec<ThroatScene>, ThresholdError> {
    let mut found: Vec<(Throat, Scene, f64, Vec<f64>)> = Vec::new();
    for point in campaign.blocks.iter().flat_map(|block| &block.points) {
        let (Some(throat), Model::Deformable(ring)) = (Throat::of(point), &point.model) else { continue };
        let known = found.iter().position(|(known, scene, ..)| *known == throat && scene.name() == point.scene.name());
        let at = known.unwrap_or(found.len());
        if known.is_none() {
            found.push((throat, point.scene.clone(), ring.delta, Vec::new()));
        }
        let gammas = &mut found[at].3;
        if let Err(place) = gammas.binary_search_by(|gamma| gamma.total_cmp(&ring.gamma)) {
            gammas.insert(place, ring.gamma);
        }
    }
    if found.is_empty() {
        return Err(ThresholdError::NoThroat(campaign.name.clone()));
    }
    let scene = |(throat, scene, delta, gammas)| match Passage::of(throat, MASS) {
        Ok(passage) => Ok(ThroatScene { scene, delta, passage, gammas }),
        Err(source) => Err(ThresholdError::Lost { scene: label(&scene), source }),
    };
    found.into_iter().map(scene).collect()
}

//! Where a droplet moves. All lengths are in sigma.

use serde::{Deserialize, Serialize};

/// The geometry a droplet moves in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Scene {
    /// Discs at random in a periodic box.
    #[serde(rename = "obstacles")]
    Obstacles(ObstacleField),
    /// A constriction between two wedges.
    #[serde(rename = "channel")]
    Channel(Channel),
    /// A flat wall below the droplet.
    #[serde(rename = "plate")]
    Plate,
    /// One disc.
    #[serde(rename = "disc")]
    Disc(LoneDisc),
}

/// One disc around the origin, onto which a droplet falls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoneDisc {
    /// Diameter of the disc.
    pub sigma_ob: f64,
    /// How far beside the axis of the disc the centroid starts, along y; zero is head-on.
    pub offset: f64,
    /// Where the centroid starts along x.
    pub h_start: f64,
    /// Where the trajectory ends, past the disc.
    pub h_end: f64,
}

/// A constriction between two wedges, its orifice at `x = 0`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Channel {
    /// Width of the orifice.
    pub w: f64,
    /// Rise of the wedges' faces from the axis, in degrees.
    pub angle: f64,
    /// Radius of the rounded tips; zero for sharp ones.
    pub tip_radius: f64,
    /// Where the centroid starts.
    pub h_start: f64,
    /// Where the trajectory ends, past the orifice.
    pub h_end: f64,
}

impl Channel {
    /// Where a circle of radius R on the axis first touches the wedges: `h = -(R + r - (w/2 + r) cos a)/sin a` for the
    /// angle a and the tip radius r; zero if the circle passes without touching.
    pub fn first_contact(&self, radius: f64) -> f64 {
        let (sin, cos) = libm::sincos(self.angle.to_radians());
        let r = self.tip_radius;
        -((radius + r - (0.5 * self.w + r) * cos) / sin).max(0.0)
    }
}

/// A periodic box of discs placed by random sequential addition. Together with a seed it names one array.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObstacleField {
    /// Smallest gap between two disc surfaces.
    pub w_ob: f64,
    /// Diameter of a disc.
    pub sigma_ob: f64,
    /// How many discs.
    pub density: Density,
    /// Side L of the periodic box.
    pub box_size: f64,
}

/// Coverage of the plane by discs at which random sequential addition jams.
const JAMMED: f64 = 0.547;

impl ObstacleField {
    /// Obstacles per sigma^2 of a saturated array, in which discs of diameter `D = sigma_ob + w_ob` jam:
    /// `0.547/(pi D^2/4)`.
    pub(crate) fn jammed_density(&self) -> f64 {
        let spacing = self.sigma_ob + self.w_ob;
        JAMMED / (std::f64::consts::FRAC_PI_4 * spacing * spacing)
    }

    /// Obstacles per sigma^2.
    pub(crate) fn number_density(&self) -> f64 {
        match self.density {
            Density::Number(density) => density,
            Density::Saturated => self.jammed_density(),
        }
    }
}

/// How full an obstacle array is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Density {
    /// Until no further disc fits.
    #[serde(rename = "saturated")]
    Saturated,
    /// This many discs per sigma^2.
    #[serde(rename = "number")]
    Number(f64),
}

impl Scene {
    /// The name of the scene, as in the column `scene`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Obstacles(_) => "obstacles",
            Self::Channel(_) => "channel",
            Self::Plate => "plate",
            Self::Disc(_) => "disc",
        }
    }
}

//! The scenes that accuracy is measured in.

use crate::campaign::choose::tolerance::Kind;
use crate::parameters::names;
use crate::study::accuracy::observable::{ARREST, CLOG, FLOW, FREE, Observable, PASSAGE, PLATE};

/// A scene of the accuracy campaign, by the first part of its block's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TestScene {
    /// A droplet that touches nothing.
    Free,
    /// A droplet passes a constriction, close to the threshold of passing.
    Channel,
    /// A droplet passes a constriction with more ease.
    Passage,
    /// A droplet stays stuck in a constriction.
    Arrest,
    /// An array in which nothing clogs.
    Flow,
    /// An array in which droplets clog.
    Clog,
    /// A liquid droplet passes the constriction of `Passage`.
    LiquidPassage,
    /// A liquid droplet stays stuck in that of `Arrest`.
    LiquidArrest,
    /// Liquid droplets in the arrays of `Clog`.
    LiquidClog,
    /// A soft particle on a plate.
    Plate,
}

names!(pub(crate) TestScene {
    Free = "free", Channel = "channel", Passage = "passage", Arrest = "arrest",
    Flow = "flow", Clog = "clog",
    LiquidPassage = "liquid_passage", LiquidArrest = "liquid_arrest", LiquidClog = "liquid_clog",
    Plate = "plate",
});

impl TestScene {
    pub(crate) const ALL: [Self; 10] = [
        Self::Free,
        Self::Channel,
        Self::Passage,
        Self::LiquidPassage,
        Self::Arrest,
        Self::LiquidArrest,
        Self::Flow,
        Self::Clog,
        Self::LiquidClog,
        Self::Plate,
    ];

    /// The numbers that are read off its runs.
    pub(crate) const fn observables(self) -> &'static [Observable] {
        match self {
            Self::Free => FREE,
            Self::Channel | Self::Passage | Self::LiquidPassage => PASSAGE,
            Self::Arrest | Self::LiquidArrest => ARREST,
            Self::Flow => FLOW,
            Self::Clog | Self::LiquidClog => CLOG,
            Self::Plate => PLATE,
        }
    }

    pub(crate) const fn about(self) -> &'static str {
        match self {
            Self::Free => "A droplet that touches nothing",
            Self::Channel => "A droplet squeezes through a constriction that it only just passes",
            Self::Passage => "A droplet passes a constriction with more ease",
            Self::Arrest => "A droplet stays stuck in a constriction, and comes to rest",
            Self::Flow => "Arrays of obstacles in which nothing clogs, the same at every setting",
            Self::Clog => "Arrays of obstacles in which droplets clog, the same at every setting",
            Self::LiquidPassage => "The same passage, by a droplet that is a liquid",
            Self::LiquidArrest => "The same arrest, of a droplet that is a liquid",
            Self::LiquidClog => "The same arrays that clog, for droplets that are liquids",
            Self::Plate => "A soft particle sinks onto a plate",
        }
    }

    /// The kind of scene in the table of `tolerance` that it is measured for, if any.
    pub(crate) const fn kind(self) -> Option<Kind> {
        match self {
            Self::Free => Some(Kind::Free),
            Self::Channel | Self::Passage => Some(Kind::Channel),
            Self::Flow => Some(Kind::Flow),
            Self::Clog => Some(Kind::Clog),
            Self::Arrest | Self::Plate | Self::LiquidPassage | Self::LiquidArrest | Self::LiquidClog => None,
        }
    }

    pub(crate) const fn needs_samples(self) -> bool {
        !matches!(self, Self::Flow | Self::Clog | Self::LiquidClog | Self::Plate)
    }
}

//! The colours of pictures of droplets and of plots.

/// Colours of curves, which most eyes tell apart; curves take them in turn.
pub(super) const CURVES: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"];

pub(super) const WATER: &str = "#56a8e2";
pub(super) const WATER_EDGE: &str = "#0f4c81";
pub(super) const PATH: &str = "#2f6f9f";
pub(super) const FORCE: &str = "#d7263d";
pub(super) const WEIGHT: &str = "#22303f";
pub(super) const INK: &str = "#1c2733";
pub(super) const PALE_INK: &str = "#5d6b7a";
pub(super) const GROUND: &str = "#f6f8fa";
pub(super) const OBSTACLE: &str = "#c3cad4";
pub(super) const OBSTACLE_EDGE: &str = "#9aa4b2";
/// An obstacle that bears a load.
pub(super) const LOADED: &str = "#8791a0";

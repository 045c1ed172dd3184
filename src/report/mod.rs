//! Answers for people: text tables, pictures of droplets, plots, pages. Functions return text or bytes; nothing is
//! printed and no file is written here.
//!
//! This layer knows parameters, results, physics (to make the walls of a scene again), studies and the store.
//!
//! | answer | modules |
//! |---|---|
//! | decay lengths and mean speeds | [`tables`]; `parameters` tells which columns vary |
//! | what accuracy costs | [`accuracy`], `error_plot` |
//! | a calibration | `calibration`, `profile_plot` |
//! | thresholds of passage | `threshold` |
//! | a droplet at one instant | `droplet`: `surroundings`, `trail`, `forces`, `signs`, `caption`, placed by `view` |
//! | the keys of campaign files | `keys` |
//! | pixels | `raster` for PNG, `animation` for GIF |
//!
//! All share `rounding`, which formats numbers, `text_table`, which lays out tables, and `svg`, the elements of
//! pictures. Plots are made of `panel` and `axes`. Read [`tables`] first, then `droplet`.

pub mod accuracy;
pub(crate) mod animation;
mod axes;
pub(crate) mod calibration;
pub(crate) mod caption;
mod colours;
pub(crate) mod comparison;
pub(crate) mod droplet;
pub(crate) mod error_plot;
mod forces;
pub(crate) mod keys;
mod lambda_columns;
mod panel;
mod parameters;
pub(crate) mod profile_plot;
pub(crate) mod raster;
mod rounding;
mod signs;
pub(crate) mod surroundings;
mod svg;
pub mod tables;
pub(crate) mod text_table;
pub(crate) mod threshold;
mod trail;
pub(crate) mod view;

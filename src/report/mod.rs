//! Answers for people: text tables, pictures of droplets, plots, pages. Functions return text or bytes; nothing is printed
//! and no file is written here.
//!
//! This layer knows parameters, results, physics (to make the walls of a scene again), studies and the store.
//!
//! | answer | modules |
//! |---|---|
//! | decay lengths and mean speeds | [`tables`]; `parameters` tells which columns vary |
//! | what accuracy costs | [`accuracy`], `error_plot` |
//! | a calibration | `calibration`, `profile_plot` |
//! | a droplet at one instant | `droplet`: `surroundings`, `trail`, `forces`, `signs`, `caption`, placed by `view` |
//! | pixels | `raster` for PNG, `animation` for GIF |
//!
//! Four modules are shared by all: `rounding` formats numbers, `text_table` tables, `svg` the elements of pictures, and
//! `panel` and `axes` are what plots are made of. Read [`tables`] first, then `droplet`.

pub mod accuracy;
pub mod animation;
mod axes;
pub mod calibration;
pub mod caption;
mod colours;
pub mod droplet;
pub mod error_plot;
mod forces;
mod panel;
mod parameters;
pub mod profile_plot;
pub mod raster;
mod rounding;
mod signs;
pub mod surroundings;
mod svg;
pub mod tables;
mod text_table;
mod trail;
pub mod view;

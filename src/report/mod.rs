//! What people read and look at, made from fitted points and stored shapes: text, and pictures of droplets. Functions
//! return text or bytes; nothing is printed.

pub mod accuracy;
pub mod animation;
pub mod calibration;
pub mod caption;
pub mod droplet;
pub mod front_plot;
mod parameters;
pub mod profile_plot;
pub mod raster;
mod rounding;
pub mod surroundings;
mod svg;
pub mod tables;
mod view;

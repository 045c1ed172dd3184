//! What people read: text for the terminal, made from fitted points. Functions return a `String`; nothing is printed.

mod parameters;
mod rounding;
pub mod tables;

//! Up to which line tension a droplet passes a narrow place, by statics alone.
//!
//! Let P(h) be the least perimeter of a droplet of area a whose centroid is held at h along gravity. Its weight does
//! the work `M h`, its surface costs `Gamma P(h)`. So it stops where `Gamma dP/dh = M`, and it passes if and only if
//!
//! ```text
//! Gamma < Gamma_c = M / max dP/dh
//! ```
//!
//! The walls are hard, smooth, and wetted by a film, so nothing but their shape matters. Neither drag nor inertia do,
//! as long as the droplet comes slowly. This is an oracle for the dynamics, and shares no code with it.
//!
//! # Method
//! The droplet lies between two walls that are mirror images in the axis along gravity, and so does its shape.
//! `balance` has the equations of a held droplet, in which `cap` gives the free surfaces, exact arcs of the
//! Young-Laplace equation, and `throat` the contour of the walls. `passage` follows the solutions from the first touch
//! to the throat. Nothing is discretised but the integrals along free surfaces (`quadrature`): with 48 nodes the
//! threshold has ten digits where the gap is 0.1 sigma or wider.
//!
//! # What it leaves out
//! Droplets off the axis; the softness of walls and of the area; the springs of `dynamics = "vertex"`; and among
//! obstacles all discs but two that lie side by side across gravity. Slanted pairs, and places among three discs, hold
//! droplets at other tensions.
//!
//! ```
//! use meniscus::parameters::MASS;
//! use meniscus::study::threshold::{Passage, Throat};
//!
//! let delta = std::f64::consts::PI / 256.0;
//! let orifice = Throat::channel(0.7, 45.0, 0.0, delta);
//! let passage = Passage::of(orifice, MASS).unwrap();
//! assert!((passage.gamma_c() - 1.0987).abs() < 1e-4);
//! ```

mod balance;
mod cap;
#[cfg(test)]
mod dynamics;
mod passage;
mod quadrature;
mod scenes;
mod throat;

pub use passage::{End, Held, Passage, PathLost};
pub use quadrature::DEFAULT_NODES;
pub use scenes::{ThresholdError, ThroatScene, throats};
pub use throat::Throat;

//! How the discs of an array get their places.
//!
//! Discs of diameter `sigma_ob` are added one after the other at uniformly random places of a periodic box. A disc
//! stays if its centre is further than the *spacing* `sigma_ob + w_ob` from all earlier ones. This is random sequential
//! addition. It goes on until there are as many discs as the density asks for or, for a saturated array, until no
//! further one fits. An array depends on its field and its seed alone.
//!
//! Who does what depends on the density. Coverage here is that of discs as wide as the spacing; 0.547 is where the box
//! is full.
//!
//! | density | who | how |
//! |---|---|---|
//! | given, coverage up to a third | `packing` | throws darts at the whole box |
//! | given, coverage above a third | `packing`, then `growth` | most darts would miss, so they are thrown only where there is room |
//! | given, more than fits | `growth` | proves that the box is full, and the array is refused |
//! | saturated | `saturated`, by `growth` | tile by tile, when a droplet looks there |
//!
//! Read [`obstacles`] first: it is the face of all this. Then `board`, the box that darts are thrown at, and `growth`,
//! where the idea is explained. `tile` and `sorted` hold discs so that those near a place are found at once.
//! [`library`] keeps the arrays that jobs share.

mod board;
mod growth;
pub mod library;
pub mod obstacles;
mod packing;
mod saturated;
mod sorted;
#[cfg(test)]
mod tests;
mod tile;

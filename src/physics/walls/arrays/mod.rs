//! How the discs of an array get their places.
//!
//! Discs of diameter `sigma_ob` are added one after the other at uniformly random places of a periodic box. A disc
//! stays if its centre is further than the *spacing* `sigma_ob + w_ob` from all earlier centres. This is random
//! sequential addition. It ends when the density is reached or, for a saturated array, when no further disc fits. An
//! array depends only on its field and its seed.
//!
//! The method depends on the density. Coverage here is that of discs as wide as the spacing; a full box has 0.547.
//!
//! | density | module | method |
//! |---|---|---|
//! | given, coverage up to a third | `packing` | throws darts at the whole box |
//! | given, coverage above a third | `packing`, then `growth` | most darts would miss, so they are thrown only where there is room |
//! | given, more than fits | `growth` | proves that the box is full, and the array is refused |
//! | saturated | `saturated`, with `growth` | places discs tile by tile, where droplets come |
//!
//! Read [`obstacles`] first, through which others use this folder. Then read `board`, the box that darts are thrown at,
//! and `growth`, which explains the idea. [`library`] keeps the arrays that jobs share.

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

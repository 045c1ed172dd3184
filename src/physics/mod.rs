//! From a job to its trajectory: no files, no SQL, no wall clock.
//!
//! This layer knows parameters and results. One (version, job) gives the same trajectory bit for bit, on any number of
//! threads and any instruction set. Read [`simulate`] first: it starts a droplet and drives it to its end. These are
//! the parts of the layer, and each imports only from those above it:
//!
//! | folder | idea |
//! |---|---|
//! | [`simd`] | eight numbers at a time on any instruction set |
//! | [`walls`] | what droplets lean on: discs, wedges, a plate; `walls/arrays` says how obstacles get their places |
//! | [`observation`] | what is read off a droplet at one instant |
//! | [`ring`] | the deformable droplet, and the forces on it, one file each |
//! | [`point`] | the soft particle |
//! | [`motion`] | how time advances, and how a droplet is put in place |
//! | [`simulate`] | start, drive, judge, record, snapshot; stability limits |

pub mod motion;
pub mod observation;
pub mod point;
pub mod ring;
pub mod simd;
pub mod simulate;
pub mod walls;

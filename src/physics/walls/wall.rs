//! What a droplet can touch: convex obstacles, told from the skeleton that their surface surrounds at a fixed distance.
//!
//! A disc is a point with the surface at its radius; a wedge with a rounded tip is a sharp wedge with the surface at the tip
//! radius; a plate is a half-plane. Signed distances to a convex skeleton are convex along an edge, so an edge has one
//! nearest point.
//!
//! Against a flat face an edge that lies parallel has no one nearest point, and the force would jump from end to end. So flat
//! faces take the minimum over `q` in [0, 1] of `d(q) + beta (q - 1/2)^2`, [`LEVEL`] being beta: still convex, its force
//! still the gradient of an energy, and continuous.
//!
//! # Writing your own
//! An obstacle implements [`Obstacle`] for eight edges, and for eight vertices, at a time; a scene implements [`Walls`], which lists
//! the obstacles near a droplet.

use crate::physics::simd::Instructions;
use fearless_simd::{f64x8, prelude::*};

/// Depth, in sigma, over which the force on an edge parallel to a flat face passes from one end to the other.
pub const LEVEL: f64 = 2.5e-4;

/// Eight edges: where they start, relative to the ring's origin, and their vectors.
#[derive(Clone, Copy)]
pub struct Edges<S: Simd> {
    /// x of the first vertex.
    pub x: f64x8<S>,
    /// y of the first vertex.
    pub y: f64x8<S>,
    /// x of the edge vector.
    pub ex: f64x8<S>,
    /// y of the edge vector.
    pub ey: f64x8<S>,
}

/// How eight edges touch an obstacle.
#[derive(Clone, Copy)]
pub struct Touch<S: Simd> {
    /// Where on the edge its nearest point lies, in [0, 1].
    pub q: f64x8<S>,
    /// `reach` less the distance of that point from the skeleton; zero where they do not touch.
    pub overlap: f64x8<S>,
    /// Unit normal away from the obstacle, x.
    pub nx: f64x8<S>,
    /// Unit normal, y.
    pub ny: f64x8<S>,
}

/// A convex obstacle.
pub trait Obstacle: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// beta of its contact with edges: [`LEVEL`] for obstacles with flat faces, zero for round ones.
    const LEVEL: f64;

    /// Orders the obstacles of a scene, so that sums over them have one order.
    fn id(&self) -> u32;

    /// Distance from the nearest point of each edge to the skeleton, negative inside it.
    fn distance<S: Simd>(&self, simd: S, edges: Edges<S>) -> f64x8<S>;

    /// The same from points.
    fn distance_to<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S>;

    /// How the edges touch, or `None` if none comes closer to the skeleton than `reach`.
    fn touch<S: Simd>(&self, simd: S, edges: Edges<S>, reach: f64) -> Option<Touch<S>>;

    /// How deep a point lies within `reach` of the skeleton, and the unit normal there; `None` if it does not.
    fn touch_point(&self, x: f64, y: f64, reach: f64) -> Option<(f64, [f64; 2])>;

    /// `force` and the push on a point, `stiffness` times how deep it lies within `reach`, along the normal. `memory` is the obstacle's own from call to call, for
    /// points that hardly moved; zero if there was none.
    #[inline(always)]
    fn push_point(&self, at: [f64; 2], reach: f64, stiffness: f64, memory: &mut f64, force: [f64; 2]) -> [f64; 2] {
        let _ = memory;
        match self.touch_point(at[0], at[1], reach) {
            None => force,
            Some((depth, normal)) => {
                let push = stiffness * depth;
                [push.mul_add(normal[0], force[0]), push.mul_add(normal[1], force[1])]
            }
        }
    }

    /// How fast the normal turns at a point outside the skeleton (local coordinates): the inverse distance where the nearest
    /// of the skeleton is a corner, zero where it is a face.
    fn curvature<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S>;

    /// Whether the obstacle counts as inside a ring that contains this point (local coordinates); `None` for obstacles that
    /// reach to infinity, which no ring can contain.
    fn heart(&self) -> Option<[f64; 2]>;
}

/// How an instruction set asks an obstacle: in line where it has vectors. Plain code asks by a call, for there eight lanes are long, and in
/// line everywhere they took minutes of compilation.
pub trait Asking: Instructions {
    /// [`Obstacle::distance`].
    fn distance<T: Obstacle>(self, obstacle: &T, edges: Edges<Self>) -> f64x8<Self>;

    /// [`Obstacle::distance_to`].
    fn distance_to<T: Obstacle>(self, obstacle: &T, x: f64x8<Self>, y: f64x8<Self>) -> f64x8<Self>;

    /// [`Obstacle::touch`].
    fn touch<T: Obstacle>(self, obstacle: &T, edges: Edges<Self>, reach: f64) -> Option<Touch<Self>>;
}

macro_rules! asking {
    ($inline:meta: $($set:ty),+) => {
        $(impl Asking for $set {
            #[$inline]
            fn distance<T: Obstacle>(self, obstacle: &T, edges: Edges<Self>) -> f64x8<Self> {
                obstacle.distance(self, edges)
            }

            #[$inline]
            fn distance_to<T: Obstacle>(self, obstacle: &T, x: f64x8<Self>, y: f64x8<Self>) -> f64x8<Self> {
                obstacle.distance_to(self, x, y)
            }

            #[$inline]
            fn touch<T: Obstacle>(self, obstacle: &T, edges: Edges<Self>, reach: f64) -> Option<Touch<Self>> {
                obstacle.touch(self, edges, reach)
            }
        })+
    };
}
#[cfg(target_arch = "x86_64")]
asking!(inline(always): fearless_simd::x86::Avx2, fearless_simd::x86::Avx512);
#[cfg(target_arch = "aarch64")]
asking!(inline(always): fearless_simd::aarch64::Neon);
asking!(inline(never): fearless_simd::Fallback);

/// The walls of a scene.
pub trait Walls: Send + Sync + std::fmt::Debug + 'static {
    /// Their obstacle.
    type Obstacle: Obstacle;

    /// Distance of the surface from the skeleton: the radius of a disc or a tip.
    fn surface(&self) -> f64;

    /// Calls `visit` with every obstacle whose skeleton may come into the box `[x_min, x_max, y_min, y_max]`, all in
    /// coordinates relative to `origin`.
    fn for_each_near(&self, origin: [f64; 2], bounds: [f64; 4], visit: impl FnMut(Self::Obstacle));
}

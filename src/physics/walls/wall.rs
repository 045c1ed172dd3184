//! What an obstacle must provide, and the walls of a scene.
//!
//! # Skeleton and surface
//! An obstacle is a convex *skeleton* and a *surface* around it at a fixed distance, which is the same for all
//! obstacles of a scene:
//!
//! | obstacle | skeleton | distance of the surface |
//! |---|---|---|
//! | [`Disc`](crate::physics::walls::disc::Disc) | a point | its radius |
//! | [`Wedge`](crate::physics::walls::wedge::Wedge) | a sharp wedge | the radius of its tip |
//! | [`HalfPlane`](crate::physics::walls::plate::HalfPlane) | everything beyond a line | 0 |
//!
//! All distances below are from the skeleton, and negative inside it. They are convex functions along an edge,
//! because the skeleton is convex, so an edge has one nearest point.
//!
//! # What is asked
//! With `d(p)` the distance of a point, `p(q) = p0 + q e` the points of an edge, `q` in [0, 1], and `n` the unit normal
//! away from the obstacle at the nearest point:
//!
//! | question | answer | who asks |
//! |---|---|---|
//! | [`Obstacle::distance`] | `min d(p(q))` over q, for eight edges | contact, to list what is near |
//! | [`Obstacle::distance_to`] | `d(p)`, for eight points | near-wall drag |
//! | [`Obstacle::touch`] | `q`, `reach - min (d(p(q)) + beta (q - 1/2)^2)` and `n`, for eight edges | contact, at each step |
//! | [`Obstacle::touch_point`] | `reach - d(p)` and `n`, for one point | the soft particle |
//! | [`Obstacle::push_point`] | `f + k (reach - d(p)) n`, for one point | the soft particle, at each step |
//! | [`Obstacle::curvature`] | `1/d` where a corner is nearest, 0 where a face is | the implicit integrator |
//! | [`Obstacle::corner`] | the point around which the surface is round | edges that bend round a wall |
//! | [`Obstacle::inner_point`] | a point that no droplet may contain | the check for engulfed obstacles |
//! | [`Obstacle::id`] | a number | sums over obstacles, which go in its order |
//!
//! Flat faces need the term in `beta`. An edge parallel to a face has no unique nearest point, and without the term the
//! force would jump from one end to the other. With the term the function is still convex, and the force is still the
//! gradient of an energy and continuous. For round obstacles [`Obstacle::BETA`] is zero.
//!
//! # Writing your own
//! 1. Implement [`Obstacle`] for a small `Copy` type that holds the skeleton in local coordinates, and a number.
//!    `plate.rs` is the shortest example, `disc.rs` has no face, `wedge.rs` has faces and a corner. Functions of eight
//!    lanes are `#[inline(always)]` and use no closures, because code that may not be inlined is compiled without
//!    vector instructions.
//! 2. Implement [`Walls`] for the scene: the distance of the surface, and which obstacles come near a box. These are
//!    called rarely.
//! 3. Test `distance` against points sampled along edges, as `wedge.rs` does, and the force against the slope of the
//!    energy, as `tests/physics.rs` does.

use crate::physics::simd::Instructions;
use fearless_simd::{f64x8, prelude::*};

/// beta of obstacles with flat faces, in sigma: over this depth the force on an edge that is nearly parallel to a face
/// passes from one end to the other.
pub(crate) const FACE_BETA: f64 = 2.5e-4;

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
    /// Place of the nearest point on the edge, in [0, 1].
    pub q: f64x8<S>,
    /// `reach` minus the distance of that point from the skeleton; zero if they do not touch.
    pub overlap: f64x8<S>,
    /// Unit normal away from the obstacle, x.
    pub nx: f64x8<S>,
    /// Unit normal, y.
    pub ny: f64x8<S>,
}

/// A convex obstacle. The [module](self) explains each question.
pub trait Obstacle: Copy + Send + Sync + std::fmt::Debug + 'static {
    /// beta in [`touch`](Self::touch): 2.5e-4 sigma for obstacles with flat faces, zero for round ones.
    const BETA: f64;

    /// Number of the obstacle in its scene. Sums over obstacles go in this order.
    fn id(&self) -> u32;

    /// Distance of the skeleton from the nearest point of each edge, negative inside it.
    fn distance<S: Simd>(&self, simd: S, edges: Edges<S>) -> f64x8<S>;

    /// Distance of the skeleton from each point, negative inside it.
    fn distance_to<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S>;

    /// How the edges touch, or `None` if none comes closer to the skeleton than `reach`.
    fn touch<S: Simd>(&self, simd: S, edges: Edges<S>, reach: f64) -> Option<Touch<S>>;

    /// How deep a point lies within `reach` of the skeleton, and the unit normal there; `None` if it lies outside.
    fn touch_point(&self, x: f64, y: f64, reach: f64) -> Option<(f64, [f64; 2])>;

    /// `force` plus the push on a point: `stiffness` times how deep the point lies within `reach`, along the normal.
    ///
    /// The obstacle may keep a number in `memory` from one step to the next, to answer faster for a point that has
    /// hardly moved. It is zero at first.
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

    /// How fast the normal turns along the surface through each point outside the skeleton: the inverse distance where
    /// a corner of the skeleton is nearest, zero where a face is.
    fn curvature<S: Simd>(&self, simd: S, x: f64x8<S>, y: f64x8<S>) -> f64x8<S>;

    /// The curvature at one point.
    fn curvature_at(&self, x: f64, y: f64) -> f64 {
        let simd = fearless_simd::Fallback::new();
        self.curvature(simd, f64x8::splat(simd, x), f64x8::splat(simd, y)).as_slice()[0]
    }

    /// The corner of the skeleton, around which the surface is round; `None` if there is none.
    fn corner(&self) -> Option<[f64; 2]>;

    /// A point of the skeleton that no droplet may contain: a ring around it has engulfed the obstacle, or is pierced
    /// by it. `None` if there is no such point.
    fn inner_point(&self) -> Option<[f64; 2]>;
}

/// The questions to obstacles, inlined for instruction sets with vectors, and not inlined for scalars: inlined
/// everywhere, the scalar code of eight lanes took minutes to compile.
pub(crate) trait ObstacleQueries: Instructions {
    fn distance<T: Obstacle>(self, obstacle: &T, edges: Edges<Self>) -> f64x8<Self>;
    fn distance_to<T: Obstacle>(self, obstacle: &T, x: f64x8<Self>, y: f64x8<Self>) -> f64x8<Self>;
    fn touch<T: Obstacle>(self, obstacle: &T, edges: Edges<Self>, reach: f64) -> Option<Touch<Self>>;
}

macro_rules! obstacle_queries {
    ($inline:meta: $($set:ty),+) => {
        $(impl ObstacleQueries for $set {
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
obstacle_queries!(inline(always): fearless_simd::x86::Avx2, fearless_simd::x86::Avx512);
#[cfg(target_arch = "aarch64")]
obstacle_queries!(inline(always): fearless_simd::aarch64::Neon);
obstacle_queries!(inline(never): fearless_simd::Fallback);

/// The walls of a scene.
pub trait Walls: Send + Sync + std::fmt::Debug + 'static {
    /// The type of the obstacles.
    type Obstacle: Obstacle;

    /// Distance of the surface from the skeleton: the radius of a disc or of a tip, in sigma.
    fn surface(&self) -> f64;

    /// Calls `visit` with every obstacle whose skeleton may come into the box `[x_min, x_max, y_min, y_max]`. Box and
    /// obstacles are in coordinates relative to `origin`. An obstacle may be visited twice, as two periodic images.
    fn for_each_near(&self, origin: [f64; 2], bounds: [f64; 4], visit: impl FnMut(Self::Obstacle));
}

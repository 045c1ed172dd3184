//! What is near a droplet, listed once a step: obstacles with the vertices and edges near them, and parts of the
//! droplet that are near one another.
//!
//! The list holds everything that can touch while no vertex is further than `SKIN` from where it was listed. What is
//! listed but does not touch adds nothing, so no result depends on when a list was made.

use crate::physics::liquid::polygon::{Polygon, following};
use crate::physics::liquid::self_contact::SelfContact;
use crate::physics::walls::neighbours::obstacles_near;
use crate::physics::walls::wall::{Obstacle, Walls};

/// How far vertices may move before a new list is needed, in sigma.
pub(crate) const SKIN: f64 = 0.06;

/// An obstacle near the droplet.
#[derive(Clone, Debug)]
pub(crate) struct NearObstacle<O> {
    pub(crate) obstacle: O,
    /// Vertices that may touch it.
    pub(crate) vertices: Vec<usize>,
    /// Edges that may bend round its corner.
    pub(crate) edges: Vec<usize>,
}

/// Everything that may touch.
#[derive(Clone, Debug)]
pub(crate) struct Nearby<O> {
    pub(crate) obstacles: Vec<NearObstacle<O>>,
    /// Pairs of a vertex and an edge.
    pub(crate) pairs: Vec<[usize; 2]>,
    listed_at: Polygon,
}

impl<O: Obstacle> Nearby<O> {
    pub(crate) const fn none() -> Self {
        let listed_at = Polygon { x: Vec::new(), y: Vec::new() };
        Self { obstacles: Vec::new(), pairs: Vec::new(), listed_at }
    }

    /// Makes the list for vertices near `shape`.
    pub(crate) fn list<W: Walls<Obstacle = O>>(
        &mut self,
        walls: &W,
        origin: [f64; 2],
        shape: &Polygon,
        reach: f64,
        folds: Option<&SelfContact>,
    ) {
        self.listed_at.clone_from(shape);
        let far = reach + SKIN;
        let found = obstacles_near(walls, origin, shape.bounds(), far);
        self.obstacles = found.into_iter().map(|obstacle| near(obstacle, shape, far)).collect();
        self.obstacles.retain(|near| !near.vertices.is_empty() || !near.edges.is_empty());
        match folds {
            Some(folds) => folds.list(shape, 2.0 * SKIN, &mut self.pairs),
            None => self.pairs.clear(),
        }
    }

    /// Whether the list holds everything that can touch a droplet of this shape.
    pub(crate) fn covers(&self, shape: &Polygon) -> bool {
        shape.largest_distance(&self.listed_at) <= SKIN
    }
}

fn near<O: Obstacle>(obstacle: O, shape: &Polygon, far: f64) -> NearObstacle<O> {
    let n = shape.len();
    let vertices = (0..n).filter(|&i| obstacle.touch_point(shape.x[i], shape.y[i], far).is_some()).collect();
    let edges = match obstacle.corner() {
        Some(corner) => (0..n).filter(|&i| squared_distance(corner, shape, i) < far * far).collect(),
        None => Vec::new(),
    };
    NearObstacle { obstacle, vertices, edges }
}

/// Squared distance of a point from edge `i`.
fn squared_distance([px, py]: [f64; 2], shape: &Polygon, i: usize) -> f64 {
    let j = following(i, shape.len());
    let (rx, ry) = (px - shape.x[i], py - shape.y[i]);
    let (ex, ey) = (shape.x[j] - shape.x[i], shape.y[j] - shape.y[i]);
    let q = ((rx * ex + ry * ey) / (ex * ex + ey * ey)).clamp(0.0, 1.0);
    let (dx, dy) = (rx - q * ex, ry - q * ey);
    dx * dx + dy * dy
}

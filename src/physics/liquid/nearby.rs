//! What is near a droplet, listed once a step: obstacles with the vertices and edges near them, and parts of the
//! droplet that are near one another.
//!
//! The list holds everything that can touch while no vertex is further than `SKIN` from where it was listed. Parts of the
//! droplet are listed again only after it has changed its shape. What is listed but does not touch adds nothing, so no
//! result depends on when a list was made.

use crate::physics::liquid::polygon::{Polygon, following};
use crate::physics::liquid::self_contact::SelfContact;
use crate::physics::walls::neighbours::obstacles_near;
use crate::physics::walls::wall::{Obstacle, Walls};

/// How far vertices may move before a new list is needed, in sigma.
pub(crate) const SKIN: f64 = 0.05;

/// How far vertices may be, relative to one another, from where pairs were listed.
const CHANGE: f64 = 0.015;

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
    paired_at: Polygon,
}

impl<O: Obstacle> Nearby<O> {
    pub(crate) const fn none() -> Self {
        const NOWHERE: Polygon = Polygon { x: Vec::new(), y: Vec::new() };
        Self { obstacles: Vec::new(), pairs: Vec::new(), listed_at: NOWHERE, paired_at: NOWHERE }
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
        // Negated, so that a NaN too leads to a new list.
        if let Some(folds) = folds
            && !(self.paired_at.len() == shape.len() && change(shape, &self.paired_at) <= CHANGE)
        {
            self.paired_at.clone_from(shape);
            folds.list(shape, 2.0 * (SKIN + CHANGE), &mut self.pairs);
        }
    }

    /// Whether the list holds everything that can touch a droplet of this shape.
    pub(crate) fn covers(&self, shape: &Polygon) -> bool {
        shape.largest_distance(&self.listed_at) <= SKIN
    }
}

/// The largest distance of a vertex from that of the same number, apart from a shift of all.
fn change(a: &Polygon, b: &Polygon) -> f64 {
    let n = a.len();
    let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>() / n as f64;
    let (mx, my) = (mean(&a.x, &b.x), mean(&a.y, &b.y));
    let squared = |i: usize| {
        let (dx, dy) = (a.x[i] - b.x[i] - mx, a.y[i] - b.y[i] - my);
        dx * dx + dy * dy
    };
    (0..n).map(squared).fold(0.0, |most: f64, d| if d <= most { most } else { d }).sqrt()
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

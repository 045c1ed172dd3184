//! The droplet touches itself where two stretches of its outline come closer than delta.
//!
//! Where a gap outside of the droplet closes, a vertex that is nearer than delta to an edge elsewhere is pushed off
//! with the energy `(k/2)(delta - d)^2`. Where the liquid between two stretches is a film thinner than delta, the film
//! closes and the droplet breaks in two ([`Pair::Film`]), which is beyond this model. Parts that are neighbours along
//! the ring are left out: the half circle at the end of a film of thickness delta has the length `pi delta/2`, and
//! twice that counts as neighbourhood.

use crate::physics::liquid::jet::{Differentiable, Jet, Slope};
use crate::physics::liquid::polygon::{Polygon, following};
use std::f64::consts::PI;

/// The rule for which parts of the ring may touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SelfContact {
    delta: f64,
    stiffness: f64,
    /// Vertices and edges whose numbers differ by no more are neighbours.
    neighbours: usize,
}

/// A pair of a vertex and an edge that are closer than delta.
#[derive(Clone, Debug)]
pub(crate) enum Pair {
    /// They touch across a gap.
    Gap(Touch),
    /// The film of liquid between them is closing; where the vertex is.
    Film([f64; 2]),
}

/// What one touching pair adds to the energy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// The vertex, and the two vertices of the edge.
    pub(crate) vertices: [usize; 3],
    /// The place of the nearest point along the line of the edge.
    place: f64,
    pub(crate) energy: f64,
    pub(crate) gradient: [f64; 6],
}

impl SelfContact {
    /// Contact of a ring of `n` vertices with itself.
    pub(crate) fn new(n: usize, delta: f64, stiffness: f64) -> Self {
        let edge = PI / n as f64;
        Self { delta, stiffness, neighbours: 2 + (PI * delta / edge).ceil() as usize }
    }

    /// Lists the pairs of a vertex and an edge that are closer than `delta + skin`, and some more.
    pub(crate) fn list(&self, shape: &Polygon, skin: f64, pairs: &mut Vec<[usize; 2]>) {
        pairs.clear();
        let n = shape.len();
        let (longest, far) = (longest_edge(shape), self.delta + skin);
        let per_edge = 1.0 / longest;
        for vertex in 0..n {
            // Edges after the vertex, from the first that is no neighbour to the last.
            let mut ahead = self.neighbours + 1;
            while ahead + self.neighbours + 1 < n {
                let edge = if vertex + ahead < n { vertex + ahead } else { vertex + ahead - n };
                let (dx, dy) = (shape.x[vertex] - shape.x[edge], shape.y[vertex] - shape.y[edge]);
                let distance = (dx * dx + dy * dy).sqrt();
                if distance < far + longest {
                    pairs.push([vertex, edge]);
                    ahead += 1;
                } else {
                    // The ring comes nearer by no more than its own length.
                    ahead += (((distance - far) * per_edge) as usize).max(1);
                }
            }
        }
    }

    /// How a listed pair touches; `None` if it does not.
    pub(crate) fn touch(&self, shape: &Polygon, [vertex, edge]: [usize; 2]) -> Option<Pair> {
        let (squared, place) = separation(shape, vertex, edge);
        if squared >= self.delta * self.delta {
            return None;
        }
        if is_inside(shape, vertex, edge) {
            return Some(Pair::Film(shape.at(vertex)));
        }
        let vertices = [vertex, edge, following(edge, shape.len())];
        let Slope { value, gradient } = self.energy(shape, vertices, place);
        Some(Pair::Gap(Touch { vertices, place, energy: value, gradient }))
    }

    /// The second derivatives of a touch of this shape.
    pub(crate) fn stiffness(&self, shape: &Polygon, touch: &Touch) -> [[f64; 6]; 6] {
        self.energy::<Jet<6>>(shape, touch.vertices, touch.place).hessian
    }

    #[inline(always)]
    fn energy<N: Differentiable>(&self, shape: &Polygon, vertices: [usize; 3], place: f64) -> N {
        let [v, a, b] =
            [0, 1, 2].map(|k| [N::variable(shape.x[vertices[k]], 2 * k), N::variable(shape.y[vertices[k]], 2 * k + 1)]);
        let apart = |end: [N; 2]| {
            let (dx, dy) = (v[0] - end[0], v[1] - end[1]);
            (dx * dx + dy * dy + N::constant(1e-30)).sqrt()
        };
        let distance = if place <= 0.0 {
            apart(a)
        } else if place >= 1.0 {
            apart(b)
        } else {
            let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
            let cross = (v[0] - a[0]) * ey - (v[1] - a[1]) * ex;
            let length = (ex * ex + ey * ey).sqrt();
            let side = if cross.value() < 0.0 { -1.0 } else { 1.0 };
            cross * side * length.reciprocal()
        };
        let overlap = N::constant(self.delta) - distance;
        overlap * overlap * (0.5 * self.stiffness)
    }
}

/// Length of the longest edge.
fn longest_edge(shape: &Polygon) -> f64 {
    let n = shape.len();
    let squared = (0..n).fold(0.0_f64, |most, i| {
        let j = following(i, n);
        let (ex, ey) = (shape.x[j] - shape.x[i], shape.y[j] - shape.y[i]);
        most.max(ex * ex + ey * ey)
    });
    squared.sqrt()
}

/// Squared distance of a vertex from an edge, and the place of the nearest point along the edge's line.
fn separation(shape: &Polygon, vertex: usize, edge: usize) -> (f64, f64) {
    let next = following(edge, shape.len());
    let (rx, ry) = (shape.x[vertex] - shape.x[edge], shape.y[vertex] - shape.y[edge]);
    let (ex, ey) = (shape.x[next] - shape.x[edge], shape.y[next] - shape.y[edge]);
    let place = (rx * ex + ry * ey) / (ex * ex + ey * ey);
    let q = place.clamp(0.0, 1.0);
    let (dx, dy) = (rx - q * ex, ry - q * ey);
    (dx * dx + dy * dy, place)
}

/// Whether the edge has the vertex on its inner side, so that liquid is between them.
fn is_inside(shape: &Polygon, vertex: usize, edge: usize) -> bool {
    let next = following(edge, shape.len());
    let (rx, ry) = (shape.x[vertex] - shape.x[edge], shape.y[vertex] - shape.y[edge]);
    let (ex, ey) = (shape.x[next] - shape.x[edge], shape.y[next] - shape.y[edge]);
    ex * ry - ey * rx > 0.0
}

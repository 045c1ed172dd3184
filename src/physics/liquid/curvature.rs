//! Second derivatives of the energy: blocks along the ring, and pairs of parts that touch across the droplet.

use crate::physics::liquid::polygon::{following, preceding};

/// The second derivatives of a sum of terms that each depend on one edge, or on one vertex and one edge.
#[derive(Clone, Debug, Default)]
pub(crate) struct Curvature {
    /// xx, xy, yy of each vertex.
    own: Vec<[f64; 3]>,
    /// xx, xy, yx, yy of each vertex and the one after it.
    next: Vec<[f64; 4]>,
    /// Terms of a vertex and an edge elsewhere: the three vertices, and the derivatives by their x and y.
    far: Vec<([usize; 3], [[f64; 6]; 6])>,
}

impl Curvature {
    /// Forgets all terms; there are `n` vertices.
    pub(crate) fn clear(&mut self, n: usize) {
        self.own.clear();
        self.own.resize(n, [0.0; 3]);
        self.next.clear();
        self.next.resize(n, [0.0; 4]);
        self.far.clear();
    }

    /// Adds a term of edge `i`: the derivatives by x and y of its first and of its second vertex.
    pub(crate) fn add_edge(&mut self, i: usize, term: &[[f64; 4]; 4]) {
        let j = following(i, self.own.len());
        for (vertex, o) in [(i, 0), (j, 2)] {
            let own = &mut self.own[vertex];
            own[0] += term[o][o];
            own[1] += term[o][o + 1];
            own[2] += term[o + 1][o + 1];
        }
        for (k, (a, b)) in [(0, 2), (0, 3), (1, 2), (1, 3)].into_iter().enumerate() {
            self.next[i][k] += term[a][b];
        }
    }

    /// Adds a term of vertex `i`: xx, xy, yy.
    pub(crate) fn add_vertex(&mut self, i: usize, term: [f64; 3]) {
        for (own, value) in self.own[i].iter_mut().zip(term) {
            *own += value;
        }
    }

    /// Adds a term of three vertices.
    pub(crate) fn add_far(&mut self, vertices: [usize; 3], term: [[f64; 6]; 6]) {
        self.far.push((vertices, term));
    }

    /// The rows `of` (two a vertex, x and y) that multiply other rows, for the product with a matrix: calls `add(row,
    /// factor, other row)` for each entry, in a fixed order.
    pub(crate) fn for_each_entry(&self, mut add: impl FnMut(usize, f64, usize)) {
        let n = self.own.len();
        for i in 0..n {
            let (before, after) = (preceding(i, n), following(i, n));
            let ([xx, xy, yy], next, last) = (self.own[i], self.next[i], self.next[before]);
            for (a, own, following, preceding) in [
                (0, [xx, xy], [next[0], next[1]], [last[0], last[2]]),
                (1, [xy, yy], [next[2], next[3]], [last[1], last[3]]),
            ] {
                for b in 0..2 {
                    add(2 * i + a, preceding[b], 2 * before + b);
                    add(2 * i + a, own[b], 2 * i + b);
                    add(2 * i + a, following[b], 2 * after + b);
                }
            }
        }
        for (vertices, term) in &self.far {
            for (a, row) in term.iter().enumerate() {
                for (b, value) in row.iter().enumerate() {
                    add(2 * vertices[a / 2] + a % 2, *value, 2 * vertices[b / 2] + b % 2);
                }
            }
        }
    }
}

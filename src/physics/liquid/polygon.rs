//! The outline of a droplet as a polygon with even edges: lengths, area, centroid, and their derivatives.
//!
//! Vertices stand counter-clockwise. Edge `i` goes from vertex `i` to vertex `i + 1`. Positions are relative to an
//! origin that follows the droplet.

/// Places of the vertices, relative to the origin of the droplet.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Polygon {
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
}

/// The edges of a polygon.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    /// Edge vectors.
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
    pub(crate) length: Vec<f64>,
    /// Outward unit normals.
    pub(crate) nx: Vec<f64>,
    pub(crate) ny: Vec<f64>,
    pub(crate) perimeter: f64,
}

/// Area and centroid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Content {
    pub(crate) area: f64,
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Polygon {
    /// How many vertices it has.
    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    /// The vertex of number `i`.
    pub(crate) fn at(&self, i: usize) -> [f64; 2] {
        [self.x[i], self.y[i]]
    }

    /// The smallest box around it, `[x_min, x_max, y_min, y_max]`.
    pub(crate) fn bounds(&self) -> [f64; 4] {
        let ends = |v: &[f64]| v.iter().fold([f64::MAX, f64::MIN], |[lo, hi], &c| [lo.min(c), hi.max(c)]);
        let ([x0, x1], [y0, y1]) = (ends(&self.x), ends(&self.y));
        [x0, x1, y0, y1]
    }

    /// The largest distance of a vertex from that of the same number in `other`.
    pub(crate) fn largest_distance(&self, other: &Self) -> f64 {
        let mut largest: f64 = 0.0;
        for i in 0..self.len() {
            let (dx, dy) = (self.x[i] - other.x[i], self.y[i] - other.y[i]);
            // Written so that a NaN is the largest of all.
            let squared = dx * dx + dy * dy;
            if !(squared <= largest) {
                largest = squared;
            }
        }
        largest.sqrt()
    }

    /// Area `a = (1/2) sum c_i` and centroid `sum (r_i + r_{i+1}) c_i/(6 a)`, with the cross products `c_i = r_i x
    /// r_{i+1}` of neighbours, relative to vertex 0.
    pub(crate) fn content(&self) -> Content {
        let (x0, y0, n) = (self.x[0], self.y[0], self.len());
        let (mut twice, mut mx, mut my) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let j = following(i, n);
            let (ax, ay, bx, by) = (self.x[i] - x0, self.y[i] - y0, self.x[j] - x0, self.y[j] - y0);
            let cross = ax * by - bx * ay;
            twice += cross;
            mx += (ax + bx) * cross;
            my += (ay + by) * cross;
        }
        Content { area: 0.5 * twice, x: x0 + mx / (3.0 * twice), y: y0 + my / (3.0 * twice) }
    }

    /// Whether a point lies inside.
    pub(crate) fn contains(&self, [px, py]: [f64; 2]) -> bool {
        let n = self.len();
        let mut inside = false;
        for i in 0..n {
            let j = following(i, n);
            let (ay, by) = (self.y[i] - py, self.y[j] - py);
            if (ay > 0.0) != (by > 0.0) && self.x[i] - px + (self.x[j] - self.x[i]) * ay / (ay - by) > 0.0 {
                inside = !inside;
            }
        }
        inside
    }
}

impl Edges {
    /// Measures the edges of `polygon`.
    pub(crate) fn measure(&mut self, polygon: &Polygon) {
        let n = polygon.len();
        for column in [&mut self.x, &mut self.y, &mut self.length, &mut self.nx, &mut self.ny] {
            column.resize(n, 0.0);
        }
        self.perimeter = 0.0;
        for i in 0..n {
            let j = following(i, n);
            let (ex, ey) = (polygon.x[j] - polygon.x[i], polygon.y[j] - polygon.y[i]);
            let length = (ex * ex + ey * ey).sqrt();
            (self.x[i], self.y[i], self.length[i]) = (ex, ey, length);
            (self.nx[i], self.ny[i]) = (ey / length, -ex / length);
            self.perimeter += length;
        }
    }
}

/// The number after `i` in a ring of `n`.
pub(crate) const fn following(i: usize, n: usize) -> usize {
    if i + 1 == n { 0 } else { i + 1 }
}

/// The number before `i` in a ring of `n`.
pub(crate) const fn preceding(i: usize, n: usize) -> usize {
    if i == 0 { n - 1 } else { i - 1 }
}

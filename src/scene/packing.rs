//! Random sequential addition of discs in a periodic box.
//!
//! Darts are thrown only into small squares that no single disc covers wholly, and the squares are quartered when few
//! darts hit; that changes nothing in the distribution, and an empty list of squares proves saturation (Zhang and
//! Torquato, Phys. Rev. E 88, 053312 (2013)).

use crate::job::ObstacleField;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Positions are multiples of this, so that moving them by whole boxes and origins is exact.
const GRAIN: f64 = 1.0 / (1_u64 << 34) as f64;

/// The random stream that arrays draw from; other purposes use other numbers.
const ARRAY_STREAM: u64 = 1;

/// Discs while they are being placed.
pub(super) struct Packing {
    box_size: f64,
    /// Smallest distance of two centres.
    spacing: f64,
    /// Centres, x.
    pub(super) x: Vec<f64>,
    /// Centres, y.
    pub(super) y: Vec<f64>,
    /// Index + 1 of the disc in each cell; a cell is too small for two.
    grid: Vec<u32>,
    cells: usize,
    random: ChaCha8Rng,
}

impl Packing {
    /// An empty box.
    pub(super) fn new(field: &ObstacleField, seed: u64) -> Self {
        let spacing = field.sigma_ob + field.w_ob;
        // The diagonal of a cell is shorter than the spacing.
        let cells = (field.box_size / (spacing * std::f64::consts::FRAC_1_SQRT_2)).ceil() as usize + 1;
        let mut key = [0_u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let mut random = ChaCha8Rng::from_seed(key);
        random.set_stream(ARRAY_STREAM);
        let grid = vec![0; cells * cells];
        Self { box_size: field.box_size, spacing, x: Vec::new(), y: Vec::new(), grid, cells, random }
    }

    /// Uniform in [0, 1).
    fn uniform(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn cell(&self, c: f64) -> usize {
        ((c / self.box_size * self.cells as f64) as usize).min(self.cells - 1)
    }

    /// Calls `visit` with each disc near the point, relative to it, until it answers false; tells whether it never did.
    fn all_near(&self, x: f64, y: f64, mut visit: impl FnMut(f64, f64) -> bool) -> bool {
        let n = self.cells as i64;
        let (cx, cy) = (self.cell(x) as i64, self.cell(y) as i64);
        let half = 0.5 * self.box_size;
        let wrap = |d: f64| {
            if d > half {
                d - self.box_size
            } else if d < -half {
                d + self.box_size
            } else {
                d
            }
        };
        for row in cy - 2..=cy + 2 {
            let base = row.rem_euclid(n) * n;
            for column in cx - 2..=cx + 2 {
                let slot = self.grid[(base + column.rem_euclid(n)) as usize];
                if slot != 0 {
                    let i = slot as usize - 1;
                    if !visit(wrap(self.x[i] - x), wrap(self.y[i] - y)) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Throws one dart into the square of side `side` with this lower corner; tells whether it became a disc.
    fn dart(&mut self, x: f64, y: f64, side: f64) -> bool {
        let grain = |c: f64| (c / GRAIN).floor() * GRAIN;
        let (x, y) = (grain(x + side * self.uniform()), grain(y + side * self.uniform()));
        let square = self.spacing * self.spacing;
        if x >= self.box_size || y >= self.box_size || !self.all_near(x, y, |dx, dy| dx * dx + dy * dy > square) {
            return false;
        }
        self.x.push(x);
        self.y.push(y);
        let slot = self.cell(y) * self.cells + self.cell(x);
        self.grid[slot] = self.x.len() as u32;
        true
    }

    /// Whether one disc forbids the whole square to further centres.
    fn covered(&self, x: f64, y: f64, side: f64) -> bool {
        let half = 0.5 * side;
        let square = self.spacing * self.spacing;
        let far = |d: f64| d.abs() + half;
        !self.all_near(x + half, y + half, |dx, dy| far(dx) * far(dx) + far(dy) * far(dy) > square)
    }

    /// Adds discs until there are `wanted`, or no further one fits.
    pub(super) fn fill(&mut self, wanted: usize) {
        // First into the whole box, until darts mostly miss.
        let (mut hits, mut darts) = (0, 0);
        while self.x.len() < wanted && (darts < 1000 || hits * 10 > darts) {
            if darts >= 100_000 {
                (hits, darts) = (hits / 2, darts / 2);
            }
            hits += usize::from(self.dart(0.0, 0.0, self.box_size));
            darts += 1;
        }
        let mut side = self.box_size / self.cells as f64;
        let mut squares: Vec<[f64; 2]> = Vec::new();
        for row in 0..self.cells {
            for column in 0..self.cells {
                let corner = [column as f64 * side, row as f64 * side];
                if self.x.len() < wanted && !self.covered(corner[0], corner[1], side) {
                    squares.push(corner);
                }
            }
        }
        // Then into the squares that are left, quartered again and again.
        while self.x.len() < wanted && !squares.is_empty() {
            for _ in 0..squares.len() {
                let pick = (self.uniform() * squares.len() as f64) as usize;
                let [x, y] = squares[pick];
                if self.dart(x, y, side) && self.x.len() >= wanted {
                    return;
                }
            }
            let half = 0.5 * side;
            let quarters = |[x, y]: [f64; 2]| [[x, y], [x + half, y], [x, y + half], [x + half, y + half]];
            squares = squares.into_iter().flat_map(quarters).filter(|&[x, y]| !self.covered(x, y, half)).collect();
            side = half;
            if side < 4.0 * GRAIN {
                return;
            }
        }
    }
}

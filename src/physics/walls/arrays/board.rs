//! The board that darts are thrown at: a periodic box, its grid of cells, and the random streams of a seed.
//!
//! The diagonal of a cell is shorter than the spacing. So a cell holds at most one disc, and discs that are closer to a
//! place in it than the spacing lie at most two cells away.

use crate::parameters::ObstacleField;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Positions are multiples of this, in sigma. Then it is exact to shift them by an origin, and by the side of the box
/// if that is a multiple too.
pub(super) const GRAIN: f64 = 1.0 / (1_u64 << 34) as f64;

/// What a random stream of a seed is for. Each has its own number.
#[derive(Clone, Copy)]
pub(super) enum Stream {
    /// Darts into the whole box.
    Box,
    /// The first dart of each cell of a tile.
    Tile(usize),
    /// The further darts of a cell.
    Cell(usize),
}

/// A periodic box in which no two discs may come closer than the spacing, and its grid.
#[derive(Clone, Debug)]
pub(super) struct Board {
    pub(super) box_size: f64,
    /// Smallest distance of two centres.
    pub(super) spacing: f64,
    pub(super) cells: usize,
    pub(super) width: f64,
    random: ChaCha8Rng,
}

impl Board {
    pub(super) fn new(field: &ObstacleField, seed: u64) -> Self {
        let spacing = field.sigma_ob + field.w_ob;
        // One more than the number for which the diagonal equals the spacing.
        let mut cells = (field.box_size / (spacing * std::f64::consts::FRAC_1_SQRT_2)).ceil() as usize + 1;
        // In a small box that may be too many, because two cells must be at least as wide as the spacing.
        if 2.0 * field.box_size / (cells as f64) < spacing {
            cells -= 1;
        }
        // Cells are numbered by u32. Campaigns with larger boxes are refused earlier.
        assert!(cells < 1 << 16, "a box of {} is too large for discs {spacing} apart", field.box_size);
        let mut key = [0_u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        let random = ChaCha8Rng::from_seed(key);
        Self { box_size: field.box_size, spacing, cells, width: field.box_size / cells as f64, random }
    }

    /// A random stream from its beginning.
    pub(super) fn stream(&self, stream: Stream) -> ChaCha8Rng {
        let mut random = self.random.clone();
        random.set_stream(match stream {
            Stream::Box => 1,
            Stream::Tile(tile) => (1 << 32) + tile as u64,
            Stream::Cell(cell) => (1 << 33) + cell as u64,
        });
        random
    }

    /// Column or row of the cell that a coordinate lies in.
    pub(super) fn cell_at(&self, c: f64) -> usize {
        ((c / self.box_size * self.cells as f64) as usize).min(self.cells - 1)
    }

    pub(super) fn corner(&self, cell: [usize; 2]) -> [f64; 2] {
        cell.map(|c| c as f64 * self.width)
    }

    /// The cell some columns and rows away, and the shift of its places as seen from here: beyond the edges of the box
    /// lie its periodic images.
    pub(super) fn beside(&self, cell: [usize; 2], away: [i64; 2]) -> ([usize; 2], [f64; 2]) {
        let n = self.cells as i64;
        let [column, row] = [cell[0] as i64 + away[0], cell[1] as i64 + away[1]];
        let shift = [column, row].map(|c| c.div_euclid(n) as f64 * self.box_size);
        ([column, row].map(|c| c.rem_euclid(n) as usize), shift)
    }
}

/// Uniform in [0, 1).
pub(super) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// A random place in the square of side `side` with this lower corner.
pub(super) fn place(random: &mut ChaCha8Rng, corner: [f64; 2], side: f64) -> [f64; 2] {
    corner.map(|c| ((c + side * uniform(random)) / GRAIN).floor() * GRAIN)
}

/// Time to the next of random events that come once in a unit of time on average.
pub(super) fn wait(random: &mut ChaCha8Rng) -> f64 {
    -libm::log(1.0 - uniform(random))
}

#[inline(always)]
pub(super) fn squared_distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    let [dx, dy] = [from[0] - to[0], from[1] - to[1]];
    dx * dx + dy * dy
}
